// Finds which parts of a surface are closed, so that they have an inside.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "formats/mesh/clean.hpp"

namespace nif::bake {

/// The closed components of a welded surface. A component is a set of triangles connected over edges. It is
/// closed if every edge is passed equally often in both directions (a closed, consistently oriented surface,
/// possibly touching or crossing itself), if necessary after turning triangles that face another way than
/// their neighbours; and none of its triangles has holes. Such a component gives every point off it an integer
/// winding number, and a path between points with different winding numbers must cross it.
struct ClosedComponents {
  /// Only of closed components, without slivers, component by component: twice the index among the surface's
  /// triangles, plus 1 if the triangle is to be turned.
  std::vector<uint32_t> members;
  std::vector<uint32_t> first;  ///< [components + 1]: where each component starts among the members
  uint32_t open_components = 0;
  uint64_t turned = 0;  ///< triangles, including slivers, turned to close a component

  size_t count() const { return first.size() - 1; }
  /// The member as a triangle of the surface that this was found in.
  mesh::Triangle triangle(const mesh::CleanMesh& surface, size_t member) const {
    mesh::Triangle t = surface.triangles[members[member] / 2];
    if (members[member] % 2) std::swap(t[1], t[2]);
    return t;
  }
};

/// `surface` must have fewer than 2^31 triangles, which the limits of mesh::read() guarantee.
ClosedComponents find_closed_components(const mesh::CleanMesh& surface);

}  // namespace nif::bake
