// Isotropic remeshing with CGAL, for remesh_isotropic() of cgal.hpp. Relaxation is a separate call: within
// CGAL's remeshing, it would read beyond the end of a map at triangles that have lost their area.
#include <CGAL/Polygon_mesh_processing/detect_features.h>
#include <CGAL/Polygon_mesh_processing/remesh.h>
#include <CGAL/Polygon_mesh_processing/repair.h>
#include <CGAL/Polygon_mesh_processing/tangential_relaxation.h>

#include "mesh/cgal/cgal.hpp"
#include "mesh/cgal/surface.hpp"

namespace nif::cgal {

namespace processing = CGAL::Polygon_mesh_processing;

namespace {

using KeptMap = Surface::Property_map<Surface::Edge_index, bool>;

/// The edges that stay. If all triangles at a vertex have lost their area, CGAL's relaxation looks up the
/// edge of an invalid halfedge, and a plain map would read beyond its end.
struct KeptEdges {
  using key_type = Surface::Edge_index;
  using value_type = bool;
  using reference = bool;
  using category = boost::readable_property_map_tag;

  const Surface* surface;
  KeptMap kept;

  friend bool get(const KeptEdges& edges, Surface::Edge_index e) {
    const std::size_t count = edges.surface->num_edges() + edges.surface->number_of_removed_edges();
    return std::size_t(e.idx()) >= count || edges.kept[e];
  }
};

}  // namespace

mesh::Mesh remesh_isotropic(const mesh::Mesh& mesh, double edge, uint32_t iterations, double sharp) {
  Surface surface = to_surface(mesh);
  auto kept = surface.add_property_map<Surface::Edge_index, bool>("e:kept", false).first;
  if (sharp < 180) processing::detect_sharp_edges(surface, sharp, kept);
  for (const auto e : surface.edges())
    if (surface.is_border(e)) kept[e] = true;
  // Edges that stay must not be much longer than the others, or the remeshing never ends.
  std::vector<Surface::Edge_index> long_ones;
  for (const auto e : surface.edges())
    if (kept[e]) long_ones.push_back(e);
  processing::split_long_edges(long_ones, edge * 4 / 3, surface,
                               CGAL::parameters::edge_is_constrained_map(kept));
  // Relaxation is not left to isotropic_remeshing(), so that it gets a map that does not crash.
  for (uint32_t i = 0; i < iterations; ++i) {
    if (i > 0)
      processing::tangential_relaxation(
          surface.vertices(), surface,
          CGAL::parameters::number_of_iterations(1).edge_is_constrained_map(KeptEdges{&surface, kept}));
    processing::isotropic_remeshing(surface.faces(), edge, surface,
                                    CGAL::parameters::number_of_iterations(1)
                                        .number_of_relaxation_steps(0)
                                        .edge_is_constrained_map(kept)
                                        .protect_constraints(true));
    processing::remove_isolated_vertices(surface);
  }
  surface.collect_garbage();
  return to_mesh(surface, mesh.name);
}

}  // namespace nif::cgal
