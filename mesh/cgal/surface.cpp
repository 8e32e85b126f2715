// Copies vertices and faces in their order. If CGAL refuses a face, the mesh is not manifold: its repair has
// failed, which is an internal error.
#include "mesh/cgal/surface.hpp"

#include "formats/base/status.hpp"

namespace nif::cgal {

Surface to_surface(const mesh::Mesh& mesh) {
  Surface surface;
  surface.reserve(uint32_t(mesh.positions.size()), uint32_t(mesh.triangles.size() * 3 / 2),
                  uint32_t(mesh.triangles.size()));
  std::vector<Surface::Vertex_index> vertices;
  vertices.reserve(mesh.positions.size());
  for (const mesh::Float3& p : mesh.positions) vertices.push_back(surface.add_vertex({p[0], p[1], p[2]}));
  for (const mesh::Triangle& t : mesh.triangles)
    if (surface.add_face(vertices[t[0]], vertices[t[1]], vertices[t[2]]) == Surface::null_face())
      throw Error(Status::internal, "mesh '" + mesh.name + "' is still not manifold after its repair");
  return surface;
}

mesh::Mesh to_mesh(const Surface& surface, const std::string& name) {
  mesh::Mesh mesh{name, {}, {}};
  std::vector<uint32_t> index(surface.num_vertices() + surface.number_of_removed_vertices());
  for (const auto v : surface.vertices()) {
    if (surface.is_isolated(v)) continue;
    index[v] = uint32_t(mesh.positions.size());
    const Kernel::Point_3& p = surface.point(v);
    mesh.positions.push_back({float(p.x()), float(p.y()), float(p.z())});
  }
  mesh.triangles.reserve(surface.num_faces());
  for (const auto f : surface.faces()) {
    mesh::Triangle triangle;
    size_t corner = 0;
    for (const auto v : surface.vertices_around_face(surface.halfedge(f))) triangle[corner++] = index[v];
    mesh.triangles.push_back(triangle);
  }
  return mesh;
}

}  // namespace nif::cgal
