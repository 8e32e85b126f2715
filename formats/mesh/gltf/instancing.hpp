// EXT_mesh_gpu_instancing: a node that places its mesh many times, by accessors.
#pragma once

#include <vector>

#include "formats/mesh/gltf/accessor.hpp"
#include "formats/mesh/gltf/hierarchy.hpp"

namespace nif::mesh::detail {

/// Puts as many placements as its instances are in place of each that has the extension, each after the
/// transform of its node. Skinned meshes stay single, with a note: joints place them, not nodes. Throws
/// malformed_mesh for accessors that are not as the extension says, too_large for more instances than
/// kMostGpuInstances in all.
void expand_instances(const Input& input, const GltfData& data, const tinygltf::Model& model,
                      std::vector<GltfPlacement>& placements, std::vector<Note>& notes);

/// Accessors without a buffer view, or with one that others share, cost a file next to nothing.
inline constexpr uint64_t kMostGpuInstances = uint64_t{1} << 22;

}  // namespace nif::mesh::detail
