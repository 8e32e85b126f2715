// Words of walks on their way to a GPU.
#pragma once

#include "kernels/gpu/upload.hpp"
#include "kernels/packed/walk_grid.hpp"

namespace nif::kernels::gpu {

inline void move_walk(const cpu::WalkGrid& grid, WalkWords& words, Arena& arena) {
  arena.move(words.bricks, grid.bricks.size());
  arena.move(words.voxels, grid.voxels.size());
  arena.move(words.parts, grid.parts.size());
}

}  // namespace nif::kernels::gpu
