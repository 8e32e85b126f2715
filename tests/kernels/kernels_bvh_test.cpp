// Every way to traverse a `bvh` object gives the answer of a loop over its triangles.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>

#include "kernels/reference/kernel.hpp"
#include "kernels/reference/triangles/triangles_hit.hpp"
#include "tests/support/random_bvh.hpp"

namespace nif {
namespace {

using kernels::Answer;
using kernels::Segment;
constexpr float kInfinity = std::numeric_limits<float>::infinity();

/// Trees of all sizes, near the origin and far from it.
struct Trees {
  std::vector<format::TrianglesData> bvhs;
  Trees() {
    test::Random random(1);
    for (const uint32_t triangles : {1u, 4u, 5u, 33u, 300u, 2000u})
      for (const float size : {1.0f, 1e-12f, 1e12f})
        for (const float centre : {0.0f, 3.0f, 1000.0f})
          bvhs.push_back(test::random_bvh(random, triangles, centre * size, size));
  }
};

TEST(Bvh, IsALoopOverItsTriangles) {
  uint64_t occluded = 0, rays = 0;
  test::Random random(2);
  for (const format::TrianglesData& bvh : Trees().bvhs) {
    const kernels::TrianglesField field = format::field_of(bvh);
    const int count = bvh.triangles.size() > 1000 ? 3000 : 10'000;
    for (int i = 0; i < count; ++i) {
      const Segment segment = test::random_segment(random, field);
      const Answer expected = test::ask_each_triangle(field, segment), found = kernels::query(field, segment);
      ASSERT_EQ(found.visible, expected.visible) << bvh.triangles.size() << " triangles, ray " << i;
      ASSERT_EQ(found.certain, expected.certain);
      ASSERT_EQ(found.logit, expected.logit);
      ++rays;
      occluded += !found.visible;
    }
  }
  EXPECT_GT(occluded, rays / 4);
  EXPECT_LT(occluded, rays - rays / 20);
}

/// A ray in the plane of a triangle, on a lattice where all numbers are exact. Rounding may decide hit or
/// miss, but a hit must lie within the triangle.
TEST(Triangles, SeenEdgeOnAreMetWhereTheyAre) {
  test::Random random(4);
  const auto integer = [&](int low, int high) { return low + int(random.below(uint32_t(high - low + 1))); };
  uint64_t met = 0, beside = 0;
  for (int i = 0; i < 2'000'000; ++i) {
    float corners[3][3];
    for (float(&corner)[3] : corners)
      for (float& x : corner) x = float(integer(-100, 100));
    // At t, the ray has the weights (k + 64 a (t - 2)) / 64 and (l + 64 b (t - 2)) / 64 of corners 1 and 2.
    const int a = integer(-9, 9), b = integer(-9, 9), k = integer(-64, 128), l = integer(-64, 128);
    Segment segment{{}, {}, -100, 100};
    for (int axis = 0; axis < 3; ++axis) {
      const float first = corners[1][axis] - corners[0][axis], second = corners[2][axis] - corners[0][axis];
      segment.direction[axis] = float(a) * first + float(b) * second;
      segment.origin[axis] =
          corners[0][axis] + (float(k) * first + float(l) * second) / 64 - 2 * segment.direction[axis];
    }
    if (segment.direction[0] == 0 && segment.direction[1] == 0 && segment.direction[2] == 0) continue;
    double low = -1000, high = 1000;
    const auto cut = [&](double weight, double slope) {  // to where the weight is not negative
      if (slope > 0)
        low = std::max(low, 2 - weight / slope);
      else if (slope < 0)
        high = std::min(high, 2 - weight / slope);
      else if (weight < 0)
        high = -1000;
    };
    cut(k / 64.0, a);
    cut(l / 64.0, b);
    cut(1 - (k + l) / 64.0, -a - b);
    kernels::TriangleRay ray;
    kernels::TriangleCrossing<double> crossing;
    kernels::TrianglesField field;
    field.extent = 100;
    kernels::prepare_for_triangles(field, segment, ray);
    const float* const vertices[3] = {corners[0], corners[1], corners[2]};
    const bool found = kernels::meets_triangle(ray, vertices, crossing);
    beside += low > high;
    if (!found) continue;
    ++met;
    ASSERT_LT(low - 1e-9, crossing.t) << i;
    ASSERT_GT(high + 1e-9, crossing.t) << i;
  }
  EXPECT_GT(met, 10'000u);
  EXPECT_GT(beside, 100'000u);
}

/// The nearest triangle, by a loop over all of them.
kernels::NearestTriangle nearest_of_all(const kernels::TrianglesField& field, const kernels::BvhRay& ray) {
  kernels::NearestTriangle nearest;
  for (uint32_t n = 0; n < field.node_count; ++n)
    for (const uint8_t slot : field.nodes[n].slots)
      if (slot != 0 && kernels::slot_kind(slot) != kernels::kInnerSlot)
        kernels::look_at_leaf(field, ray, field.nodes[n], slot, nearest);
  return nearest;
}

TEST(BvhHits, AreTheNearestOfAllTriangles) {
  uint64_t met = 0, rays = 0, beyond = 0;
  test::Random random(6);
  for (const format::TrianglesData& bvh : Trees().bvhs) {
    const kernels::TrianglesField field = format::field_of(bvh);
    for (int i = 0; i < (bvh.triangles.size() > 1000 ? 1000 : 5000); ++i) {
      const Segment segment = test::random_segment(random, field);
      const kernels::Hit hit = kernels::intersect(field, segment);
      ASSERT_EQ(hit.t < kInfinity, !kernels::query(field, segment).visible);
      ASSERT_EQ(hit.certain(), kernels::query(field, segment).certain);
      kernels::BvhRay ray;
      if (!kernels::prepare_ray(field, segment, ray)) continue;
      const kernels::NearestTriangle nearest = nearest_of_all(field, ray);
      ++rays;
      ASSERT_EQ(hit.triangle, nearest.triangle);
      if (nearest.triangle == kernels::kNoTriangle) continue;
      ++met;
      ASSERT_EQ(hit.t, static_cast<float>(nearest.crossing.t));
      ASSERT_TRUE(segment.tmin <= hit.t && hit.t <= segment.tmax);
      ASSERT_TRUE(0 <= hit.u && 0 <= hit.v && hit.u + hit.v < 1.000001f) << hit.u << ' ' << hit.v;
      // A limit that is not nearer changes nothing.
      const float limit = random.below(2) ? hit.t : hit.t + random.unit() * std::abs(hit.t);
      const kernels::Hit limited = kernels::intersect(field, segment, limit);
      ASSERT_EQ(limited.t, hit.t);
      ASSERT_EQ(limited.triangle, hit.triangle);
      const float nearer = hit.t - random.unit() * (std::abs(hit.t) + field.extent);
      const float found = kernels::intersect(field, segment, nearer).t;
      ASSERT_TRUE(found > nearer || nearer == hit.t);
      beyond += found == kInfinity;
    }
  }
  EXPECT_GT(met, rays / 4);
  EXPECT_GT(beyond, 0u);
}

TEST(BvhHits, ThePointIsMadeOfTheTrianglesVertices) {
  test::Soup one;
  one.positions = {{-1, -1, 2}, {3, -1, 2}, {0, 1, 2}};
  one.triangles = {{0, 1, 2}};
  test::Random random(7);
  const format::TrianglesData bvh = test::RandomTree(one).pack(random);
  const kernels::TrianglesField field = format::field_of(bvh);
  const kernels::Hit hit = kernels::intersect(field, {{0.5f, -0.25f, 0}, {0, 0, 4}, 0, kInfinity});
  EXPECT_EQ(hit.t, 0.5f);
  EXPECT_EQ(hit.low, 0.5f);
  EXPECT_EQ(hit.high, 0.5f);
  EXPECT_EQ(hit.triangle, 0u);
  const float share[3] = {1 - hit.u - hit.v, hit.u, hit.v};
  float point[3] = {};
  for (size_t k = 0; k < 3; ++k)
    for (size_t a = 0; a < 3; ++a)
      point[a] += share[k] * field.vertices[field.nodes[0].first_vertex + field.triangles[0][k]][a];
  EXPECT_NEAR(point[0], 0.5f, 1e-6f);
  EXPECT_NEAR(point[1], -0.25f, 1e-6f);
  EXPECT_EQ(hit.normal[0], 0);
  EXPECT_EQ(hit.normal[1], 0);
  EXPECT_EQ(std::abs(hit.normal[2]), 1);
  // A segment includes its ends.
  EXPECT_EQ(kernels::intersect(field, {{0, 0, 0}, {0, 0, 1}, 2, 2}).t, 2);
  EXPECT_EQ(kernels::intersect(field, {{0, 0, 0}, {0, 0, 1}, 2.0000002f, kInfinity}).t, kInfinity);
}

TEST(Bvh, InvalidRays) {
  test::Random random(3);
  const format::TrianglesData bvh = test::random_bvh(random, 50);
  const kernels::TrianglesField field = format::field_of(bvh);
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const auto ask = [&](const Segment& segment) { return kernels::query(field, segment); };
  const Segment empty{{0, 0, 0}, {0, 0, 1}, 2, 1};
  EXPECT_TRUE(ask(empty).visible);
  EXPECT_TRUE(ask(empty).certain);
  for (const Segment& none :
       {Segment{{nan, 0, 0}, {0, 0, 1}, 0, 1}, Segment{{0, kInfinity, 0}, {0, 0, 1}, 0, 1},
        Segment{{0, 0, 0}, {0, nan, 1}, 0, 1}, Segment{{0, 0, 0}, {0, -kInfinity, 1}, 0, 1},
        Segment{{0, 0, 0}, {0, 0, 0}, 0, 1}, Segment{{0, 0, 0}, {0, 1e-30f, 0}, 0, 1},
        Segment{{0, 0, 0}, {1e30f, 0, 1}, 0, 1}, Segment{{0, 0, 0}, {0, 0, 1}, nan, 1},
        Segment{{0, 0, 0}, {0, 0, 1}, 0, nan}, Segment{{0, 0, 1e30f}, {0, 0, 1}, 0, 1}}) {
    EXPECT_TRUE(ask(none).visible);
    EXPECT_FALSE(ask(none).certain);
    EXPECT_EQ(ask(none).logit, kernels::kCertainLogit);
  }
}

TEST(Bvh, NothingLeaksAtEdgesAndVertices) {
  // A wall of squares, each split along its diagonal: no ray from the front may pass between them.
  test::Soup wall;
  constexpr uint32_t kSide = 17;
  test::Random random(4);
  for (uint32_t y = 0; y < kSide; ++y)
    for (uint32_t x = 0; x < kSide; ++x)
      wall.positions.push_back(
          {static_cast<float>(x) / 3, static_cast<float>(y) / 7, random.between(-0.3f, 0.3f)});
  for (uint32_t y = 0; y + 1 < kSide; ++y)
    for (uint32_t x = 0; x + 1 < kSide; ++x) {
      const uint32_t at = y * kSide + x;
      wall.triangles.push_back({at, at + 1, at + kSide});
      wall.triangles.push_back({at + 1, at + kSide + 1, at + kSide});
    }
  const format::TrianglesData bvh = test::RandomTree(wall).pack(random);
  const kernels::TrianglesField field = format::field_of(bvh);
  for (int i = 0; i < 200'000; ++i) {
    const auto& t = wall.triangles[random.below(uint32_t(wall.triangles.size()))];
    const auto &p = wall.positions[t[random.below(3)]], &q = wall.positions[t[random.below(3)]];
    const float share = random.below(2) ? 0.5f : random.unit();
    Segment segment{{}, {}, 0, kInfinity};
    for (size_t a = 0; a < 3; ++a) {
      const float target = p[a] + share * (q[a] - p[a]);
      segment.origin[a] = a == 2 ? -9.0f : (random.below(2) ? target : target + random.between(-2.0f, 2.0f));
      segment.direction[a] = target - segment.origin[a];
    }
    // Rays to the rim may miss it.
    if (p[0] == 0 || p[1] == 0 || q[0] == 0 || q[1] == 0) continue;
    const float right = wall.positions.back()[0], top = wall.positions.back()[1];
    if (p[0] == right || q[0] == right || p[1] == top || q[1] == top) continue;
    ASSERT_FALSE(kernels::query(field, segment).visible) << i;
  }
}

/// Boxes do not grow with a ray's distance.
TEST(Bvh, FarRaysLookAtNoMoreNodes) {
  test::Random random(8);
  const format::TrianglesData bvh = test::random_bvh(random, 5000);
  const kernels::TrianglesField field = format::field_of(bvh);
  const auto nodes_from = [&](float extents) {
    uint64_t nodes = 0;
    for (int i = 0; i < 2000; ++i) {
      Segment segment{{}, {}, 0, kInfinity};
      for (size_t a = 0; a < 3; ++a) {
        const float target = field.extent * random.between(-0.8f, 0.8f);
        segment.origin[a] = target + field.extent * extents * random.between(-1.0f, 1.0f);
        segment.direction[a] = target - segment.origin[a];
      }
      kernels::BvhRay ray;
      EXPECT_TRUE(kernels::prepare_ray(field, segment, ray));
      kernels::meets_bvh(field, ray, &nodes);
    }
    return double(nodes);
  };
  const double near = nodes_from(20);
  for (const float extents : {1e3f, 2e6f, 1e9f}) EXPECT_LT(nodes_from(extents), 1.1 * near) << extents;
  Segment too_far{{0, 0, field.extent * 0x1.1p32f}, {0, 0, -1}, 0, kInfinity};
  EXPECT_TRUE(kernels::query(field, too_far).visible);
  EXPECT_FALSE(kernels::query(field, too_far).certain);
}

TEST(Bvh, EndsOfTheSegmentBelongToIt) {
  test::Soup one;
  one.positions = {{-1, -1, 2}, {1, -1, 2}, {0, 1, 2}};
  one.triangles = {{0, 1, 2}};
  test::Random random(5);
  const format::TrianglesData bvh = test::RandomTree(one).pack(random);
  const kernels::TrianglesField field = format::field_of(bvh);
  const auto visible = [&](float tmin, float tmax) {
    return kernels::query(field, {{0, 0, 0}, {0, 0, 1}, tmin, tmax}).visible;
  };
  EXPECT_FALSE(visible(0, 2));
  EXPECT_TRUE(visible(0, 1.9999999f));
  EXPECT_FALSE(visible(2, kInfinity));
  EXPECT_TRUE(visible(2.0000002f, kInfinity));
  EXPECT_FALSE(visible(2, 2));
  EXPECT_FALSE(visible(-kInfinity, kInfinity));
  EXPECT_TRUE(visible(-kInfinity, 0));
}

/// Queries a kernel batch by batch and the reference ray by ray.
void expect_same_bits(const kernels::ObjectKernel& kernel, const kernels::TrianglesField& field,
                      uint64_t seed) {
  test::Random random(seed);
  const auto batch = std::make_unique<kernels::SegmentBatch>();
  const auto answers = std::make_unique<kernels::AnswerBatch>();
  for (const uint32_t count : {1u, 7u, kernels::kBatchRays, kernels::kBatchRays}) {
    std::vector<Segment> segments;
    batch->count = count;
    for (uint32_t i = 0; i < count; ++i) {
      const Segment& s = segments.emplace_back(test::random_segment(random, field));
      for (int a = 0; a < 3; ++a) batch->origin[a][i] = s.origin[a], batch->direction[a][i] = s.direction[a];
      batch->tmin[i] = s.tmin, batch->tmax[i] = s.tmax;
    }
    kernel.answer(*batch, *answers, nullptr);
    for (uint32_t i = 0; i < count; ++i) {
      const Answer expected = kernels::query(field, segments[i]);
      ASSERT_EQ(answers->logit[i], expected.logit);
      ASSERT_EQ(answers->certain[i] != 0, expected.certain);
    }
  }
}

TEST(BvhKernels, SameBits) {
  for (const format::TrianglesData& bvh : Trees().bvhs) {
    const kernels::TrianglesField field = format::field_of(bvh);
    expect_same_bits(kernels::ReferenceKernel<kernels::TrianglesField>(field), field, bvh.triangles.size());
  }
}

}  // namespace
}  // namespace nif
