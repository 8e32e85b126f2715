// Reads one mesh of a glTF: its primitives as triangles, morphed, posed and coloured as requested.
#pragma once

#include <map>
#include <vector>

#include "formats/mesh/gltf/accessor.hpp"
#include "formats/mesh/gltf/alpha.hpp"
#include "formats/mesh/gltf/gltf_hierarchy.hpp"
#include "formats/mesh/gltf/json.hpp"
#include "formats/mesh/gltf/skin.hpp"
#include "formats/mesh/skin.hpp"

namespace tinygltf {
struct Mesh;
}

namespace nif::mesh::detail {

/// Totals over all meshes so far. Meshes may share data, so the file's size does not bound these.
struct ReadSoFar {
  uint64_t positions = 0;  ///< including meshes without triangles
  /// positions, counted for each morph target and each set of joints
  uint64_t moved = 0;
  uint64_t kept_moves = 0;                   ///< positions of morph targets that are kept
  std::map<size_t, uint64_t> see_through{};  ///< triangles by material, if that lets light through
  uint64_t empty_primitives = 0;
};

/// The sources of all meshes of a file.
struct GltfMeshSources {
  const Input& input;
  const GltfData& data;
  const GltfLook& look;
  const std::vector<GltfSurface>& surfaces;
  const GltfNaming& naming;
  GltfAlpha* alpha;  ///< null: everything is solid
};

/// How a mesh is to be read.
struct GltfVariant {
  const std::vector<double>& weights;  ///< of the morph targets; empty: the targets are ignored
  const GltfPose* pose;                ///< null: unchanged
  bool by_material;                    ///< GltfPlacement::by_material
  uint32_t skin = kNoSkin;             ///< kept, as ReadLimits::skins wants
  size_t joints = 0;                   ///< of that skin
};

/// Reads all primitives of a mesh of the file, or the chosen ones, as one mesh, which may have no triangles.
Mesh read_mesh(const GltfMeshSources& sources, const tinygltf::Mesh& mesh, size_t index,
               const GltfVariant& variant, ReadSoFar& so_far, std::vector<Note>& notes);

}  // namespace nif::mesh::detail
