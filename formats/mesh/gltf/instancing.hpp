// EXT_mesh_gpu_instancing: a node places its mesh many times, with transforms from accessors.
#pragma once

#include <vector>

#include "formats/mesh/gltf/accessor.hpp"
#include "formats/mesh/gltf/gltf_hierarchy.hpp"

namespace nif::mesh::detail {

/// Replaces each placement with the extension by one for each of its instances, each applied after the
/// transform of its node. Skinned meshes stay single, with a note, because joints place them, not nodes.
/// Throws malformed_mesh for accessors that violate the extension, and too_large for more than
/// kMostGpuInstances instances in all.
void expand_instances(const Input& input, const GltfData& data, const tinygltf::Model& model,
                      std::vector<GltfPlacement>& placements, std::vector<Note>& notes);

/// A limit is needed because accessors without a buffer view, or with a shared one, take hardly any space in
/// a file.
inline constexpr uint64_t kMostGpuInstances = uint64_t{1} << 22;

}  // namespace nif::mesh::detail
