// Reads all mesh files of a scene, and adds their lights and cameras.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "formats/mesh/scene.hpp"
#include "tools/common/progress.hpp"
#include "tools/render/scene.hpp"

namespace nif::render {

/// [object]; objects of one file share what was read.
using ObjectMeshes = std::vector<std::shared_ptr<const mesh::Scene>>;

/// Reads the meshes of a scene's objects and adds to it the lights and cameras of those that are to bring
/// them, placed by the objects' transforms; intensities stay what they are. Names of cameras become unique
/// and usable as file names. Appends to `notes` a sentence for each thing that was left out of a file or
/// could not be used. Throws as mesh::read(), and Error(malformed_scene) where there is no light or no camera
/// then.
ObjectMeshes read_meshes(SceneDescription& scene, std::vector<std::string>& notes, tools::Progress& progress);

}  // namespace nif::render
