#include "mesh/halfedge/subdivide.hpp"

// CatmullClarkT.hh uses what this one declares.
#include <OpenMesh/Core/Mesh/PolyMesh_ArrayKernelT.hh>
#include <OpenMesh/Tools/Subdivider/Uniform/CatmullClarkT.hh>
#include <OpenMesh/Tools/Subdivider/Uniform/LoopT.hh>
#include <OpenMesh/Tools/Subdivider/Uniform/Sqrt3T.hh>
#include <limits>

#include "mesh/halfedge/half_edges.hpp"

namespace nif::halfedge {
namespace {

template <class HalfEdges, class Subdivider>
mesh::Mesh run(const mesh::Mesh& mesh, uint32_t times) {
  HalfEdges half_edges = to_half_edges<HalfEdges>(mesh);
  Subdivider subdivider;
  if (!subdivider.attach(half_edges) || !subdivider(times))
    throw Error(Status::internal, "OpenMesh refuses to subdivide mesh '" + mesh.name + "'");
  subdivider.detach();
  return to_mesh(half_edges, mesh.name);
}

}  // namespace

uint64_t subdivided_triangles(Scheme scheme, uint64_t triangles, uint32_t times) {
  for (uint32_t i = 0; i < times; ++i) {
    // The first step of Catmull-Clark makes three quads of a triangle, which later ones cut in four.
    const uint64_t factor = scheme == Scheme::sqrt3 ? 3 : scheme == Scheme::catmull_clark && i == 0 ? 6 : 4;
    if (triangles > std::numeric_limits<uint64_t>::max() / factor)
      return std::numeric_limits<uint64_t>::max();
    triangles *= factor;
  }
  return triangles;
}

mesh::Mesh subdivide(const mesh::Mesh& mesh, Scheme scheme, uint32_t times) {
  namespace uniform = OpenMesh::Subdivider::Uniform;
  switch (scheme) {
    case Scheme::loop:
      return run<TriMesh, uniform::LoopT<TriMesh>>(mesh, times);
    case Scheme::catmull_clark:
      return run<PolyMesh, uniform::CatmullClarkT<PolyMesh>>(mesh, times);
    default:
      return run<TriMesh, uniform::Sqrt3T<TriMesh>>(mesh, times);
  }
}

}  // namespace nif::halfedge
