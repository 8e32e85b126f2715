// Lays out the holes of triangles in device memory.
#pragma once

#include <vector>

#include "kernels/gpu/upload.hpp"
#include "kernels/reference/holes/holes_field.hpp"

namespace nif::kernels::gpu {

/// Adds the arrays of an object's holes and the maps that it uses, and points the field to their future addresses.
/// Objects of an asset share the tiles of a map.
inline void move_holes(HolesField& holes, Arena& arena) {
  std::vector<AlphaMap> maps(holes.maps, holes.maps + holes.map_count);
  std::vector<bool> used(maps.size());
  for (uint32_t i = 0; i < holes.patch_count; ++i) used[holes.patches[i].map] = true;
  for (size_t i = 0; i < maps.size(); ++i)
    if (used[i])
      arena.move(maps[i].tiles, size_t(alpha_tiles(maps[i].width, maps[i].height)));
    else
      maps[i] = {};
  holes.maps = arena.add_structures(maps.data(), maps.size());
  arena.move(holes.patches, holes.patch_count);
  arena.move(holes.numbers.words, size_t(source_words(holes.numbers.count, holes.numbers.bits)));
}

}  // namespace nif::kernels::gpu
