// Makes files with one fault that only the reader's check of bricks can find: a surface voxel of a brick at
// the grid's end is outside the grid. All counts agree, all checksums are right. A fast kernel that met such
// a voxel would read its corners after the last brick.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "formats/nif/writer.hpp"
#include "tests/format/damaged.hpp"
#include "tests/support/random_asset.hpp"

namespace nif::test {

struct BeyondGrid {
  const char* encoding;
  RandomAssetOptions one_object;
};
/// Why the file is refused, behind its name.
inline constexpr const char* kBeyondGridSentence =
    "section PLAN, record 0: brick_states has a voxel beyond the grid";
inline const BeyondGrid kBeyondGrid[] = {{"segment", {.objects = 1, .instances = 1, .features = 2}},
                                         {"exact", {.objects = 0, .instances = 1, .exacts = 1}},
                                         {"proof", {.objects = 0, .instances = 1, .proofs = 1}}};

/// Moves one surface voxel of a brick, the last possible, outside the grid. Returns the number of the mixed
/// brick, or none if no brick allows it.
inline std::optional<size_t> move_beyond(format::PlanesData& grid) {
  const uint32_t across = format::bricks_for(grid.voxels[0]), down = format::bricks_for(grid.voxels[1]);
  for (size_t number = grid.brick_table.size(); number-- > 0;) {
    if (grid.brick_table[number] < kernels::kFirstMixedBrick) continue;
    const size_t mixed = grid.brick_table[number] - kernels::kFirstMixedBrick;
    kernels::BrickStates& states = grid.brick_states[mixed];
    const auto b = uint32_t(number);
    const uint32_t low[3] = {4 * (b % across), 4 * (b / across % down), 4 * (b / across / down)};
    uint64_t beyond = 0;
    for (uint32_t bit = 0; bit < 64; ++bit)
      if (low[0] + bit % 4 >= grid.voxels[0] || low[1] + bit / 4 % 4 >= grid.voxels[1] ||
          low[2] + bit / 16 >= grid.voxels[2])
        beyond |= uint64_t{1} << bit;
    const uint64_t surface = states.surface & ~states.aux;
    if (surface == 0 || beyond == 0) continue;
    states.surface ^=
        uint64_t{1} << (63 - std::countl_zero(surface)) | uint64_t{1} << (63 - std::countl_zero(beyond));
    return mixed;
  }
  return std::nullopt;
}

/// The asset that the fault is put into, and the file with it.
struct FileBeyondGrid {
  format::Asset asset;  ///< with the fault
  Bytes good, bad;
};
inline FileBeyondGrid file_beyond_grid(const BeyondGrid& kind) {
  for (uint64_t seed = 1;; ++seed) {
    FileBeyondGrid file{random_asset(seed, kind.one_object), {}, {}};
    file.good = file.bad = format::encode(file.asset);
    format::PlanesData& grid = *file.asset.objects[0].planes;
    const std::optional<size_t> brick = move_beyond(grid);
    if (!brick) continue;
    const uint64_t at = payload_at(file.bad, payload::kOccupancy, 0) + *brick * sizeof(kernels::BrickStates);
    store(file.bad, at, grid.brick_states[*brick]);
    fix_checksums(file.bad);
    return file;
  }
}

}  // namespace nif::test
