// Everything that CGAL's mesh processing does for nifkit. Those parts of CGAL are under GPL-3.0-or-later, so
// whatever links this library is, as a whole; they lie in this folder alone. Built with NIF_WITH_CGAL=OFF,
// the library contains no CGAL, and each function below throws Error(usage), which says so.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <span>

#include "formats/mesh/clean.hpp"

namespace nif::cgal {

/// Was this library built with CGAL?
bool available();

/// Throws Error(usage) where CGAL is not there: "this build of nif lacks CGAL, which <what> needs ...".
void require(const char* what);

struct SelfIntersections {
  uint64_t pairs = 0;      ///< of triangles
  uint64_t triangles = 0;  ///< that are in some pair
};

/// Pairs of triangles that have a point in common other than the vertices and edges that they share: those
/// that pass through each other, touch, or overlap. A triangle and its opposite-facing twin are no pair.
/// Decided by exact predicates on the positions as they are. Runs on all threads; the result does not depend
/// on their number. Throws Error(interrupted) once `cancel` is set.
SelfIntersections find_self_intersections(const mesh::CleanMesh& mesh, const std::atomic<bool>& cancel);

}  // namespace nif::cgal
