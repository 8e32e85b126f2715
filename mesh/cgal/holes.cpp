// Fills holes with CGAL. The rim of a sheet does not count as a hole.
#include <CGAL/Polygon_mesh_processing/border.h>
#include <CGAL/Polygon_mesh_processing/triangulate_hole.h>

#include <set>
#include <vector>

#include "mesh/cgal/cgal.hpp"
#include "mesh/cgal/surface.hpp"

namespace nif::cgal {
namespace {

namespace processing = CGAL::Polygon_mesh_processing;

/// Edges of a boundary loop; some larger number if there are more than `at_most`.
uint64_t length_of(const Surface& surface, Surface::Halfedge_index loop, uint64_t at_most) {
  uint64_t edges = 0;
  auto at = loop;
  do {
    at = surface.next(at);
    ++edges;
  } while (at != loop && edges <= at_most);
  return edges;
}

class HoleFiller {
 public:
  HoleFiller(Surface& surface, const IsRim& is_rim) : surface_(surface), is_rim_(is_rim) {}

  Holes fill(uint64_t most_edges, const std::atomic<bool>& cancel) {
    Holes done;
    std::vector<Surface::Halfedge_index> loops;
    processing::extract_boundary_cycles(surface_, std::back_inserter(loops));
    for (const Surface::Halfedge_index loop : loops) {
      if (cancel) throw Error(Status::interrupted, "the repair was cancelled");
      const uint64_t edges = length_of(surface_, loop, most_edges);
      if (edges > most_edges || !is_hole(loop) || is_sheet(loop, edges)) continue;
      std::vector<Surface::Face_index> faces;
      processing::triangulate_hole(surface_, loop, std::back_inserter(faces));
      faces.empty() ? ++done.unfilled : ++done.filled;
      done.triangles += faces.size();
    }
    return done;
  }

 private:
  /// Whether the loop is not a cut that was made to take the surface apart: there the surface is already
  /// closed.
  bool is_hole(Surface::Halfedge_index loop) const {
    for (const auto h : surface_.halfedges_around_face(loop))
      if (!is_rim_(surface_.source(h), surface_.target(h))) return false;
    return true;
  }

  /// Whether the loop surrounds a piece of surface without an interior vertex, which filling would cover
  /// twice.
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
  const IsRim& is_rim_;
};

}  // namespace

Holes fill_holes(mesh::Mesh& mesh, uint64_t most_edges, const IsRim& is_rim,
                 const std::atomic<bool>& cancel) {
  Surface surface = to_surface(mesh);
  const Holes done = HoleFiller(surface, is_rim).fill(most_edges, cancel);
  if (done.filled == 0) return done;
  surface.collect_garbage();
  mesh = to_mesh(surface, mesh.name);
  return done;
}

}  // namespace nif::cgal
