// The base colours of a glTF: what its materials say of them, and their pictures.
#pragma once

#include <vector>

#include "formats/mesh/gltf/accessor.hpp"
#include "formats/mesh/scene.hpp"

namespace nif::mesh::detail {

/// Gives a scene the materials of a file, and the pictures of those that are `used`: [materials]. Pictures
/// that cannot be read are left out with a warning, so that their materials have a factor alone. Appends the
/// files of pictures to scene.files. Scene::materials begins with one that is white; material m of the file
/// is the one at with_picture(m), and without its picture the one at with_factor(m).
inline uint32_t with_picture(size_t material) { return uint32_t(1 + 2 * material); }
inline uint32_t with_factor(size_t material) { return uint32_t(2 + 2 * material); }
void add_materials(const Input& input, const GltfLook& look, const std::vector<bool>& used,
                   const GltfData& data, Scene& scene);

}  // namespace nif::mesh::detail
