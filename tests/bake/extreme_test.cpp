// Extreme meshes get right answers, or a refusal in one sentence.
//
// The expected answers are computed here, in long double, for each ray and triangle; rays too close to an
// edge to decide are left out.
#include <gtest/gtest.h>

#include <cmath>
#include <numeric>
#include <string_view>

#include "bake/ground_truth/ray_sets.hpp"
#include "bake/reference_answers.hpp"
#include "formats/nif/writer.hpp"
#include "tests/bake/quiet_bake.hpp"
#include "tests/support/test_shapes.hpp"

namespace nif::test {
namespace {

using kernels::Segment;
using Real = long double;
using Vector = std::array<Real, 3>;

Vector operator-(const Vector& a, const Vector& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
Vector cross(const Vector& a, const Vector& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
Real dot(const Vector& a, const Vector& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
template <class Values>
Vector vector(const Values& v) {
  return {Real(v[0]), Real(v[1]), Real(v[2])};
}

enum class Truth { visible, blocked, in_doubt };

/// Compares signed volumes, relative to their sizes.
Truth truth_of(const mesh::Mesh& mesh, const Segment& segment) {
  constexpr Real kDoubt = 1e-5L;
  const Vector origin = vector(segment.origin), direction = vector(segment.direction);
  Truth truth = Truth::visible;
  for (const mesh::Triangle& triangle : mesh.triangles) {
    std::array<Vector, 3> corner;
    for (int c = 0; c < 3; ++c) corner[size_t(c)] = vector(mesh.positions[triangle[size_t(c)]]) - origin;
    std::array<Real, 3> volume;
    Real sum = 0, size = 0;
    for (size_t c = 0; c < 3; ++c) {
      volume[c] = dot(direction, cross(corner[(c + 1) % 3], corner[(c + 2) % 3]));
      sum += volume[c];
      size += std::abs(volume[c]);
    }
    const Real doubt = kDoubt * size;
    const bool outside = *std::min_element(
        volume.begin(), volume.end())<-doubt&& * std::max_element(volume.begin(), volume.end())>
                             doubt;
    if (outside) continue;
    const bool inside = std::all_of(volume.begin(), volume.end(), [&](Real v) { return v > doubt; }) ||
                        std::all_of(volume.begin(), volume.end(), [&](Real v) { return v < -doubt; });
    if (!inside) {
      truth = Truth::in_doubt;
      continue;
    }
    const Real t = (volume[0] * dot(corner[0], corner[0]) == 0 && sum == 0)
                       ? 0
                       : dot(cross(corner[1] - corner[0], corner[2] - corner[0]), corner[0]) /
                             dot(cross(corner[1] - corner[0], corner[2] - corner[0]), direction);
    const Real margin = kDoubt * (1 + std::abs(t));
    if (t > Real(segment.tmin) + margin && t < Real(segment.tmax) - margin) return Truth::blocked;
    if (t > Real(segment.tmin) - margin && t < Real(segment.tmax) + margin) truth = Truth::in_doubt;
  }
  return truth;
}

/// Lines through a mesh's box, and segments that end in it.
std::vector<Segment> rays_through(const mesh::Mesh& mesh, size_t count) {
  const mesh::Box box = mesh::bounds(mesh.positions, mesh.triangles);
  std::vector<Segment> rays;
  nif::Random random(8, 1, count);
  for (size_t i = 0; i < count; ++i) {
    Double3 points[2];
    for (Double3& point : points)
      for (size_t axis = 0; axis < 3; ++axis)
        point[axis] =
            double(box.min[axis]) + (double(box.max[axis]) - double(box.min[axis])) * random.uniform();
    const Double3 along = points[1] - points[0];
    if (i % 2)
      rays.push_back(bake::make_segment(points[0] - along * 10.0, along, INFINITY));
    else
      rays.push_back(bake::make_segment(points[0], along, 1));
  }
  return rays;
}

struct Score {
  size_t asked = 0, in_doubt = 0, wrong = 0, certain_wrong = 0;
};

Score score_of(const bake::BakeResult& result, const mesh::Mesh& mesh, std::span<const Segment> rays) {
  const bake::Answerer answer =
      bake::reference_answerer(format::field_of(result.asset, result.asset.objects.front()));
  std::vector<uint8_t> visible(rays.size()), certain(rays.size());
  std::vector<float> probability(rays.size());
  answer(rays, {visible.data(), certain.data(), probability.data()});
  Score score;
  for (size_t i = 0; i < rays.size(); ++i) {
    const Truth truth = truth_of(mesh, rays[i]);
    ++score.asked;
    if (truth == Truth::in_doubt) {
      ++score.in_doubt;
    } else if (visible[i] != (truth == Truth::visible)) {
      ++score.wrong;
      score.certain_wrong += certain[i];
    }
  }
  return score;
}

bake::BakeOptions exact(const std::string& encoding) {
  bake::BakeOptions options;
  options.encoding = encoding;
  options.evaluation_rays = 1'000;
  if (encoding == "exact") options.resolution = 24;
  return options;
}

/// Every encoding: all answers of exact ones are right, and all certain answers of the others.
void expect_right(mesh::Mesh mesh, double most_in_doubt = 0.05) {
  if (mesh.name.empty()) mesh.name = "mesh";
  const std::vector<Segment> rays = rays_through(mesh, 2'000);
  for (const char* encoding : {"auto", "exact", "bvh"}) {
    const Score score = score_of(bake_quietly(scene_of({mesh}), exact(encoding)), mesh, rays);
    EXPECT_EQ(score.wrong, 0u) << encoding;
    EXPECT_LE(double(score.in_doubt), most_in_doubt * double(score.asked)) << encoding;
  }
  bake::BakeOptions field = small_field(0.05);
  field.evaluation_rays = 1'000;
  const Score score = score_of(bake_quietly(scene_of({mesh}), field), mesh, rays);
  EXPECT_EQ(score.certain_wrong, 0u);
}

/// The message of a refused bake.
std::string refusal_of(mesh::Mesh mesh, Status status, const std::string& encoding = "auto") {
  if (mesh.name.empty()) mesh.name = "mesh";
  try {
    bake_quietly(scene_of({mesh}), exact(encoding));
    return "it was baked";
  } catch (const Error& error) {
    EXPECT_EQ(error.status(), status) << error.what();
    return error.what();
  }
}

mesh::Mesh scaled(mesh::Mesh mesh, float x, float y, float z) {
  for (mesh::Float3& p : mesh.positions) p = {p[0] * x, p[1] * y, p[2] * z};
  return mesh;
}
mesh::Mesh scaled(const mesh::Mesh& mesh, float by) { return scaled(mesh, by, by, by); }
mesh::Mesh moved(mesh::Mesh mesh, float by) {
  for (mesh::Float3& p : mesh.positions) p = {p[0] + by, p[1] - by / 3, p[2] + by / 7};
  return mesh;
}

TEST(Extreme, SizesThatCannotBeComputedWithAreRefused) {
  for (const float size : {1e-30f, 1e-20f, 1e-16f, 1e16f, 1e20f, 1e30f}) {
    const std::string sentence = refusal_of(scaled(torus(20, 10), size), Status::too_large);
    EXPECT_NE(sentence.find("sizes from 1e-15 to 1e15 can be baked"), std::string::npos) << size << sentence;
  }
}

TEST(Extreme, AScaleByAPowerOfTwoChangesNoAnswer) {
  const mesh::Mesh mesh = torus(30, 15);
  const std::vector<Segment> rays = rays_through(mesh, 20'000);
  const auto answers = [&](const std::string& encoding, int exponent) {
    const float scale = std::ldexp(1.0f, exponent);
    const bake::BakeResult result = bake_quietly(scene_of({scaled(mesh, scale)}), exact(encoding));
    std::vector<Segment> scaled_rays(rays);
    for (Segment& ray : scaled_rays)
      for (int axis = 0; axis < 3; ++axis) ray.origin[axis] *= scale, ray.direction[axis] *= scale;
    std::vector<uint8_t> visible(rays.size()), certain(rays.size());
    std::vector<float> probability(rays.size());
    bake::reference_answerer(format::field_of(result.asset, result.asset.objects.front()))(
        scaled_rays, {visible.data(), certain.data(), probability.data()});
    return visible;
  };
  for (const char* encoding : {"exact", "bvh"}) {
    const std::vector<uint8_t> at_one = answers(encoding, 0);
    const bool planes = std::string_view(encoding) == "exact";  // 2^48 is too large for them
    for (const int exponent : {-49, -30, 30, planes ? 39 : 48}) {
      const std::vector<uint8_t> there = answers(encoding, exponent);
      size_t differ = 0;
      for (size_t i = 0; i < rays.size(); ++i) differ += there[i] != at_one[i];
      EXPECT_EQ(differ, 0u) << encoding << " at 2^" << exponent;
    }
  }
}

TEST(Extreme, SmallAndLarge) {
  for (const float size : {1e-14f, 1e-7f, 1e7f, 1e11f}) {
    SCOPED_TRACE(size);
    expect_right(scaled(torus(20, 10), size));
  }
  const mesh::Mesh huge = scaled(torus(20, 10), 1e14f);
  const std::vector<Segment> rays = rays_through(huge, 2'000);
  for (const char* encoding : {"auto", "bvh"})
    EXPECT_EQ(score_of(bake_quietly(scene_of({huge}), exact(encoding)), huge, rays).wrong, 0u) << encoding;
  EXPECT_NE(refusal_of(huge, Status::too_large, "exact").find("too large for planes to compute with"),
            std::string::npos);
}

TEST(Extreme, FarFromTheOrigin) {
  for (const float distance : {1e3f, 1e5f, 1e6f}) {
    SCOPED_TRACE(distance);
    expect_right(moved(torus(20, 10), distance), 0.3);
  }
  // So far away that only points and lines are left, or the size is a few float steps.
  mesh::Mesh gone = moved(torus(20, 10), 1e9f);
  gone.name = "far";
  EXPECT_EQ(refusal_of(gone, Status::all_degenerate).substr(0, 4), "mesh");
}

TEST(Extreme, FlatAndNeedleShaped) {
  expect_right(scaled(torus(20, 10), 1, 1, 1e-6f), 1);
  expect_right(scaled(torus(20, 10), 1, 1e-6f, 1e-6f), 1);
  expect_right(scaled(torus(20, 10), 1e6f, 1, 1), 1);
  mesh::Mesh plane{"plane", {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}, {{0, 1, 2}, {0, 2, 3}}};
  expect_right(plane, 1);
}

TEST(Extreme, OneTriangle) {
  const mesh::Mesh one{"one", {{0, 0, 0}, {1, 0.25f, 0.5f}, {0.125f, 1, -0.5f}}, {{0, 1, 2}}};
  EXPECT_EQ(bake_quietly(scene_of({one}), exact("auto")).objects[0].encoding, "bvh");
  expect_right(one);
  expect_right(scaled(one, 1e-10f));
  expect_right(scaled(one, 1e10f));
  const mesh::Mesh needle{"needle", {{0, 0, 0}, {1, 0, 0}, {1, 1e-7f, 1e-7f}}, {{0, 1, 2}}};
  expect_right(needle, 1);
}

TEST(Extreme, AllInOnePoint) {
  mesh::Mesh mesh = icosphere(3);
  for (mesh::Float3& p : mesh.positions) p = {3, 4, 5};
  for (const char* encoding : {"auto", "exact", "bvh", "proof", "segment", "spherical"})
    EXPECT_NE(refusal_of(mesh, Status::all_degenerate, encoding).find("area"), std::string::npos) << encoding;
}

TEST(Extreme, ManyTinyComponents) {
  mesh::Mesh mesh;
  mesh.name = "dust";
  nif::Random random(3, 3, 3);
  for (uint32_t i = 0; i < 5'000; ++i) {
    const mesh::Float3 at{float(random.uniform()), float(random.uniform()), float(random.uniform())};
    append(mesh, cube(), 1e-4f, at);
  }
  const std::vector<Segment> rays = rays_through(mesh, 300);
  for (const char* encoding : {"exact", "bvh"}) {
    const Score score = score_of(bake_quietly(scene_of({mesh}), exact(encoding)), mesh, rays);
    EXPECT_EQ(score.wrong, 0u) << encoding;
  }
}

TEST(Extreme, AGiantAndManyTinyTriangles) {
  mesh::Mesh mesh = scaled(icosphere(5), 1e-5f);  // a ball of 20,480 triangles on a plate of two
  mesh.name = "ball on a plate";
  const auto first = uint32_t(mesh.positions.size());
  for (const float x : {-1.f, 1.f})
    for (const float y : {-1.f, 1.f}) mesh.positions.push_back({x, y, -1e-5f});
  mesh.triangles.push_back({first, first + 1, first + 2});
  mesh.triangles.push_back({first + 1, first + 3, first + 2});
  std::vector<Segment> rays = rays_through(scaled(icosphere(2), 1e-5f), 200);
  for (const Segment& ray : rays_through(mesh, 100)) rays.push_back(ray);
  for (const char* encoding : {"exact", "bvh"}) {
    const Score score = score_of(bake_quietly(scene_of({mesh}), exact(encoding)), mesh, rays);
    EXPECT_EQ(score.wrong, 0u) << encoding;
  }
}

}  // namespace
}  // namespace nif::test
