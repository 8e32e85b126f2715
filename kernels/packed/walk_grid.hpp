// The occupancy and the cells of a field as kernels that leap read them (kernels/packed/walk_words.hpp),
// built when an asset is loaded.
#pragma once

#include <cstdint>
#include <memory_resource>
#include <vector>

#include "kernels/packed/walk_words.hpp"
#include "kernels/reference/proof/field.hpp"

namespace nif::kernels::cpu {

struct WalkGrid {
  WalkGrid(const ProofField& field, std::pmr::memory_resource* memory);

  std::pmr::vector<uint32_t> voxels;  ///< [z][y][x]: at most 2^24, so that floats number them exactly
  std::pmr::vector<uint32_t> parts;

  WalkWords view() const { return {voxels.data(), parts.data()}; }
  size_t resident_bytes() const {
    return voxels.capacity() * sizeof(voxels[0]) + parts.capacity() * sizeof(parts[0]);
  }
};

}  // namespace nif::kernels::cpu
