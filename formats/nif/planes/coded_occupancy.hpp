// Codes an occupancy grid: first the kind of each brick, then the voxels of mixed bricks, each in the context
// of its already known neighbours. What can be counted is not stored.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <memory>
#include <type_traits>

#include "formats/base/range_coder.hpp"
#include "kernels/reference/planes/walk.hpp"

namespace nif::format {

/// The arrays of an occupancy payload (docs/format.md). Byte: std::byte, const for reading.
template <class Byte>
struct OccupancyArrays {
  template <class T>
  using Array = std::conditional_t<std::is_const_v<Byte>, const T*, T*>;
  Array<kernels::BrickStates> brick_states;
  Array<uint32_t> voxel_base;
  Array<uint16_t> brick_table;

  /// In a payload of `mixed` mixed bricks, which starts at a multiple of 8.
  OccupancyArrays(Byte* at, size_t mixed)
      : brick_states(reinterpret_cast<Array<kernels::BrickStates>>(at)),
        voxel_base(reinterpret_cast<Array<uint32_t>>(brick_states + mixed)),
        brick_table(reinterpret_cast<Array<uint16_t>>(voxel_base + mixed)) {}
};

template <class Coder>
class OccupancyCoder {
 public:
  /// Reads only the numbers of voxels, bricks and mixed bricks of `field`. `to` starts as zeros.
  OccupancyCoder(Coder& coder, const kernels::PlanesField& field, const OccupancyArrays<std::byte>& to)
      : coder_(coder), field_(field), to_(to), models_(std::make_unique<Models>()) {}

  /// Fills the arrays. `truth` is what to encode, with bricks in order; null when decoding. Returns false if
  /// no encoder could have made this: then the arrays are undefined.
  bool code(const kernels::PlanesField* truth) {
    if (!code_table(truth)) return false;
    uint32_t voxels = 0;
    return each_mixed_brick([&](uint32_t i, const Place& at) {
      if (!code_states(truth, i, at)) return false;
      to_.voxel_base[i] = voxels;
      voxels += uint32_t(std::popcount(to_.brick_states[i].surface & ~to_.brick_states[i].aux));
      return true;
    });
  }

 private:
  using Place = std::array<int32_t, 3>;  // of a brick in the grid of bricks, or of a voxel

  static constexpr uint32_t kMixed = kernels::kFirstMixedBrick, kNone = kMixed + 1, kKinds = kNone + 1;
  static_assert(kMixed == uint32_t(kernels::VoxelState::surface));
  static constexpr uint32_t kNeighbours = 13;

  struct Models {
    SymbolModel<2> kinds[kKinds][kKinds][kKinds];
    std::array<BitModel, 1u << kNeighbours> surface;
    SymbolModel<2> others[kKinds];
  };

  bool within(const Place& at, const uint32_t (&size)[3]) const {
    for (size_t a = 0; a < 3; ++a)
      if (at[a] < 0 || at[a] >= int32_t(size[a])) return false;
    return true;
  }
  uint16_t& entry(const Place& brick) const {
    const size_t row = size_t(brick[1]) + field_.bricks[1] * size_t(brick[2]);
    return to_.brick_table[size_t(brick[0]) + field_.bricks[0] * row];
  }
  /// kNone beyond the grid.
  uint32_t kind(const Place& brick) const {
    return within(brick, field_.bricks) ? std::min<uint32_t>(entry(brick), kMixed) : kNone;
  }
  template <class Visit>
  void each_brick(const Visit& visit) const {
    for (int32_t z = 0; z < int32_t(field_.bricks[2]); ++z)
      for (int32_t y = 0; y < int32_t(field_.bricks[1]); ++y)
        for (int32_t x = 0; x < int32_t(field_.bricks[0]); ++x) visit(Place{x, y, z});
  }
  /// Calls visit(index, place) until it returns false. Returns false if it did.
  template <class Visit>
  bool each_mixed_brick(const Visit& visit) const {
    bool going = true;
    each_brick([&](const Place& at) {
      if (going && entry(at) >= kMixed) going = visit(entry(at) - kMixed, at);
    });
    return going;
  }

