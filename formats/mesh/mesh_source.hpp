// A mesh that is computed on demand, so that a mesh larger than memory can be written.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "formats/mesh/scene.hpp"

namespace nif::mesh {

/// Any stretch of its vertices and triangles can be had, in any order, from any thread; the same stretch is
/// the same each time. Nothing here throws but for want of memory.
class MeshSource {
 public:
  virtual ~MeshSource() = default;

  virtual uint64_t vertex_count() const = 0;
  virtual uint64_t triangle_count() const = 0;

  /// Fills `out` with the vertices from `first` on; first + out.size() <= vertex_count().
  virtual void vertices(uint64_t first, std::span<Float3> out) const = 0;
  /// The same in double, where it is known better than floats can say.
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
