// Facts about a mesh: how many pieces it has, whether they are closed, how they face, and what is wrong.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "formats/mesh/scene.hpp"

namespace nif::inspect {

/// A set of triangles that are connected over edges. Equal positions are one vertex here.
struct Component {
  uint64_t triangles = 0;
  uint64_t boundary_edges = 0;      ///< with one triangle
  uint64_t non_manifold_edges = 0;  ///< with three or more
  uint64_t inconsistent_edges = 0;  ///< with two, which face opposite ways
  int64_t euler = 0;                ///< vertices - edges + triangles, where vertices of two fans count twice
  double area = 0;                  ///< in square units of the file
  /// Signed, in cubic units: positive where it faces outwards. It means something where the component is
  /// a solid().
  double volume = 0;

  bool closed() const { return boundary_edges == 0; }
  /// Closed, each edge with two triangles that face the same way.
  bool solid() const { return closed() && non_manifold_edges == 0 && inconsistent_edges == 0; }
  /// The number of handles of a solid.
  std::optional<uint64_t> genus() const {
    if (!solid()) return std::nullopt;
    return uint64_t(2 - euler) / 2;
  }
};

/// All that is counted of a mesh, or of several. Topology is that of the mesh with equal positions welded,
/// unless asked otherwise, and without degenerate and duplicate triangles, which are counted apart.
struct Inspection {
  uint64_t triangles = 0, vertices = 0;  ///< as in the file
  uint64_t distinct_vertices = 0;        ///< different positions that a triangle uses
  mesh::Float3 low{}, high{};            ///< bounds of these; zero where there are none
  uint64_t degenerate = 0;               ///< triangles without area, decided exactly
  uint64_t duplicate = 0;                ///< triangles that another one with the same corners already covers
  uint64_t opposite = 0;                 ///< likewise, but facing the other way
  uint64_t edges = 0, boundary_edges = 0, non_manifold_edges = 0, inconsistent_edges = 0;
  /// Vertices where several fans of triangles meet that share no edge, as at the tip of two cones.
  uint64_t non_manifold_vertices = 0;
  uint64_t boundary_loops = 0;  ///< the holes, if one counts the rim of an open surface as one
  uint64_t longest_loop = 0;    ///< edges of the longest of them
  double area = 0;
  double volume = 0;                  ///< signed, of the solids together
  std::vector<Component> components;  ///< in the order of their first triangles

  /// So many components, or all there are: most triangles first; of equal ones, that which comes first.
  std::vector<Component> largest(size_t count) const;
  uint64_t closed_components() const;
  uint64_t solids() const;
  uint64_t inward_solids() const;  ///< those of negative volume: inside out, or the walls of cavities

  /// Sums and extremes over both.
  Inspection& operator+=(const Inspection& other);
};

/// Looks at one mesh, whatever state it is in: it must only have passed the checks of mesh::read(). Takes
/// some 150 bytes of memory a triangle. Runs on all threads; the result does not depend on their number.
///
/// With `welded` off, vertices are those of the mesh, whether or not some are at the same place.
Inspection inspect(const mesh::Mesh& mesh, bool welded = true);

}  // namespace nif::inspect
