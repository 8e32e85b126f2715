// Codes an occupancy grid (docs/format.md, "Occupancy"): first the kind of each brick, then the voxels of
// mixed bricks, each in the context of its already known neighbours. What can be counted is not stored.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <memory>
#include <type_traits>

#include "formats/base/range_coder.hpp"
#include "kernels/reference/planes/grid_traversal.hpp"

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

/// The states of voxels while they become known, brick by brick, and what they let expect of the next ones.
class KnownVoxels {
 public:
  using Coordinates = std::array<int32_t, 3>;  ///< of a voxel, or of a brick in the grid of bricks

  /// Kinds of bricks, and states of voxels: those of BrickTableEntry, and two more.
  static constexpr uint32_t kMixed = kernels::kFirstMixedBrick, kSurface = kMixed, kNone = kMixed + 1,
                            kKinds = kNone + 1;
  static_assert(kSurface == uint32_t(kernels::VoxelState::surface));

  /// Uses only the numbers of voxels and bricks of `grid`. `to` starts as zeros.
  KnownVoxels(const kernels::PlanesField& grid, const OccupancyArrays<std::byte>& to)
      : grid_(grid), to_(to) {}

  bool within_grid(const Coordinates& voxel) const { return within(voxel, grid_.voxels); }
  uint16_t& entry(const Coordinates& brick) const {
    const size_t row = size_t(brick[1]) + grid_.bricks[1] * size_t(brick[2]);
    return to_.brick_table[size_t(brick[0]) + grid_.bricks[0] * row];
  }
  /// kNone beyond the grid.
  uint32_t kind(const Coordinates& brick) const {
    return within(brick, grid_.bricks) ? std::min<uint32_t>(entry(brick), kMixed) : kNone;
  }
  /// Outside beyond the grid, and for voxels in mixed bricks that are not known yet.
  uint32_t state(const Coordinates& voxel) const {
    const uint32_t whole = state_of_brick(voxel);
    if (whole != kNone) return whole;
    const uint32_t bit = uint32_t(voxel[0] & 3) + 4 * uint32_t(voxel[1] & 3) + 16 * uint32_t(voxel[2] & 3);
    return uint32_t(kernels::state_in(to_.brick_states[entry(brick_of(voxel)) - kMixed], bit));
  }
  /// The same, but kNone in mixed bricks.
  uint32_t state_of_brick(const Coordinates& voxel) const {
    if (!within_grid(voxel)) return kernels::kBrickOutside;
    const uint32_t known = entry(brick_of(voxel));
    return known < kMixed ? known : kNone;
  }

  struct Context {
    uint32_t surface;  ///< bit by bit, which neighbours are surface, and whether a later one is known
    uint32_t like;     ///< the state of a neighbour that is not surface, or kNone
  };
  static constexpr uint32_t kNeighbours = 13;
  Context context(const Coordinates& voxel) const {
    static constexpr int8_t kBefore[kNeighbours - 1][3] = {{-1, 0, 0},  {0, -1, 0},  {0, 0, -1}, {-1, -1, 0},
                                                           {-1, 0, -1}, {0, -1, -1}, {1, -1, 0}, {1, 0, -1},
                                                           {0, 1, -1},  {-2, 0, 0},  {0, -2, 0}, {0, 0, -2}};
    Context context{0, kNone};
    for (uint32_t i = 0; i < kNeighbours - 1; ++i) {
      const auto& step = kBefore[i];
      const uint32_t beside = state({voxel[0] + step[0], voxel[1] + step[1], voxel[2] + step[2]});
      context.surface |= uint32_t(beside == kSurface) << i;
      if (i < 3 && beside != kSurface) context.like = beside;
    }
    for (size_t a = 0; a < 3; ++a) {
      Coordinates after = voxel;
      ++after[a];
      const uint32_t beside = state_of_brick(after);
      if (beside == kNone) continue;
      context.surface |= 1u << (kNeighbours - 1);
      context.like = beside;
    }
    return context;
  }

 private:
  static bool within(const Coordinates& at, const uint32_t (&size)[3]) {
    for (size_t a = 0; a < 3; ++a)
      if (at[a] < 0 || at[a] >= int32_t(size[a])) return false;
    return true;
  }
  static Coordinates brick_of(const Coordinates& voxel) {
    return {voxel[0] >> 2, voxel[1] >> 2, voxel[2] >> 2};
  }

  const kernels::PlanesField& grid_;
  const OccupancyArrays<std::byte> to_;
};

