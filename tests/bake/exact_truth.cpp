// Uses CGAL's AABB tree with exact predicates: the intersection test does not round. Only the ends of the
// segments are rounded.
#include "tests/bake/exact_truth.hpp"

#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>
#include <CGAL/AABB_triangle_primitive.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>

#include <algorithm>

namespace nif::test {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Triangles = std::vector<Kernel::Triangle_3>;
using Primitive = CGAL::AABB_triangle_primitive<Kernel, Triangles::const_iterator>;
using Tree = CGAL::AABB_tree<CGAL::AABB_traits<Kernel, Primitive>>;

Kernel::Point_3 point_of(const Double3& p) { return {p[0], p[1], p[2]}; }

}  // namespace

struct ExactTruth::Impl {
  Triangles triangles;
  Tree tree;
};

ExactTruth::ExactTruth(std::span<const mesh::Float3> positions, std::span<const mesh::Triangle> triangles)
    : impl_(std::make_unique<Impl>()) {
  for (const mesh::Triangle& t : triangles) {
    const auto corner = [&](int i) { return point_of(to_double(positions[t[i]])); };
    impl_->triangles.emplace_back(corner(0), corner(1), corner(2));
  }
  impl_->tree.rebuild(impl_->triangles.cbegin(), impl_->triangles.cend());
}

ExactTruth::~ExactTruth() = default;

std::pair<Double3, Double3> ends_of(const kernels::Segment& segment, double reach) {
  const Double3 origin{segment.origin[0], segment.origin[1], segment.origin[2]};
  const Double3 direction{segment.direction[0], segment.direction[1], segment.direction[2]};
  const double last = std::min(double(segment.tmax), reach / length(direction));
  return {origin + direction * double(segment.tmin), origin + direction * last};
}

bool ExactTruth::occluded(const kernels::Segment& segment, double reach) const {
  const auto [from, to] = ends_of(segment, reach);
  return impl_->tree.do_intersect(Kernel::Segment_3(point_of(from), point_of(to)));
}

double ExactTruth::distance(const Double3& point) const {
  return std::sqrt(CGAL::to_double(impl_->tree.squared_distance(point_of(point))));
}

}  // namespace nif::test
