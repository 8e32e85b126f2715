// Reads all mesh files of a scene, and adds their lights and cameras.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "formats/mesh/alpha.hpp"
#include "formats/mesh/mesh_scene.hpp"
#include "tools/common/progress.hpp"
#include "tools/render/picture_scene.hpp"

namespace nif::render {

/// [object]; objects of the same file share its meshes.
using ObjectMeshes = std::vector<std::shared_ptr<const mesh::Scene>>;

/// Reads the meshes of a scene's objects; alpha of those that have an asset as it was baked, and of others as `alpha` says.
/// Adds to the scene the lights and cameras of files that are to
/// supply them, placed by the objects' transforms; intensities are unchanged. Camera names become unique and
/// usable as file names. Appends to `notes` a sentence for each thing that was left out of a file or could
/// not be used. Throws as mesh::read() does, and Error(malformed_scene) if there is no light or no camera in
/// the end.
ObjectMeshes read_meshes(SceneDescription& scene, const mesh::AlphaOptions& alpha,
                         std::vector<std::string>& notes, tools::Progress& progress);

}  // namespace nif::render
