// decimate_fast() of decimate.hpp, with meshoptimizer: for meshes that would take OpenMesh too long.
// meshoptimizer's error is relative to the size of the mesh, so ours is scaled.
#include <meshoptimizer.h>

#include <algorithm>
#include <cfloat>

#include "formats/mesh/clean.hpp"
#include "mesh/halfedge/decimate.hpp"

namespace nif::halfedge {

mesh::Mesh decimate_fast(const mesh::Mesh& mesh, const DecimateOptions& options) {
  mesh::CleanMesh clean = mesh::clean(mesh);
  clean.triangles.insert(clean.triangles.end(), clean.slivers.begin(), clean.slivers.end());
  const float* positions = clean.positions[0].data();
  const float scale = meshopt_simplifyScale(positions, clean.positions.size(), sizeof(mesh::Float3));
  const float error = options.max_error && scale > 0 ? float(*options.max_error) / scale : FLT_MAX;
  mesh::Mesh out{mesh.name, {}, std::vector<mesh::Triangle>(clean.triangles.size())};
  const size_t indices =
      meshopt_simplify(out.triangles[0].data(), clean.triangles[0].data(), clean.triangles.size() * 3,
                       positions, clean.positions.size(), sizeof(mesh::Float3), size_t(options.triangles) * 3,
                       error, options.move_boundary ? 0 : meshopt_SimplifyLockBorder, nullptr);
  out.triangles.resize(indices / 3);
  // Used vertices, in their order.
  std::vector<uint32_t> index(clean.positions.size());
  for (const mesh::Triangle& t : out.triangles)
    for (const uint32_t v : t) index[v] = 1;
  for (uint32_t v = 0; v < index.size(); ++v) {
    if (index[v] == 0) continue;
    index[v] = uint32_t(out.positions.size());
    out.positions.push_back(clean.positions[v]);
  }
  for (mesh::Triangle& t : out.triangles)
    for (uint32_t& v : t) v = index[v];
  return out;
}

}  // namespace nif::halfedge
