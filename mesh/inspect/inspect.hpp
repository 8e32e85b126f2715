// Finds facts about a mesh: its components, whether they are closed, how they face, and what is wrong.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "formats/mesh/mesh_scene.hpp"

namespace nif::inspect {

/// A set of triangles connected by edges. Vertices with equal positions are one vertex here.
struct Component {
  uint64_t triangles = 0;
  uint64_t boundary_edges = 0;      ///< edges with one triangle
  uint64_t non_manifold_edges = 0;  ///< edges with three or more
  uint64_t inconsistent_edges = 0;  ///< edges with two triangles that face opposite ways
  int64_t euler = 0;                ///< vertices - edges + triangles, with vertices of two fans counted twice
  double area = 0;                  ///< in square units of the file
  /// Signed, in cubic units of the file: positive if it faces outwards. Only meaningful if the component is a
  /// solid().
  double volume = 0;

  bool closed() const { return boundary_edges == 0; }
  /// Closed, with two triangles at each edge that face the same way.
  bool solid() const { return closed() && non_manifold_edges == 0 && inconsistent_edges == 0; }
  /// The number of handles of a solid.
  std::optional<uint64_t> genus() const {
    if (!solid()) return std::nullopt;
    return uint64_t(2 - euler) / 2;
  }
};

/// All counts for a mesh, or for several. The topology is that of the mesh with equal positions welded,
/// unless requested otherwise, and without degenerate and duplicate triangles, which are counted separately.
struct Inspection {
  uint64_t triangles = 0, vertices = 0;  ///< as in the file
  uint64_t distinct_vertices = 0;        ///< distinct positions that triangles use
  mesh::Float3 low{}, high{};            ///< their bounds; zero if there are none
  uint64_t degenerate = 0;               ///< triangles without area, decided exactly
  uint64_t duplicate = 0;                ///< triangles that repeat another one, facing the same way
  uint64_t opposite = 0;                 ///< the same, but facing the other way
  uint64_t edges = 0, boundary_edges = 0, non_manifold_edges = 0, inconsistent_edges = 0;
  /// Vertices where fans of triangles meet that share no edge, like the tip of two cones.
  uint64_t non_manifold_vertices = 0;
  uint64_t boundary_loops = 0;  ///< holes, if the rim of an open surface counts as one
  uint64_t longest_loop = 0;    ///< number of edges of the longest
  double area = 0;
  double volume = 0;                  ///< signed, sum over the solids
  std::vector<Component> components;  ///< in the order of their first triangles

  /// The `count` largest components by triangles, or all if there are fewer; equal ones in their order.
  std::vector<Component> largest(size_t count) const;
  uint64_t closed_components() const;
  uint64_t solids() const;
  uint64_t inward_solids() const;  ///< solids of negative volume: inside out, or the walls of cavities

  /// Adds the counts and combines the extremes of both.
  Inspection& operator+=(const Inspection& other);
};

/// Inspects one mesh in any state; it must only have passed the checks of mesh::read(). Needs some 150 bytes
/// of memory per triangle. Runs on all threads; the result does not depend on their number.
///
/// Without `welded`, vertices are those of the mesh, even if some have the same position.
Inspection inspect(const mesh::Mesh& mesh, bool welded = true);

}  // namespace nif::inspect
