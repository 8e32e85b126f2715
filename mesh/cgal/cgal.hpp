// Everything that nifkit uses of CGAL's mesh processing. These parts of CGAL are under GPL-3.0-or-later, and
// so is every program that links this library. They are only in this folder. Built with NIF_WITH_CGAL=OFF,
// the library contains no CGAL, and each function below throws Error(usage), which says so.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
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
/// on their number. Takes time for each pair of triangles whose boxes overlap, of which there may be as many
/// as the square of the triangles; nullopt where there are more than `most_pairs`. Throws Error(interrupted)
/// once `cancel` is set.
std::optional<SelfIntersections> find_self_intersections(
    const mesh::CleanMesh& mesh, const std::atomic<bool>& cancel,
    uint64_t most_pairs = std::numeric_limits<uint64_t>::max());

struct Holes {
  uint64_t filled = 0;     ///< boundary loops that were closed
  uint64_t unfilled = 0;   ///< that were short enough but could not be
  uint64_t triangles = 0;  ///< made for that
};

/// Whether an edge, by its vertices, is one of a hole; else it is a cut where the surface was taken apart.
using IsRim = std::function<bool(uint32_t, uint32_t)>;

/// Fills boundary loops of at most `most_edges` edges, all of a hole. The rim of a sheet without a vertex
/// within is none. The mesh is as repair::orient() leaves it. Triangles keep their order; those of holes
/// follow. Throws Error(interrupted) once `cancel` is set.
Holes fill_holes(mesh::Mesh& mesh, uint64_t most_edges, const IsRim& is_rim, const std::atomic<bool>& cancel);

/// Isotropic remeshing: triangles of about the edge length `edge`, in the units of the mesh, by splitting,
/// collapsing and flipping edges and smoothing, `iterations` times; what is a boundary stays where it is. The
/// mesh is as repair::orient() leaves it. Sharp edges, at which triangles meet by more than `sharp` degrees,
/// stay (180: none does).
mesh::Mesh remesh_isotropic(const mesh::Mesh& mesh, double edge, uint32_t iterations, double sharp);

}  // namespace nif::cgal
