// The words of a grid (kernels/packed/traversal_words.hpp), read for one ray per lane: those of voxels or
// bricks, and those of the children that cells are cut into.
//
// Compiled once for each target, so the include guard toggles.
#if defined(NIF_PLANES_LANE_GRID_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef NIF_PLANES_LANE_GRID_INL
#undef NIF_PLANES_LANE_GRID_INL
#else
#define NIF_PLANES_LANE_GRID_INL
#endif

#include "kernels/cpu/planes/ray_lanes-inl.hpp"
#include "kernels/packed/traversal_grid.hpp"

HWY_BEFORE_NAMESPACE();
namespace nif::kernels::cpu::HWY_NAMESPACE {

HWY_INLINE hn::Mask<Ints> is_kind(hn::Vec<Ints> word, WordKind kind) {
  const Ints di;
  return hn::Eq(hn::And(word, hn::Set(di, 15)), hn::Set(di, int32_t(kind)));
}

class LaneGrid {
 public:
  LaneGrid(const PlanesField& field, const TraversalGrid& grid)
      : top_(reinterpret_cast<const int32_t*>(grid.top().data())),
        voxels_(reinterpret_cast<const int32_t*>(grid.voxels.data())),
        children_(reinterpret_cast<const int32_t*>(grid.children.data())),
        levels_(field.levels),
        link_levels_(grid.children.empty() ? 0 : field.levels),
        brick_levels_(grid.brick_levels),
        voxel_size_(static_cast<float>(1u << field.levels)),
        brick_size_(static_cast<float>(1u << (field.levels + grid.brick_levels))),
        cells_to_bricks_(1 / brick_size_) {
    const float stride[3] = {1, float(grid.size[0]), float(grid.size[0] * grid.size[1])};
    for (uint32_t octant = 0; octant < 8; ++octant) {
      base_[octant] = 0;
      if (kWithBricks) flip_[octant] = 0;
      reach_[octant] = 0;
      for (uint32_t a = 0; a < 3; ++a) {
        const bool negative = (octant >> a) & 1;
        strides_[a][octant] = negative ? -stride[a] : stride[a];
        // Mirrored brick b is brick -b - 1; within it, the bits of a place are inverted.
        if (negative) base_[octant] -= stride[a];
        if (negative && kWithBricks) flip_[octant] |= int32_t((1u << brick_levels_) - 1) << a * brick_levels_;
        reach_[octant] |= (negative ? 0x0f : 0xf0) << (8 + 8 * a);
      }
    }
  }

  /// In finest cells.
  float voxel_size() const { return voxel_size_; }
  /// How often links lead from a cell to its children, at most.
  uint32_t link_levels() const { return link_levels_; }

  /// The words of the voxels, or of the bricks, that hold the given lanes' cells.
  HWY_INLINE hn::Vec<Ints> words_at(const hn::Vec<Floats> (&cell)[3], hn::Vec<Ints> info,
                                    hn::Mask<Floats> lanes) const {
    const Floats d;
    const Ints di;
    const auto octant = hn::And(info, hn::Set(di, kOctant));
    auto number = look_up<8>(d, base_, octant);  // exact: integers below 2^24
    for (uint32_t a = 0; a < 3; ++a) {
      const auto brick = hn::Floor(hn::Mul(cell[a], hn::Set(d, cells_to_bricks_)));
      number = hn::MulAdd(brick, look_up<8>(d, strides_[a], octant), number);
    }
    // Lanes that are done may have left the grid.
    const auto word = gather(di, top_, hn::IfThenElseZero(hn::RebindMask(di, lanes), to_ints(number)));
    if (!kWithBricks || brick_levels_ == 0) return word;
    auto place = look_up<8>(di, flip_, octant);
    const auto in_brick = hn::Set(di, int32_t((1u << brick_levels_) - 1));
    for (uint32_t a = 0; a < 3; ++a) {
      const auto voxel = hn::ShiftRightSame(to_ints(cell[a]), int(levels_));
      place = hn::Xor(place, hn::ShiftLeftSame(hn::And(voxel, in_brick), int(a * brick_levels_)));
    }
    const auto mixed = is_kind(word, kLink);
    const auto first = hn::BitCast(di, hn::ShiftRight<4>(hn::BitCast(Words(), word)));
    const auto of_voxel = gather(di, voxels_, hn::IfThenElseZero(mixed, hn::Add(first, place)));
    return hn::IfThenElse(mixed, of_voxel, word);
  }

