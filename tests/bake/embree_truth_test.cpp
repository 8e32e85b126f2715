// Compares Embree's labels with CGAL's AABB tree, which decides with exact predicates. If the two differ, the
// ray must pass an edge, or end at the surface, within a millionth of the box's size.
#include <gtest/gtest.h>

#include <limits>

#include "bake/ground_truth/prepare.hpp"
#include "formats/base/vector.hpp"
#include "tests/bake/exact_truth.hpp"
#include "tests/support/test_shapes.hpp"

namespace nif::test {
namespace {

/// Distance between two segments given by their ends (Ericson 2005, 5.1.9).
double distance(const Double3& p1, const Double3& q1, const Double3& p2, const Double3& q2) {
  const Double3 d1 = q1 - p1, d2 = q2 - p2, r = p1 - p2;
  const double a = dot(d1, d1), e = dot(d2, d2), f = dot(d2, r), c = dot(d1, r), b = dot(d1, d2),
               denominator = a * e - b * b;
  double s = denominator > 0 ? std::clamp((b * f - c * e) / denominator, 0.0, 1.0) : 0.0;
  double t = e > 0 ? (b * s + f) / e : 0.0;
  if (t < 0) t = 0, s = a > 0 ? std::clamp(-c / a, 0.0, 1.0) : 0.0;
  if (t > 1) t = 1, s = a > 0 ? std::clamp((b - c) / a, 0.0, 1.0) : 0.0;
  return length(p1 + d1 * s - (p2 + d2 * t));
}

class EmbreeAgainstCgal : public testing::TestWithParam<int> {};

TEST_P(EmbreeAgainstCgal, DifferOnlyAtEdgesAndEnds) {
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
  const auto& positions = prepared.surface.positions;
  const auto& faces = prepared.surface.triangles;
  const ExactTruth exact(positions, faces);
  const bake::GroundTruth truth(prepared);

  const double size = prepared.box.longest_side(), close = 1e-6 * size;
  int differences = 0, occluded_count = 0;
  constexpr int kRays = 100'000;
  nif::Random random(3, 1, uint64_t(GetParam()));
  for (int i = 0; i < kRays; ++i) {
    std::optional<kernels::Segment> ray;
    if (random.below(3) == 0) {  // aimed at a vertex or the middle of an edge: the hard cases
      const mesh::Triangle& f = faces[random.below(uint32_t(faces.size()))];
      const Double3 p0 = to_double(positions[f[0]]), p1 = to_double(positions[f[1]]);
      const Double3 target = random.below(2) ? p0 : (p0 + p1) * 0.5, from = random.direction() * (2 * size);
      ray = kernels::Segment{
          {float(from[0]), float(from[1]), float(from[2])}, {}, 0, random.below(2) ? 1 : kInfinity};
      for (int a = 0; a < 3; ++a) ray->direction[a] = float(target[a] - double(ray->origin[a]));
    } else {
      auto set = static_cast<bake::RaySet>(random.below(4));
      if (set == bake::RaySet::inner_volume && !truth.source().has_volume) set = bake::RaySet::segments;
      ray = bake::draw_ray(truth.source(), set, random);
    }
    ASSERT_TRUE(ray);
    const bool expected = exact.occluded(*ray, 10 * size), found = truth.source().embree.occluded(*ray);
    occluded_count += expected;
    if (expected == found) continue;
    ++differences;
    const auto [first, last] = ends_of(*ray, 10 * size);
    double nearest = std::min(exact.distance(first), exact.distance(last));
    for (const mesh::Triangle& f : faces) {
      for (int e = 0; e < 3; ++e) {
        const Double3 a = to_double(positions[f[e]]), b = to_double(positions[f[(e + 1) % 3]]);
        nearest = std::min(nearest, distance(first, last, a, b));
      }
    }
    EXPECT_LE(nearest, close) << "ray " << i << ": CGAL says " << (expected ? "occluded" : "visible");
  }
  EXPECT_GT(occluded_count, kRays / 20);
  EXPECT_LT(occluded_count, kRays - kRays / 20);
  RecordProperty("differences", differences);
}

INSTANTIATE_TEST_SUITE_P(Shapes, EmbreeAgainstCgal, testing::Range(0, 4));

}  // namespace
}  // namespace nif::test
