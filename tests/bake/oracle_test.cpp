// Embree's labels against CGAL's AABB tree, which decides with exact predicates. Where the two differ, the
// ray must pass an edge, or end at the surface, within a millionth of the box's size.
#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>
#include <CGAL/AABB_triangle_primitive.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <gtest/gtest.h>

#include <limits>

#include "bake/prepare.hpp"
#include "tests/support/shapes.hpp"

namespace nif::test {
namespace {

using bake::Double3;
using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Triangles = std::vector<Kernel::Triangle_3>;
using Primitive = CGAL::AABB_triangle_primitive<Kernel, Triangles::const_iterator>;
using Tree = CGAL::AABB_tree<CGAL::AABB_traits<Kernel, Primitive>>;
constexpr float kInfinity = std::numeric_limits<float>::infinity();

Double3 to_double3(const Kernel::Point_3& p) { return {p.x(), p.y(), p.z()}; }

/// Distance between two segments given by their ends (Ericson 2005, 5.1.9).
double distance(const Double3& p1, const Double3& q1, const Double3& p2, const Double3& q2) {
  const Double3 d1 = q1 - p1, d2 = q2 - p2, r = p1 - p2;
  const double a = bake::dot(d1, d1), e = bake::dot(d2, d2), f = bake::dot(d2, r), c = bake::dot(d1, r),
               b = bake::dot(d1, d2), denominator = a * e - b * b;
  double s = denominator > 0 ? std::clamp((b * f - c * e) / denominator, 0.0, 1.0) : 0.0;
  double t = e > 0 ? (b * s + f) / e : 0.0;
  if (t < 0) t = 0, s = a > 0 ? std::clamp(-c / a, 0.0, 1.0) : 0.0;
  if (t > 1) t = 1, s = a > 0 ? std::clamp((b - c) / a, 0.0, 1.0) : 0.0;
  return bake::length(p1 + d1 * s - (p2 + d2 * t));
}

class OracleAgainstCgal : public testing::TestWithParam<int> {};

TEST_P(OracleAgainstCgal, DifferOnlyAtEdgesAndEnds) {
  mesh::Mesh mesh;
  switch (GetParam()) {
    case 0:
      mesh = icosphere(3);
      break;
    case 1:
      mesh = torus(24, 12);
      break;
    case 2:
      mesh = cube();
      break;
    case 3:
      mesh = nested_spheres(2);
      append(mesh, open_bowl(8, 16), 2);
      break;
  }
  const bake::Prepared prepared = bake::prepare(mesh);
  const auto& [positions, faces, slivers, report] = prepared.surface;
  Triangles triangles;
  for (const mesh::Triangle& f : faces) {
    const auto corner = [&](int i) {
      return Kernel::Point_3(positions[f[i]][0], positions[f[i]][1], positions[f[i]][2]);
    };
    triangles.emplace_back(corner(0), corner(1), corner(2));
  }
  const Tree tree(triangles.begin(), triangles.end());
  const bake::GroundTruth truth(prepared);

  const double size = prepared.box.longest_side(), close = 1e-6 * size;
  int differences = 0, occluded_count = 0;
  constexpr int kRays = 100'000;
  bake::Random random(3, 1, uint64_t(GetParam()));
  for (int i = 0; i < kRays; ++i) {
    std::optional<kernels::Segment> ray;
    if (random.below(3) == 0) {  // aimed at a vertex or an edge's middle, to make trouble
      const mesh::Triangle& f = faces[random.below(uint32_t(faces.size()))];
      const Double3 p0 = bake::to_double(positions[f[0]]), p1 = bake::to_double(positions[f[1]]);
      const Double3 target = random.below(2) ? p0 : (p0 + p1) * 0.5, from = random.direction() * (2 * size);
      ray = kernels::Segment{
          {float(from[0]), float(from[1]), float(from[2])}, {}, 0, random.below(2) ? 1 : kInfinity};
      for (int a = 0; a < 3; ++a) ray->direction[a] = float(target[a] - double(ray->origin[a]));
    } else {
      const auto set = static_cast<bake::RaySet>(random.below(4));
      ray = bake::draw_ray(truth.source(), set, random);
    }
    ASSERT_TRUE(ray);
    const Double3 origin{ray->origin[0], ray->origin[1], ray->origin[2]},
        direction{ray->direction[0], ray->direction[1], ray->direction[2]};
    const double end = std::min(double(ray->tmax), 10 * size / bake::length(direction));
    const Double3 last = origin + direction * end;
    const Kernel::Segment_3 exact(Kernel::Point_3(origin[0], origin[1], origin[2]),
                                  Kernel::Point_3(last[0], last[1], last[2]));
    const bool expected = tree.do_intersect(exact), found = truth.source().oracle.occluded(*ray);
    occluded_count += expected;
    if (expected == found) continue;
    ++differences;
    double nearest = kInfinity;
    for (const Kernel::Triangle_3& t : triangles) {
      for (int e = 0; e < 3; ++e) {
        nearest = std::min(
            nearest, distance(origin, last, to_double3(t.vertex(e)), to_double3(t.vertex((e + 1) % 3))));
      }
    }
    for (const Double3& point : {origin, last}) {
      const double off =
          std::sqrt(CGAL::to_double(tree.squared_distance(Kernel::Point_3(point[0], point[1], point[2]))));
      nearest = std::min(nearest, off);
    }
    EXPECT_LE(nearest, close) << "ray " << i << ": CGAL says " << (expected ? "occluded" : "visible");
  }
  EXPECT_GT(occluded_count, kRays / 20);
  EXPECT_LT(occluded_count, kRays - kRays / 20);
  RecordProperty("differences", differences);
}

INSTANTIATE_TEST_SUITE_P(Shapes, OracleAgainstCgal, testing::Range(0, 4));

}  // namespace
}  // namespace nif::test
