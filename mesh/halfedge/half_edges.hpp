// Converts triangle lists to OpenMesh's half-edge meshes and back. Internal to mesh/halfedge.
#pragma once

#include <OpenMesh/Core/Mesh/PolyMesh_ArrayKernelT.hh>
#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>

#include "formats/mesh/clean.hpp"

namespace nif::halfedge {

using TriMesh = OpenMesh::TriMesh_ArrayKernelT<>;
using PolyMesh = OpenMesh::PolyMesh_ArrayKernelT<>;

/// The triangles of a mesh that have an area, welded. A triangle that would make an edge or a vertex
/// non-manifold gets separate vertices there, so that the surface comes apart as little as possible.
template <class HalfEdges>
HalfEdges to_half_edges(const mesh::Mesh& mesh) {
  const mesh::CleanMesh clean = mesh::clean(mesh);
  omerr().disable();  // it prints a line for each triangle that it refuses
  HalfEdges out;
  out.reserve(clean.positions.size(), clean.triangles.size() * 3 / 2, clean.triangles.size());
  const auto add_vertex = [&](uint32_t v) {
    const mesh::Float3& p = clean.positions[v];
    return out.add_vertex({p[0], p[1], p[2]});
  };
  std::vector<OpenMesh::VertexHandle> vertices;
  vertices.reserve(clean.positions.size());
  for (uint32_t v = 0; v < clean.positions.size(); ++v) vertices.push_back(add_vertex(v));
  const auto add_face = [&](const mesh::Triangle& t) {
    std::array<OpenMesh::VertexHandle, 3> corners{vertices[t[0]], vertices[t[1]], vertices[t[2]]};
    if (!out.add_face(corners.data(), 3).is_valid()) {
      for (size_t i = 0; i < 3; ++i) corners[i] = add_vertex(t[i]);
      out.add_face(corners.data(), 3);
    }
  };
  for (const mesh::Triangle& t : clean.triangles) add_face(t);
  for (const mesh::Triangle& t : clean.slivers) add_face(t);
  return out;
}

/// Used vertices and faces in their order; faces with more corners become fans around the first one.
template <class HalfEdges>
mesh::Mesh to_mesh(const HalfEdges& from, const std::string& name) {
  mesh::Mesh out{name, {}, {}};
  constexpr uint32_t kNone = 0xffffffffu;
  std::vector<uint32_t> index(from.n_vertices(), kNone);
  for (const auto v : from.vertices()) {
    if (from.is_isolated(v)) continue;
    index[size_t(v.idx())] = uint32_t(out.positions.size());
    const auto& p = from.point(v);
    out.positions.push_back({p[0], p[1], p[2]});
  }
  out.triangles.reserve(from.n_faces());
  std::vector<uint32_t> corners;
  for (const auto f : from.faces()) {
    corners.clear();
    for (const auto v : from.fv_range(f)) corners.push_back(index[size_t(v.idx())]);
    for (size_t i = 2; i < corners.size(); ++i)
      out.triangles.push_back({corners[0], corners[i - 1], corners[i]});
  }
  return out;
}

}  // namespace nif::halfedge
