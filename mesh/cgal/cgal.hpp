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

/// What mend() did, in the order it was done.
struct Mending {
  uint64_t turned = 0;  ///< triangles, to face as their neighbours do
  uint64_t split_vertices =
      0;  ///< copies made, so that each edge has two triangles at most and each vertex one fan
  uint64_t stitched_edges = 0;  ///< pairs of boundary edges at the same place that became one
  uint64_t filled_holes = 0;    ///< boundary loops that were closed
  uint64_t unfilled_holes = 0;  ///< that were small enough but could not be
  uint64_t fill_triangles = 0;  ///< made for that
};

/// Makes of a welded mesh without degenerate and duplicate triangles one whose edges have two triangles at
/// most, whose triangles face as their neighbours do as far as the surface allows it, and whose boundary
/// loops of at most `hole_edges` edges are filled (0: none is). Triangles keep their order; those of holes
/// follow. Throws Error(interrupted) once `cancel` is set.
Mending mend(mesh::Mesh& mesh, uint64_t hole_edges, const std::atomic<bool>& cancel);

/// Isotropic remeshing: triangles of about the edge length `edge`, in the units of the mesh, by splitting,
/// collapsing and flipping edges and smoothing, `iterations` times; what is a boundary stays where it is. The
/// mesh is as mend() leaves it. Sharp edges, at which triangles meet by more than `sharp` degrees, stay (180:
/// none does).
mesh::Mesh remesh_isotropic(const mesh::Mesh& mesh, double edge, uint32_t iterations, double sharp);

}  // namespace nif::cgal
