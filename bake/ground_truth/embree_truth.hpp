// Ground truth for visibility queries: Embree on the source mesh.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "bake/ground_truth/closure.hpp"
#include "bake/ground_truth/embree_scene.hpp"
#include "formats/base/vector.hpp"
#include "formats/mesh/mesh_scene.hpp"
#include "kernels/reference/ray.hpp"

namespace nif::bake {

using kernels::Segment;

/// Answers by Embree's robust traversal, one ray at a time. Any number of threads may query it. A very small
/// or very large mesh is scaled to size 1 by exact powers of two: Embree's products would underflow, and it
/// ends the process if coordinates are beyond 1.8e18. A ray with such coordinates meets nothing.
class EmbreeTruth {
 public:
  /// As the constructors of EmbreeScene.
  explicit EmbreeTruth(const EmbreeObject& object);
  EmbreeTruth(std::span<const EmbreeObject> objects, std::span<const Placed> instances);

  /// True if a triangle is met, and not in a hole, at tmin <= t <= tmax.
  bool occluded(const Segment& segment) const;

  /// True if the answer changes for a segment that is a millionth of the coordinates' size away: it passes so
  /// close to an edge, or ends so close to a triangle, that rounding decides.
  bool in_doubt(const Segment& segment) const;

  /// The segments that in_doubt() tests: moved to each of eight sides, then one that is shorter at both ends,
  /// which may have no points, and one that is longer.
  std::array<Segment, 10> beside(const Segment& segment) const;

  struct Hit {
    float t;
    uint32_t triangle;
    Double3 normal;         ///< geometric, by the triangle's winding; not normalised
    uint32_t instance = 0;  ///< in a scene of instances
  };
  std::optional<Hit> first_hit(const Segment& segment) const;

 private:
  EmbreeScene scene_;
  std::vector<mesh::Transform> normals_;  ///< [instance] takes normals to the world; empty: one mesh
  double reach_ = 0;                      ///< largest coordinate
  int exponent_ = 0;                      ///< Embree's coordinates are these times 2^exponent_
};

/// Tells points inside closed components from all others, by counting signed crossings along a ray.
class InsideTest {
 public:
  InsideTest(const mesh::CleanMesh& surface, const ClosedComponents& closed);
  /// For a scene of instances. `objects` consist only of their closed components and may be empty.
  InsideTest(std::span<const EmbreeObject> objects, std::span<const Placed> instances);
  /// True if some winding number along a fixed direction is not zero. A ray that grazes an edge may err,
  /// which changes a sampling density by less than can be measured; no proof relies on this.
  bool inside(const std::array<float, 3>& point) const;

 private:
  std::unique_ptr<EmbreeTruth> embree_;  // null if nothing is closed
};

}  // namespace nif::bake
