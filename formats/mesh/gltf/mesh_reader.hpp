// One mesh of a glTF: its primitives as triangles, morphed, posed and coloured as it is asked for.
#pragma once

#include <map>
#include <vector>

#include "formats/mesh/gltf/accessor.hpp"
#include "formats/mesh/gltf/hierarchy.hpp"
#include "formats/mesh/gltf/json.hpp"
#include "formats/mesh/gltf/skin.hpp"

namespace tinygltf {
struct Mesh;
}

namespace nif::mesh::detail {

/// What has been read for all meshes so far. They may share their data, so that the file's size bounds
/// nothing.
struct ReadSoFar {
  uint64_t positions = 0;                    ///< also of meshes without triangles
  uint64_t moved = 0;                        ///< positions, by each morph target and each set of joints
  std::map<size_t, uint64_t> see_through{};  ///< triangles by their material, where it lets light through
  uint64_t empty_primitives = 0;
};

/// What all meshes of a file are read from.
struct GltfMeshSources {
  const Input& input;
  const GltfData& data;
  const GltfLook& look;
  const std::vector<GltfSurface>& surfaces;
  const GltfNaming& naming;
};

/// How a mesh is wanted.
struct GltfVariant {
  const std::vector<double>& weights;  ///< of the morph targets; none: the targets are left alone
  const GltfPose* pose;                ///< null: as it is
  bool by_material;                    ///< GltfPlacement::by_material
};

/// All primitives of a mesh of the file, or those that are chosen, as one mesh, which may have no triangles.
Mesh read_mesh(const GltfMeshSources& sources, const tinygltf::Mesh& mesh, size_t index,
               const GltfVariant& variant, ReadSoFar& so_far, std::vector<Note>& notes);

}  // namespace nif::mesh::detail
