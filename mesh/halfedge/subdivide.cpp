// Loop and Catmull-Clark with OpenMesh. Its weight table for Loop is enlarged, because OpenMesh reads beyond
// it at valences of 50 and more. sqrt(3) is our own code, because OpenMesh's can abort the process.
#include "mesh/halfedge/subdivide.hpp"

// CatmullClarkT.hh uses declarations of this header.
#include <OpenMesh/Core/Mesh/PolyMesh_ArrayKernelT.hh>
#include <OpenMesh/Tools/Subdivider/Uniform/CatmullClarkT.hh>
#include <OpenMesh/Tools/Subdivider/Uniform/LoopT.hh>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "formats/base/vector.hpp"
#include "formats/mesh/sides.hpp"
#include "mesh/halfedge/half_edges.hpp"

namespace nif::halfedge {
namespace {

template <class HalfEdges, class Subdivider>
mesh::Mesh run(const mesh::Mesh& mesh, uint32_t times) {
  HalfEdges half_edges = to_half_edges<HalfEdges>(mesh);
  Subdivider subdivider;
  // OpenMesh's Loop takes weights from a table for valences below 50, without a check.
  if constexpr (requires { subdivider.init_weights(size_t{}); }) {
    size_t most = 6;  // valence of the vertices that it adds
    for (const auto v : half_edges.vertices()) most = std::max(most, size_t(half_edges.valence(v)));
    subdivider.init_weights(most + 1);
  }
  if (!subdivider.attach(half_edges) || !subdivider(times))
    throw Error(Status::internal, "OpenMesh cannot subdivide mesh '" + mesh.name + "'");
  subdivider.detach();
  return to_mesh(half_edges, mesh.name);
}

/// One step of sqrt(3) (Kobbelt 2000): adds a vertex in the centre of each triangle, and replaces each edge
/// by the one that joins the centres on its two sides. The boundary stays. The mesh must be manifold and
/// consistently oriented.
///
/// Our own code, because OpenMesh 9 flips edges one after the other, and aborts with an assertion if one of
/// them cannot be flipped yet, for example between two triangles that share more than an edge.
mesh::Mesh sqrt3_step(const mesh::Mesh& mesh) {
  const size_t vertices = mesh.positions.size();
  std::vector<Double3> sums(vertices);  // sums over neighbours
  std::vector<uint32_t> valences(vertices);
  std::vector<bool> boundary(vertices);
  mesh::Mesh out{mesh.name, {}, {}};
  out.triangles.reserve(mesh.triangles.size() * 3);
  const std::vector<mesh::Side> sides = mesh::sorted_sides(mesh.triangles);
  const auto middle_of = [&](const mesh::Side& side) { return uint32_t(vertices) + side.triangle; };
  for (size_t begin = 0, end; begin < sides.size(); begin = end) {
    end = mesh::end_of_edge(sides, begin);
    const mesh::Triangle& t = mesh.triangles[sides[begin].triangle];
    const uint32_t a = t[sides[begin].corner], b = t[(sides[begin].corner + 1u) % 3];
    sums[a] = sums[a] + to_double(mesh.positions[b]);
    sums[b] = sums[b] + to_double(mesh.positions[a]);
    ++valences[a], ++valences[b];
    const uint32_t here = middle_of(sides[begin]);
    if (end - begin == 2) {
      const uint32_t there = middle_of(sides[begin + 1]);
      out.triangles.push_back({a, there, here});
      out.triangles.push_back({b, here, there});
    } else {
      boundary[a] = boundary[b] = true;
      out.triangles.push_back({a, b, here});
    }
  }
  out.positions.reserve(vertices + mesh.triangles.size());
  for (size_t v = 0; v < vertices; ++v) {
    if (boundary[v] || valences[v] == 0) {
      out.positions.push_back(mesh.positions[v]);
      continue;
    }
    const double n = valences[v], weight = (4 - 2 * std::cos(2 * std::numbers::pi / n)) / 9;
    const Double3 p = to_double(mesh.positions[v]) * (1 - weight) + sums[v] * (weight / n);
    out.positions.push_back({float(p[0]), float(p[1]), float(p[2])});
  }
  for (const mesh::Triangle& t : mesh.triangles) {
    const Double3 p = (to_double(mesh.positions[t[0]]) + to_double(mesh.positions[t[1]]) +
                       to_double(mesh.positions[t[2]])) *
                      (1.0 / 3);
    out.positions.push_back({float(p[0]), float(p[1]), float(p[2])});
  }
  return out;
}

mesh::Mesh sqrt3(const mesh::Mesh& mesh, uint32_t times) {
  // Through half-edges, so that it is manifold.
  mesh::Mesh out = to_mesh(to_half_edges<TriMesh>(mesh), mesh.name);
  for (uint32_t i = 0; i < times; ++i) out = sqrt3_step(out);
  return out;
}

}  // namespace

uint64_t subdivided_triangles(Scheme scheme, uint64_t triangles, uint32_t times) {
  for (uint32_t i = 0; i < times; ++i) {
    // The first step of Catmull-Clark turns a triangle into three quads; later steps split each quad into
    // four.
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
      return sqrt3(mesh, times);
  }
}

}  // namespace nif::halfedge
