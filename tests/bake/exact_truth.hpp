// The ground truth that Embree is compared with: CGAL's exact predicates.
#pragma once

#include <memory>
#include <span>

#include "formats/base/vector.hpp"
#include "formats/mesh/mesh_scene.hpp"
#include "kernels/reference/planes/grid_traversal.hpp"

namespace nif::test {

/// Decides whether segments meet a mesh with exact predicates, through CGAL's AABB tree. Slow to build and to
/// query.
class ExactTruth {
 public:
  ExactTruth(std::span<const mesh::Float3> positions, std::span<const mesh::Triangle> triangles);
  ~ExactTruth();

  /// An infinite segment is cut `reach` away from its origin, which should be beyond the mesh. The ends are
  /// rounded to double precision; the rest is exact.
  bool occluded(const kernels::Segment& segment, double reach) const;
  /// Distance of a point from the nearest triangle.
  double distance(const Double3& point) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// The ends of a segment, an infinite one cut `reach` away from its origin.
std::pair<Double3, Double3> ends_of(const kernels::Segment& segment, double reach);

}  // namespace nif::test
