// Converts triangle lists to CGAL's half-edge mesh and back. Internal to mesh/cgal.
#pragma once

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Surface_mesh.h>

#include "formats/mesh/mesh_scene.hpp"

namespace nif::cgal {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Surface = CGAL::Surface_mesh<Kernel::Point_3>;

/// A half-edge mesh must be able to hold the mesh; repair::orient() ensures that. Throws Error(internal) if
/// it cannot.
Surface to_surface(const mesh::Mesh& mesh);

/// Faces and used vertices in their order; positions are rounded to floats.
mesh::Mesh to_mesh(const Surface& surface, const std::string& name);

}  // namespace nif::cgal