  bool code_table(const kernels::PlanesField* truth) {
    uint32_t mixed = 0;
    size_t brick = 0;
    each_brick([&](const Place& at) {
      const auto [x, y, z] = at;
      SymbolModel<2>& model = models_->kinds[kind({x - 1, y, z})][kind({x, y - 1, z})][kind({x, y, z - 1})];
      const uint32_t value =
          model.code(coder_, truth ? std::min<uint32_t>(truth->brick_table[brick], kMixed) : 0);
      ++brick;
      entry(at) = uint16_t(value < kMixed ? value : kMixed + mixed);
      mixed += value == kMixed;
    });
    return mixed == field_.mixed_bricks;
  }

  /// A state, outside beyond the grid, or kMixed (surface); outside for voxels in mixed bricks that are not
  /// known yet.
  uint32_t state(const Place& voxel) const {
    if (!within(voxel, field_.voxels)) return kernels::kBrickOutside;
    const uint32_t known = entry({voxel[0] >> 2, voxel[1] >> 2, voxel[2] >> 2});
    if (known < kMixed) return known;
    const uint32_t bit = uint32_t(voxel[0] & 3) + 4 * uint32_t(voxel[1] & 3) + 16 * uint32_t(voxel[2] & 3);
    return uint32_t(kernels::state_in(to_.brick_states[known - kMixed], bit));
  }
  /// The same, but kNone in mixed bricks.
  uint32_t state_of_brick(const Place& voxel) const {
    if (!within(voxel, field_.voxels)) return kernels::kBrickOutside;
    const uint32_t known = entry({voxel[0] >> 2, voxel[1] >> 2, voxel[2] >> 2});
    return known < kMixed ? known : kNone;
  }

  bool code_states(const kernels::PlanesField* truth, uint32_t mixed, const Place& brick) {
    kernels::BrickStates& states = to_.brick_states[mixed];
    for (uint32_t bit = 0; bit < 64; ++bit) {
      const Place at{4 * brick[0] + int32_t(bit & 3), 4 * brick[1] + int32_t(bit >> 2 & 3),
                     4 * brick[2] + int32_t(bit >> 4)};
      if (!within(at, field_.voxels)) continue;
      const uint32_t value =
          code_state(at, truth ? uint32_t(kernels::state_in(truth->brick_states[mixed], bit)) : 0);
      if (value == kNone) return false;
      const uint64_t mask = uint64_t{1} << bit;
      if (value == kMixed || value == kernels::kBrickUnknown) states.surface |= mask;
      if (value == kernels::kBrickInside || value == kernels::kBrickUnknown) states.aux |= mask;
    }
    return true;
  }

  /// kNone if no encoder would say this.
  uint32_t code_state(const Place& at, uint32_t truth) {
    static constexpr int8_t kBefore[kNeighbours - 1][3] = {{-1, 0, 0},  {0, -1, 0},  {0, 0, -1}, {-1, -1, 0},
                                                           {-1, 0, -1}, {0, -1, -1}, {1, -1, 0}, {1, 0, -1},
                                                           {0, 1, -1},  {-2, 0, 0},  {0, -2, 0}, {0, 0, -2}};
    uint32_t context = 0, empty = kNone;
    for (uint32_t i = 0; i < kNeighbours - 1; ++i) {
      const uint32_t beside = state({at[0] + kBefore[i][0], at[1] + kBefore[i][1], at[2] + kBefore[i][2]});
      context |= uint32_t(beside == kMixed) << i;
      if (i < 3 && beside != kMixed) empty = beside;
    }
    for (size_t a = 0; a < 3; ++a) {
      Place after = at;
      ++after[a];
      const uint32_t beside = state_of_brick(after);
      if (beside == kNone) continue;
      context |= 1u << (kNeighbours - 1);
      empty = beside;
    }
    if (coder_.bit(models_->surface[context], truth == kMixed)) return kMixed;
    // Touching voxels without surface usually belong to one region.
    const uint32_t value = models_->others[empty].code(coder_, truth);
    return value < kMixed ? value : kNone;
  }

  Coder& coder_;
  const kernels::PlanesField& field_;
  const OccupancyArrays<std::byte> to_;
  const std::unique_ptr<Models> models_;
};

}  // namespace nif::format
