// Where animations move nodes, and how they deform meshes, at a moment. Their JSON is read here, too.
#pragma once

#include <vector>

#include "formats/mesh/clip.hpp"
#include "formats/mesh/gltf/accessor.hpp"
#include "formats/mesh/mesh_scene.hpp"

namespace nif::mesh::detail {

/// The clips with their times. What cannot be read is left out, with a note.
std::vector<Clip> describe_clips(const Input& input, const GltfData& data, const std::vector<GltfClip>& clips,
                                 std::vector<Note>& notes);

/// Moves the nodes of the model, and sets their weights. Throws Error(usage) if there is no such clip, and
/// Error(malformed_mesh) if it cannot be read.
void pose_nodes(const Input& input, const GltfData& data, const std::vector<GltfClip>& clips,
                const Moment& moment, tinygltf::Model& model);

}  // namespace nif::mesh::detail