  /// The words of the children of 2^level finest cells that hold the given lanes' cells. `from`: the words of
  /// the cells that are cut into these children.
  HWY_INLINE hn::Vec<Ints> children_at(hn::Vec<Ints> from, uint32_t level, const hn::Vec<Floats> (&cell)[3],
                                       hn::Vec<Ints> info, hn::Mask<Ints> lanes) const {
    const Ints di;
    // Mirrored cell c is cell -c - 1, whose bits are inverted.
    const auto half = hn::Set(di, 1 << level);
    auto octant = hn::And(info, hn::Set(di, kOctant));
    for (uint32_t a = 0; a < 3; ++a)
      octant = hn::Xor(octant, hn::IfThenElseZero(hn::TestBit(to_ints(cell[a]), half), hn::Set(di, 1 << a)));
    const auto mask = hn::ShiftRight<4>(from);
    const auto bit = shifted(1, octant);
    const auto there = hn::And(hn::TestBit(mask, bit), lanes);
    const auto before = count_bits_of_byte(hn::And(mask, hn::Sub(bit, hn::Set(di, 1))));
    const auto first = hn::BitCast(di, hn::ShiftRight<12>(hn::BitCast(Words(), from)));
    const auto index = hn::IfThenElseZero(there, hn::Add(first, before));
    return hn::IfThenElse(there, gather(di, children_, index), hn::Set(di, int32_t(kEmptyChild)));
  }

  /// Sizes of the cubes that words stand for: `size`, except for bricks.
  HWY_INLINE hn::Vec<Floats> sizes_of(hn::Vec<Ints> word, hn::Vec<Floats> size) const {
    if (!kWithBricks || brick_levels_ == 0) return size;
    const Ints di;
    const auto brick = hn::Eq(hn::And(word, hn::Set(di, int32_t(kBrickMask))),
                              hn::Set(di, int32_t(kBrickBit | kEmptyVoxel)));
    return hn::IfThenElse(hn::RebindMask(Floats(), brick), hn::Set(Floats(), brick_size_), size);
  }

  /// How far boxes reach along the three axes, in bytes 1 to 3 of each word.
  HWY_INLINE hn::Vec<Ints> reach_of(hn::Vec<Ints> word, hn::Vec<Ints> info) const {
    const Ints di;
    const Words dw;
    const auto octant = hn::And(info, hn::Set(di, kOctant));
    const auto reach = hn::BitCast(dw, hn::And(word, look_up<8>(di, reach_, octant)));
    return hn::BitCast(di, hn::Or(reach, hn::ShiftRight<4>(reach)));
  }

 private:
  const int32_t* top_;  ///< words of bricks, or of voxels if there are none
  const int32_t* voxels_;
  const int32_t* children_;
  uint32_t levels_;
  uint32_t link_levels_;
  uint32_t brick_levels_;
  float voxel_size_, brick_size_;  ///< in finest cells
  float cells_to_bricks_;
  // By octant: strides of bricks along each axis, the number of the brick at 0, the bits that are inverted in
  // places within bricks, and the box extents that count.
  static constexpr uint32_t kOctants = kLanes > 8 ? kLanes : 8;
  alignas(64) float strides_[3][kOctants];
  alignas(64) float base_[kOctants];
  alignas(64) int32_t flip_[kOctants];
  alignas(64) int32_t reach_[kOctants];
};

}  // namespace nif::kernels::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