/// Like CellCoder, one function for each element: it is given the value to encode, which a decoder does not
/// look at, and returns the value that is in the file.
template <class Coder>
class OccupancyCoder {
 public:
  /// Uses only the numbers of voxels, bricks and mixed bricks of `grid`. `to` starts as zeros.
  OccupancyCoder(Coder& coder, const kernels::PlanesField& grid, const OccupancyArrays<std::byte>& to)
      : coder_(coder), grid_(grid), to_(to), known_(grid, to), models_(std::make_unique<Models>()) {}

  /// Fills the arrays. `truth` is what to encode, with bricks in order; null when decoding. Returns false if
  /// the file is damaged: then the arrays are undefined.
  bool code(const kernels::PlanesField* truth) {
    if (!code_bricks(truth)) return false;
    uint32_t voxels = 0;
    bool good = true;
    each_brick([&](const Coordinates& brick) {
      const uint32_t entry = known_.entry(brick);
      if (!good || entry < KnownVoxels::kMixed) return;
      const uint32_t i = entry - KnownVoxels::kMixed;
      good = code_voxels(brick, truth ? &truth->brick_states[i] : nullptr, to_.brick_states[i]);
      to_.voxel_base[i] = voxels;
      voxels += uint32_t(std::popcount(to_.brick_states[i].surface & ~to_.brick_states[i].aux));
    });
    return good;
  }

 private:
  using Coordinates = KnownVoxels::Coordinates;

  struct Models {
    static constexpr uint32_t kKinds = KnownVoxels::kKinds;
    SymbolModel<2> kind[kKinds][kKinds][kKinds];                   ///< kinds before along x, y, z
    std::array<BitModel, 1u << KnownVoxels::kNeighbours> surface;  ///< Context::surface
    SymbolModel<2> state[kKinds];                                  ///< Context::like
  };

  template <class Visit>
  void each_brick(const Visit& visit) const {
    for (int32_t z = 0; z < int32_t(grid_.bricks[2]); ++z)
      for (int32_t y = 0; y < int32_t(grid_.bricks[1]); ++y)
        for (int32_t x = 0; x < int32_t(grid_.bricks[0]); ++x) visit(Coordinates{x, y, z});
  }

  bool code_bricks(const kernels::PlanesField* truth) {
    uint32_t mixed = 0;
    size_t brick = 0;
    each_brick([&](const Coordinates& at) {
      const uint32_t wanted =
          truth ? std::min<uint32_t>(truth->brick_table[brick++], KnownVoxels::kMixed) : 0;
      const uint32_t kind = code_kind(at, wanted);
      known_.entry(at) = uint16_t(kind < KnownVoxels::kMixed ? kind : kind + mixed++);
    });
    return mixed == grid_.mixed_bricks;
  }

  uint32_t code_kind(const Coordinates& brick, uint32_t truth) {
    const auto [x, y, z] = brick;
    return models_->kind[known_.kind({x - 1, y, z})][known_.kind({x, y - 1, z})][known_.kind({x, y, z - 1})]
        .code(coder_, truth);
  }

  /// Codes the voxels of a mixed brick. `truth` is null when decoding.
  bool code_voxels(const Coordinates& brick, const kernels::BrickStates* truth,
                   kernels::BrickStates& states) {
    for (uint32_t bit = 0; bit < 64; ++bit) {
      const Coordinates voxel{4 * brick[0] + int32_t(bit & 3), 4 * brick[1] + int32_t(bit >> 2 & 3),
                              4 * brick[2] + int32_t(bit >> 4)};
      if (!known_.within_grid(voxel)) continue;
      const uint32_t state = code_state(voxel, truth ? uint32_t(kernels::state_in(*truth, bit)) : 0);
      if (state == KnownVoxels::kNone) return false;
      const uint64_t mask = uint64_t{1} << bit;
      if (state == KnownVoxels::kSurface || state == kernels::kBrickUnknown) states.surface |= mask;
      if (state == kernels::kBrickInside || state == kernels::kBrickUnknown) states.aux |= mask;
    }
    return true;
  }

  /// kNone if the file has a state that does not exist.
  uint32_t code_state(const Coordinates& voxel, uint32_t truth) {
    const KnownVoxels::Context context = known_.context(voxel);
    if (coder_.bit(models_->surface[context.surface], truth == KnownVoxels::kSurface))
      return KnownVoxels::kSurface;
    // Touching voxels without surface usually belong to one region.
    const uint32_t state = models_->state[context.like].code(coder_, truth);
    return state < KnownVoxels::kSurface ? state : KnownVoxels::kNone;
  }

  Coder& coder_;
  const kernels::PlanesField& grid_;
  const OccupancyArrays<std::byte> to_;
  const KnownVoxels known_;
  const std::unique_ptr<Models> models_;
};

}  // namespace nif::format
