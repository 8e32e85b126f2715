// A mesh that is computed on demand, so that a mesh larger than memory can be written.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "formats/mesh/mesh_scene.hpp"

namespace nif::mesh {

/// Any range of its vertices and triangles can be computed, in any order, from any thread; the same range is
/// always the same. Nothing here throws, except for lack of memory.
class MeshSource {
 public:
  virtual ~MeshSource() = default;

  virtual uint64_t vertex_count() const = 0;
  virtual uint64_t triangle_count() const = 0;

  /// Fills `out` with the vertices from `first` on; first + out.size() <= vertex_count().
  virtual void vertices(uint64_t first, std::span<Float3> out) const = 0;
  /// The same in double, if it is known more precisely than floats can represent.
  virtual void exact(uint64_t first, std::span<Double3> out) const {
    std::vector<Float3> rounded(out.size());
    vertices(first, rounded);
    std::ranges::transform(rounded, out.begin(), to_double);
  }
  /// Whether floats are too coarse for any vertex.
  virtual bool needs_doubles() const { return false; }
  /// Fills `out` with the triangles from `first` on; first + out.size() <= triangle_count(). Their indices
  /// are below vertex_count().
  virtual void triangles(uint64_t first, std::span<Triangle> out) const = 0;
};

}  // namespace nif::mesh
