#include <CGAL/Polygon_mesh_processing/border.h>
#include <CGAL/Polygon_mesh_processing/orient_polygon_soup.h>
#include <CGAL/Polygon_mesh_processing/stitch_borders.h>
#include <CGAL/Polygon_mesh_processing/triangulate_hole.h>

#include <algorithm>
#include <numeric>
#include <set>
#include <vector>

#include "formats/base/disjoint_sets.hpp"
#include "formats/mesh/sides.hpp"
#include "mesh/cgal/cgal.hpp"
#include "mesh/cgal/surface.hpp"

namespace nif::cgal {
namespace {

namespace processing = CGAL::Polygon_mesh_processing;

void stop_if(const std::atomic<bool>& cancel) {
  if (cancel) throw Error(Status::interrupted, "the repair was cancelled");
}

/// Told what the orientation does. `origin` gives the vertex of the welded mesh that a vertex is a copy of.
struct Witness : processing::Default_orientation_visitor {
  Witness(std::vector<bool>* turned_triangles, std::vector<uint32_t>* origins)
      : turned(turned_triangles), origin(origins) {}
  void polygon_orientation_reversed(std::size_t triangle) { (*turned)[triangle] = !(*turned)[triangle]; }
  void duplicated_vertex(std::size_t from, std::size_t copy) {
    if (origin->size() <= copy) origin->resize(copy + 1);
    (*origin)[copy] = (*origin)[from];
  }

  std::vector<bool>* turned;
  std::vector<uint32_t>* origin;
};

/// CGAL turns all triangles of a piece to face as some first one: where most had to be turned, it was that
/// one that faced the wrong way.
void follow_the_majority(mesh::Mesh& mesh, std::vector<bool>& turned) {
  const std::vector<mesh::Side> sides = mesh::sorted_sides(mesh.triangles);
  DisjointSets pieces(mesh.triangles.size());
  for (size_t i = 1; i < sides.size(); ++i)
    if (sides[i].edge == sides[i - 1].edge) pieces.unite(sides[i].triangle, sides[i - 1].triangle);
  std::vector<int64_t> balance(mesh.triangles.size());
  for (uint32_t t = 0; t < mesh.triangles.size(); ++t) balance[pieces.find(t)] += turned[t] ? 1 : -1;
  for (uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    if (balance[pieces.find(t)] <= 0) continue;
    std::swap(mesh.triangles[t][1], mesh.triangles[t][2]);
    turned[t] = !turned[t];
  }
}

/// Turns triangles to face as their neighbours, and takes edges and vertices apart where that cannot be.
/// Returns the origin of each vertex.
std::vector<uint32_t> orient(mesh::Mesh& mesh, Mending& done) {
  std::vector<uint32_t> origin(mesh.positions.size());
  std::iota(origin.begin(), origin.end(), 0u);
  std::vector<Kernel::Point_3> points;
  points.reserve(mesh.positions.size());
  for (const mesh::Float3& p : mesh.positions) points.emplace_back(p[0], p[1], p[2]);
  std::vector<std::vector<std::size_t>> soup;
  soup.reserve(mesh.triangles.size());
  for (const mesh::Triangle& t : mesh.triangles) soup.push_back({t[0], t[1], t[2]});
  std::vector<bool> turned(mesh.triangles.size());
  processing::orient_polygon_soup(points, soup, CGAL::parameters::visitor(Witness(&turned, &origin)));
  done.split_vertices = points.size() - mesh.positions.size();
  mesh.positions.clear();
  for (const Kernel::Point_3& p : points)
    mesh.positions.push_back({float(p.x()), float(p.y()), float(p.z())});
  for (std::size_t t = 0; t < soup.size(); ++t)
    mesh.triangles[t] = {uint32_t(soup[t][0]), uint32_t(soup[t][1]), uint32_t(soup[t][2])};
  follow_the_majority(mesh, turned);
  done.turned = uint64_t(std::count(turned.begin(), turned.end(), true));
  return origin;
}

/// Edges of a boundary loop; any larger number where they are more than `at_most`.
uint64_t length_of(const Surface& surface, Surface::Halfedge_index loop, uint64_t at_most) {
  uint64_t edges = 0;
  auto at = loop;
  do {
    at = surface.next(at);
    ++edges;
  } while (at != loop && edges <= at_most);
  return edges;
}

/// The edges of a mesh that have one triangle, as pairs of vertices, sorted.
std::vector<uint64_t> boundary_of(const mesh::Mesh& mesh) {
  const std::vector<mesh::Side> sides = mesh::sorted_sides(mesh.triangles);
  std::vector<uint64_t> edges;
  for (size_t begin = 0, end; begin < sides.size(); begin = end) {
    end = mesh::end_of_edge(sides, begin);
    if (end - begin == 1) edges.push_back(sides[begin].edge);
  }
  return edges;
}

class HoleFiller {
 public:
  /// `boundary` is that of the mesh before it was taken apart, `origin` what became of its vertices.
  HoleFiller(Surface& surface, const std::vector<uint64_t>& boundary, const std::vector<uint32_t>& origin)
      : surface_(surface), boundary_(boundary), origin_(origin) {}

