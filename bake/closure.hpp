// Which parts of a surface are closed, so that they have an inside.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "formats/mesh/clean.hpp"

namespace nif::bake {

/// The closed components of a welded surface. A component is a set of triangles connected over edges; it is
/// closed where every edge is passed as often in one direction as in the other (a closed, consistently
/// oriented surface, possibly touching or crossing itself), if need be after triangles were turned that face
/// another way than their neighbours. Such a component gives every point off it an integer winding number,
/// and a path between points of different winding numbers must cross it.
struct ClosedComponents {
  std::vector<mesh::Triangle>
      triangles;                ///< of closed components only, without slivers, component by component
  std::vector<uint32_t> first;  ///< [components + 1]: where each component starts
  uint32_t open_components = 0;
  uint64_t turned = 0;  ///< triangles, slivers too, turned for a component to be closed

  size_t count() const { return first.size() - 1; }
};

ClosedComponents find_closed_components(const mesh::CleanMesh& surface);

}  // namespace nif::bake
