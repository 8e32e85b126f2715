// The options for voxel size that `nif mesh remesh`, `nif mesh voxelize` and `nif mesh convert` share.
#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "formats/mesh/scene.hpp"
#include "mesh/volume/volume.hpp"
#include "tools/common/options.hpp"

namespace nif::tools {

struct SamplingArguments {
  std::string voxel, thickness;
  uint32_t resolution = 128;
  bool allow_open = false;
};

/// --voxel, --resolution, --thickness and --allow-open.
void add_sampling_options(Command command, SamplingArguments& arguments);

/// For one mesh. Throws Error(usage) where a size makes no sense for it, or it is open and that is not
/// allowed; Error(too_large) where the work on it would not fit into memory.
volume::Sampling sampling_of(const SamplingArguments& arguments, const mesh::Mesh& mesh);

struct WrittenVolume {
  uint64_t bytes, voxels;        ///< of the file; active ones
  std::array<uint32_t, 3> size;  ///< of the box around these, in voxels
  double voxel;                  ///< side, in units of the mesh
};

/// Writes a scene that was read from `input` as .vdb: its objects become one mesh, each where it stands, and
/// that a volume. While OpenVDB works, Ctrl-C ends the process at once. Throws as sampling_of() and
/// volume::make_vdb().
WrittenVolume write_volume(const mesh::Scene& scene, const std::string& input, const std::string& output,
                           const SamplingArguments& arguments, volume::Kind kind);

}  // namespace nif::tools