  void fill(uint64_t most_edges, Mending& done, const std::atomic<bool>& cancel) {
    std::vector<Surface::Halfedge_index> loops;
    processing::extract_boundary_cycles(surface_, std::back_inserter(loops));
    for (const Surface::Halfedge_index loop : loops) {
      stop_if(cancel);
      const uint64_t edges = length_of(surface_, loop, most_edges);
      if (edges > most_edges || !is_hole(loop) || is_sheet(loop, edges)) continue;
      std::vector<Surface::Face_index> faces;
      processing::triangulate_hole(surface_, loop, std::back_inserter(faces));
      faces.empty() ? ++done.unfilled_holes : ++done.filled_holes;
      done.fill_triangles += faces.size();
    }
  }

 private:
  /// Not a cut that was made to take the surface apart: there it is closed already.
  bool is_hole(Surface::Halfedge_index loop) const {
    for (const auto h : surface_.halfedges_around_face(loop)) {
      const uint32_t a = origin_[surface_.source(h)], b = origin_[surface_.target(h)];
      const uint64_t edge = uint64_t{std::min(a, b)} << 32 | std::max(a, b);
      if (!std::binary_search(boundary_.begin(), boundary_.end(), edge)) return false;
    }
    return true;
  }

  /// Does the loop run around a piece of surface without a vertex within, which would be covered twice?
  bool is_sheet(Surface::Halfedge_index loop, uint64_t edges) const {
    std::vector<Surface::Face_index> found{surface_.face(surface_.opposite(loop))};
    std::set<Surface::Face_index> known(found.begin(), found.end());
    for (size_t i = 0; i < found.size(); ++i) {
      if (found.size() + 2 > edges) return false;
      for (const auto face : surface_.faces_around_face(surface_.halfedge(found[i])))
        if (face != Surface::null_face() && known.insert(face).second) found.push_back(face);
    }
    return found.size() + 2 <= edges;
  }

  Surface& surface_;
  const std::vector<uint64_t>& boundary_;
  const std::vector<uint32_t>& origin_;
};

}  // namespace

Mending mend(mesh::Mesh& mesh, uint64_t hole_edges, const std::atomic<bool>& cancel) {
  Mending done;
  const std::vector<uint64_t> boundary = hole_edges > 0 ? boundary_of(mesh) : std::vector<uint64_t>();
  const std::vector<uint32_t> origin = orient(mesh, done);
  stop_if(cancel);
  Surface surface = to_surface(mesh);
  done.stitched_edges = processing::stitch_borders(surface);
  stop_if(cancel);
  if (hole_edges > 0) HoleFiller(surface, boundary, origin).fill(hole_edges, done, cancel);
  surface.collect_garbage();
  mesh = to_mesh(surface, mesh.name);
  return done;
}

}  // namespace nif::cgal
