// The size of voxels, as `nif mesh remesh` and `nif mesh voxelize` are told it.
#pragma once

#include <string>

#include "mesh/volume/volume.hpp"
#include "tools/mesh_work.hpp"

namespace nif::tools {

struct SamplingArguments {
  std::string voxel, thickness;
  uint32_t resolution = 128;
  bool allow_open = false;
};

/// --voxel, --resolution, --thickness and --allow-open.
void add_sampling_options(CLI::App& command, SamplingArguments& arguments);

/// For one mesh. Throws Error(usage) where a size makes no sense for it, or it is open and that is not
/// allowed; Error(too_large) where the work on it would not fit into memory.
volume::Sampling sampling_of(const SamplingArguments& arguments, const mesh::Mesh& mesh);

}  // namespace nif::tools
