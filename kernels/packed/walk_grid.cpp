#include "kernels/packed/walk_grid.hpp"

#include <algorithm>

#include "kernels/reference/proof/walk.hpp"

namespace nif::kernels::cpu {
namespace {

static_assert(uint64_t{kMaxVoxels} * kMaxVoxels * kMaxVoxels <= uint64_t{1} << 24);

/// How many voxels are alike in any box: sums over all voxels below and before each (Crow 1984).
class Counts {
 public:
  Counts(const uint32_t (&size)[3], std::pmr::memory_resource* memory)
      : row_(size[0] + 1), layer_(row_ * (size[1] + 1)), sums_(layer_ * (size[2] + 1), memory) {}

  template <class Counted>
  void count(const uint32_t (&size)[3], const Counted& counted) {
    size_t voxel = 0;
    for (size_t z = 1; z <= size[2]; ++z)
      for (size_t y = 1; y <= size[1]; ++y) {
        uint32_t in_row = 0;
        for (size_t x = 1; x <= size[0]; ++x) {
          in_row += counted(voxel++) ? 1u : 0u;
          const size_t at = x + row_ * y + layer_ * z;
          sums_[at] = in_row + sums_[at - row_] + sums_[at - layer_] - sums_[at - row_ - layer_];
        }
      }
  }

  /// In voxels low to high, the last included.
  uint32_t within(const int32_t (&low)[3], const int32_t (&high)[3]) const {
    const size_t x0 = size_t(low[0]), x1 = size_t(high[0]) + 1;
    const auto between = [&](int32_t y, int32_t z) {
      const uint32_t* row = sums_.data() + row_ * size_t(y) + layer_ * size_t(z);
      return row[x1] - row[x0];
    };
    return between(high[1] + 1, high[2] + 1) - between(low[1], high[2] + 1) - between(high[1] + 1, low[2]) +
           between(low[1], low[2]);
  }

 private:
  size_t row_, layer_;
  std::pmr::vector<uint32_t> sums_;
};

/// A box around a voxel, which grows while it holds nothing but what is counted.
struct Box {
  const uint32_t (&size)[3];
  const Counts& counts;
  int32_t low[3], high[3], most[6];  ///< most: to which each side may reach

  Box(const uint32_t (&size_)[3], const Counts& counts_, const int32_t (&voxel)[3])
      : size(size_), counts(counts_) {
    for (uint32_t a = 0; a < 3; ++a) {
      low[a] = high[a] = voxel[a];
      most[2 * a] = std::max(voxel[a] - int32_t(kMaxExtent), 0);
      most[2 * a + 1] = std::min(voxel[a] + int32_t(kMaxExtent), int32_t(size[a]) - 1);
    }
  }

  /// By so much on the sides from `first` to `last`: as a whole, or not at all.
  bool grow(uint32_t first, uint32_t last, int32_t by) {
    int32_t new_low[3], new_high[3];
    uint32_t volume = 1;
    for (uint32_t a = 0; a < 3; ++a) {
      const bool down = first <= 2 * a && 2 * a <= last, up = first <= 2 * a + 1 && 2 * a + 1 <= last;
      new_low[a] = down ? std::max(low[a] - by, most[2 * a]) : low[a];
      new_high[a] = up ? std::min(high[a] + by, most[2 * a + 1]) : high[a];
      volume *= uint32_t(new_high[a] - new_low[a] + 1);
    }
    if (counts.within(new_low, new_high) != volume) return false;
    std::copy_n(new_low, 3, low);
    std::copy_n(new_high, 3, high);
    return true;
  }
};

}  // namespace

WalkGrid::WalkGrid(const ProofField& field, std::pmr::memory_resource* memory)
    : voxels(memory), parts(field.parts, field.parts + field.part_count, memory) {
  const uint32_t(&size)[3] = field.voxels;
  voxels.reserve(size_t(size[0]) * size[1] * size[2]);
  bool present[4] = {};  // [side]
  for (int32_t z = 0; z < int32_t(size[2]); ++z)
    for (int32_t y = 0; y < int32_t(size[1]); ++y)
      for (int32_t x = 0; x < int32_t(size[0]); ++x) {
        const int32_t voxel[3] = {x, y, z};
        const uint32_t word = voxel_word(field, voxel);
        voxels.push_back(word);
        if (word_kind(word) == kEmptyVoxel) present[empty_side(word)] = true;
      }

  Counts counts(size, memory);
  for (uint32_t side = 0; side < 4; ++side) {
    if (!present[side]) continue;
    // Boxes that are written meanwhile keep kind and side.
    const auto alike = [&](size_t voxel) { return (voxels[voxel] & 0xff) == make_empty(side); };
    counts.count(size, alike);
    size_t at = 0;
    for (int32_t z = 0; z < int32_t(size[2]); ++z)
      for (int32_t y = 0; y < int32_t(size[1]); ++y)
        for (int32_t x = 0; x < int32_t(size[0]); ++x, ++at) {
          if (!alike(at)) continue;
          const int32_t voxel[3] = {x, y, z};
          Box box(size, counts, voxel);
          // First as a cube, then each side by itself.
          for (int32_t by = 8; by > 0; by /= 2) box.grow(0, 5, by);
          for (int32_t by = 4; by > 0; by /= 2)
            for (uint32_t side_of_box = 0; side_of_box < 6; ++side_of_box)
              box.grow(side_of_box, side_of_box, by);
          uint32_t extents[6];
          for (uint32_t a = 0; a < 3; ++a) {
            extents[2 * a] = uint32_t(voxel[a] - box.low[a]);
            extents[2 * a + 1] = uint32_t(box.high[a] - voxel[a]);
          }
          voxels[at] = make_boxed(side, extents);
        }
  }
}

}  // namespace nif::kernels::cpu
