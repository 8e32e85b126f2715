// Wraps all of CGAL's mesh processing that nifkit uses. These parts of CGAL are under GPL-3.0-or-later, and
// so is every program that links this library, so they are confined to this folder. Built with
// NIF_WITH_CGAL=OFF, the library contains no CGAL, and each function below throws Error(usage), which says
// so.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <span>

#include "formats/mesh/clean.hpp"

namespace nif::cgal {

/// Whether this library was built with CGAL.
bool available();

/// Throws Error(usage) if CGAL is missing: "this build of nif lacks CGAL, which <what> needs ...".
void require(const char* what);

struct SelfIntersections {
  uint64_t pairs = 0;      ///< pairs of triangles
  uint64_t triangles = 0;  ///< triangles that are in at least one pair
};

/// Counts pairs of triangles that have a point in common besides the vertices and edges that they share: they
/// pass through each other, touch, or overlap. A triangle and its opposite-facing twin are not a pair.
/// Decided by exact predicates on the given positions. Runs on all threads; the result does not depend on
/// their number. The time is proportional to the number of pairs of triangles whose boxes overlap, which may
/// be quadratic in the number of triangles. Returns nullopt if there are more than `most_pairs`. Throws
/// Error(interrupted) once `cancel` is set.
std::optional<SelfIntersections> find_self_intersections(
    const mesh::CleanMesh& mesh, const std::atomic<bool>& cancel,
    uint64_t most_pairs = std::numeric_limits<uint64_t>::max());

struct Holes {
  uint64_t filled = 0;     ///< boundary loops that were closed
  uint64_t unfilled = 0;   ///< short enough, but could not be closed
  uint64_t triangles = 0;  ///< added to close them
};

/// Whether an edge, given by its vertices, belongs to a hole; otherwise it is a cut where the surface was
/// taken apart.
using IsRim = std::function<bool(uint32_t, uint32_t)>;

/// Fills boundary loops of at most `most_edges` edges that belong entirely to a hole. The rim of a sheet
/// without an interior vertex is not a hole. The mesh must be as repair::orient() leaves it. Triangles keep
/// their order; those that fill holes follow. Throws Error(interrupted) once `cancel` is set.
Holes fill_holes(mesh::Mesh& mesh, uint64_t most_edges, const IsRim& is_rim, const std::atomic<bool>& cancel);

/// Isotropic remeshing: makes triangles with edges of about the length `edge`, in units of the mesh, by
/// splitting, collapsing and flipping edges and smoothing, `iterations` times; boundaries stay in place. The
/// mesh must be as repair::orient() leaves it. Sharp edges, at which triangles meet by more than `sharp`
/// degrees, stay (180: none does).
mesh::Mesh remesh_isotropic(const mesh::Mesh& mesh, double edge, uint32_t iterations, double sharp);

}  // namespace nif::cgal
