#include <CGAL/Polygon_mesh_processing/detect_features.h>
#include <CGAL/Polygon_mesh_processing/remesh.h>

#include "mesh/cgal/cgal.hpp"
#include "mesh/cgal/surface.hpp"

namespace nif::cgal {

namespace processing = CGAL::Polygon_mesh_processing;

mesh::Mesh remesh_isotropic(const mesh::Mesh& mesh, double edge, uint32_t iterations, double sharp) {
  Surface surface = to_surface(mesh);
  auto kept = surface.add_property_map<Surface::Edge_index, bool>("e:kept", false).first;
  if (sharp < 180) processing::detect_sharp_edges(surface, sharp, kept);
  for (const auto e : surface.edges())
    if (surface.is_border(e)) kept[e] = true;
  // Edges that stay must not be much longer than the others, or the remeshing does not come to an end.
  std::vector<Surface::Edge_index> long_ones;
  for (const auto e : surface.edges())
    if (kept[e]) long_ones.push_back(e);
  processing::split_long_edges(long_ones, edge * 4 / 3, surface,
                               CGAL::parameters::edge_is_constrained_map(kept));
  processing::isotropic_remeshing(surface.faces(), edge, surface,
                                  CGAL::parameters::number_of_iterations(iterations)
                                      .edge_is_constrained_map(kept)
                                      .protect_constraints(true));
  surface.collect_garbage();
  return to_mesh(surface, mesh.name);
}

}  // namespace nif::cgal
