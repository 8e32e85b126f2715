// Reads the base colours of a glTF: its materials and their pictures.
#pragma once

#include <vector>

#include "formats/mesh/gltf/accessor.hpp"
#include "formats/mesh/mesh_scene.hpp"

namespace nif::mesh::detail {

/// Gives a scene the materials of a file, and the pictures of those that are `used`: [materials]. Pictures
/// that cannot be read are left out with a warning, so that their materials only have a factor. Appends the
/// files of pictures to scene.files. The first of Scene::materials is white; material m of the file is at
/// with_picture(m), and without its picture at with_factor(m).
inline uint32_t with_picture(size_t material) { return uint32_t(1 + 2 * material); }
inline uint32_t with_factor(size_t material) { return uint32_t(2 + 2 * material); }
void add_materials(const Input& input, const GltfLook& look, const std::vector<bool>& used,
                   const GltfData& data, Scene& scene);

}  // namespace nif::mesh::detail
