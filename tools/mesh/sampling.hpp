// Handles the options for voxel size that `nif mesh remesh`, `nif mesh voxelize` and `nif mesh convert`
// share.
#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "formats/mesh/mesh_scene.hpp"
#include "mesh/volume/volume.hpp"
#include "tools/common/options.hpp"

namespace nif::tools {

struct SamplingArguments {
  std::string voxel, thickness;
  uint32_t resolution = 128;
  bool allow_open = false;
};

/// Adds --voxel, --resolution, --thickness and --allow-open.
void add_sampling_options(Command command, SamplingArguments& arguments);

/// The sampling of one mesh. Throws Error(usage) if a size makes no sense for it, or if it is open and that
/// is not allowed; Error(too_large) if the work would not fit into memory.
volume::Sampling sampling_of(const SamplingArguments& arguments, const mesh::Mesh& mesh);

struct WrittenVolume {
  uint64_t bytes, voxels;        ///< of the file; number of active ones
  std::array<uint32_t, 3> size;  ///< of the box around the active voxels, in voxels
  double voxel;                  ///< side, in units of the mesh
};

/// Writes a scene that was read from `input` as .vdb: merges its objects, placed by their instances, into one
/// mesh, and makes a volume of it. While OpenVDB works, Ctrl-C ends the process at once. Throws as
/// sampling_of() and volume::make_vdb() do.
WrittenVolume write_volume(const mesh::Scene& scene, const std::string& input, const std::string& output,
                           const SamplingArguments& arguments, volume::Kind kind);

}  // namespace nif::tools
