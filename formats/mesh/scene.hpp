// Triangle meshes and their instances, as every reader of formats/mesh fills them.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace nif::mesh {

using Float3 = std::array<float, 3>;
using Triangle = std::array<uint32_t, 3>;  ///< indices into Mesh::positions

/// Row-major 3x4 affine transform from object to world space: world = rows[.][0..2] * p + rows[.][3].
using Transform = std::array<float, 12>;
inline constexpr Transform kIdentity{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};

/// One object's triangles. Winding as in the file; positions are not welded.
struct Mesh {
  std::string name;  ///< UTF-8, from the file; the file's stem where it has none
  std::vector<Float3> positions;
  std::vector<Triangle> triangles;
};

/// One placement of a mesh. Transforms may scale non-uniformly and mirror.
struct Instance {
  std::string name;   ///< the node's name, else the mesh's
  uint32_t mesh = 0;  ///< index into Scene::meshes
  Transform transform = kIdentity;
};

/// A whole input file. Every mesh has at least one instance.
struct Scene {
  std::vector<Mesh> meshes;
  std::vector<Instance> instances;
  uint64_t source_hash = 0;           ///< XXH3-64 of the bytes of the file (decompressed) and of its buffers
  std::vector<std::string> warnings;  ///< one sentence each: what was skipped and why
};

}  // namespace nif::mesh
