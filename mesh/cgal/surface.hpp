// Converts triangle lists to CGAL's half-edge mesh and back. Internal to mesh/cgal.
#pragma once

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Surface_mesh.h>

#include "formats/mesh/scene.hpp"

namespace nif::cgal {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Surface = CGAL::Surface_mesh<Kernel::Point_3>;

/// The mesh must be one that a half-edge mesh can hold, as repair::orient() sees to. Throws Error(internal)
/// where it is not.
Surface to_surface(const mesh::Mesh& mesh);

/// Faces and used vertices in their order; positions rounded to floats.
mesh::Mesh to_mesh(const Surface& surface, const std::string& name);

}  // namespace nif::cgal
