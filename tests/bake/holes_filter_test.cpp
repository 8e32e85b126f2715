// Rays pass the holes of triangles: the ground truth equals a brute force that shares no code with it, and each
// of Embree's calls for speed equals both but for rays close to the border of a texel.
#include "bake/ground_truth/holes_filter.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "bake/ground_truth/embree_baseline.hpp"
#include "bake/ground_truth/scene_truth.hpp"
#include "formats/base/random.hpp"
#include "formats/base/vector.hpp"
#include "tests/support/test_shapes.hpp"

namespace nif::test {
namespace {

using bake::Segment;
using mesh::AlphaMap;
using mesh::TriangleHoles;
using mesh::Wrap;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// A map's texels one by one.
struct Picture {
  std::vector<std::vector<bool>> rows;
  std::array<Wrap, 2> wrap;

  static int64_t place(int64_t texel, int64_t size, Wrap wrap) {
    if (wrap == Wrap::clamp) return std::max<int64_t>(0, std::min(texel, size - 1));
    if (wrap == Wrap::repeat) return (texel % size + size) % size;
    const int64_t turn = (texel % (2 * size) + 2 * size) % (2 * size);
    return turn < size ? turn : 2 * size - 1 - turn;
  }
  bool blocks(double x, double y) const {
    const auto row = size_t(place(int64_t(std::floor(y)), int64_t(rows.size()), wrap[1]));
    return rows[row][size_t(place(int64_t(std::floor(x)), int64_t(rows[0].size()), wrap[0]))];
  }
  mesh::AlphaMap map() const {
    AlphaMap map{uint32_t(rows[0].size()), uint32_t(rows.size()), wrap, {}};
    map.tiles.resize(size_t(map.tiles_of_row()) * ((map.height + 7) / 8));
    for (uint32_t y = 0; y < map.height; ++y)
      for (uint32_t x = 0; x < map.width; ++x)
        if (rows[y][x]) map.tiles[y / 8 * map.tiles_of_row() + x / 8] |= uint64_t{1} << (x % 8 + y % 8 * 8);
    return map;
  }
};

struct Leaves {
  mesh::CleanMesh mesh;
  std::vector<Picture> pictures;
};

Picture random_picture(nif::Random& random, size_t number) {
  constexpr std::array kWraps{Wrap::repeat, Wrap::mirror, Wrap::clamp};
  constexpr std::array<std::array<size_t, 2>, 9> kSizes{
      {{7, 5}, {1, 1}, {13, 32}, {64, 3}, {16, 16}, {9, 1}, {2, 31}, {33, 17}, {8, 8}}};
  const auto [width, height] = kSizes[number];
  Picture picture{{}, {kWraps[number % 3], kWraps[number / 3]}};
  picture.rows.assign(height, std::vector<bool>(width));
  for (auto& row : picture.rows)
    for (size_t x = 0; x < width; ++x) row[x] = random.below(2) == 0;
  return picture;
}

/// A part of a map up to a few times its size, sometimes far away from it.
TriangleHoles random_holes(nif::Random& random, const AlphaMap& map, uint32_t number) {
  TriangleHoles holes{number, random.below(2) * 5, {}};
  const double texels = holes.shift == 0 ? 65536 : 2048;
  const uint32_t size[2] = {map.width, map.height};
  for (size_t a = 0; a < 2; ++a) {
    const double far = holes.shift != 0 && random.below(2) ? std::floor(random.uniform(-60'000, 60'000)) : 0;
    const double reach = random.uniform(0.2, 2) * size[a];
    for (auto& place : holes.places) place[a] = int32_t((far + random.uniform(-reach, reach)) * texels);
  }
  return holes;
}

/// Random triangles, of which a few are solid.
Leaves random_leaves(uint64_t seed, size_t triangles) {
  nif::Random random(seed, 0, 0);
  Leaves leaves;
  for (size_t i = 0; i < 9; ++i) {
    leaves.pictures.push_back(random_picture(random, i));
    leaves.mesh.alpha_maps.push_back(std::make_shared<AlphaMap>(leaves.pictures.back().map()));
  }
  for (uint32_t i = 0; i < triangles; ++i) {
    std::array<float, 3> middle;
    for (float& x : middle) x = float(random.uniform(-1, 1));
    for (size_t corner = 0; corner < 3; ++corner) {
      mesh::Float3 p;
      for (size_t a = 0; a < 3; ++a) p[a] = middle[a] + float(random.uniform(-0.8, 0.8));
      leaves.mesh.positions.push_back(p);
    }
    leaves.mesh.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
    const uint32_t map = random.below(10);
    leaves.mesh.holes.push_back(map == 9 ? TriangleHoles{}
                                         : random_holes(random, *leaves.mesh.alpha_maps[map], map));
  }
  return leaves;
}

std::vector<Segment> random_rays(uint64_t seed, size_t count) {
  nif::Random random(seed, 1, 0);
  std::vector<Segment> rays(count);
  for (Segment& ray : rays) {
    const double stretch = random.uniform(0.2, 3);
    for (size_t a = 0; a < 3; ++a) {
      ray.origin[a] = float(random.uniform(-1.5, 1.5));
      ray.direction[a] = float((random.uniform(-0.8, 0.8) - double(ray.origin[a])) * stretch);
    }
    ray.tmin = random.below(2) ? 0 : 0.1f;
    ray.tmax = random.below(2) ? float(kInfinity) : float(random.uniform(0.3, 3) / stretch);
  }
  return rays;
}

/// How close to an edge or a border rounding may decide.
struct Tolerance {
  double edge;   ///< weights
  double texel;  ///< texels
};
constexpr Tolerance kTruth{1e-5, 1e-6}, kTruthOfInstances{1e-4, 1e-4}, kFast{1e-4, 1e-3};

struct Verdict {
  bool doubtful = false;
  bool holes = false;  ///< there is a hole on its way, not necessarily before the hit
  struct Hit {
    double t = kInfinity;
    uint32_t triangle = 0, instance = 0;
  } first;
  bool blocked() const { return first.t < kInfinity; }
};

/// Asks triangle by triangle, after Moeller and Trumbore, in the space of the world.
class BruteForce {
 public:
  void add(const Leaves& leaves, const mesh::Transform& transform, uint32_t instance) {
    for (uint32_t t = 0; t < leaves.mesh.triangles.size(); ++t) {
      Face face{{}, &leaves, t, instance};
      for (size_t k = 0; k < 3; ++k) {
        const mesh::Float3& p = leaves.mesh.positions[leaves.mesh.triangles[t][k]];
        for (size_t a = 0; a < 3; ++a) {
          face.corners[k][a] = transform[4 * a + 3];
          for (size_t b = 0; b < 3; ++b) face.corners[k][a] += double(transform[4 * a + b]) * p[b];
        }
      }
      faces_.push_back(face);
    }
  }

  Verdict ask(const Segment& ray, const Tolerance& tolerance) const {
    Verdict verdict;
    double second = kInfinity;
    for (const Face& face : faces_) {
      const double t = meet(face, ray, tolerance, verdict);
      second = std::min(second, std::max(t, verdict.first.t));
      if (t < verdict.first.t) verdict.first = {t, face.triangle, face.instance};
    }
    verdict.doubtful = verdict.doubtful || second - verdict.first.t < 1e-4;
    return verdict;
  }

 private:
  struct Face {
    std::array<Double3, 3> corners;
    const Leaves* leaves;
    uint32_t triangle, instance;
  };

  /// Infinite if the face does not block.
  static double meet(const Face& face, const Segment& ray, const Tolerance& tolerance, Verdict& verdict) {
    const Double3 origin = to_double(std::to_array(ray.origin)),
                  direction = to_double(std::to_array(ray.direction)),
                  first = face.corners[1] - face.corners[0], second = face.corners[2] - face.corners[0],
                  p = cross(direction, second), from = origin - face.corners[0], q = cross(from, first),
                  normal = cross(first, second);
    const double determinant = dot(first, p), u = dot(from, p) / determinant,
                 v = dot(direction, q) / determinant, t = dot(second, q) / determinant,
                 cosine = std::abs(dot(normal, direction)) / (length(normal) * length(direction)),
                 edge = std::min({u, v, 1 - u - v}), close = tolerance.edge / cosine;
    if (edge < -close || t < double(ray.tmin) - close || t > double(ray.tmax) + close) return kInfinity;
    verdict.doubtful =
        verdict.doubtful || edge < close || t < double(ray.tmin) + close || t > double(ray.tmax) - close;
    const TriangleHoles& holes = face.leaves->mesh.holes[face.triangle];
    if (holes.map == TriangleHoles::kNoMap) return t;
    const auto place = [&](size_t axis) {
      const auto& places = holes.places;
      return ((1 - u - v) * places[0][axis] + u * places[1][axis] + v * places[2][axis]) *
             std::pow(2.0, double(holes.shift)) / 65536;
    };
    const double x = place(0), y = place(1);
    const double border = std::min(std::abs(x - std::round(x)), std::abs(y - std::round(y)));
    verdict.doubtful = verdict.doubtful || border < tolerance.texel / cosine;
    if (face.leaves->pictures[holes.map].blocks(x, y)) return t;
    verdict.holes = true;
    return kInfinity;
  }

  std::vector<Face> faces_;
};

void expect_truth(const BruteForce& force, const bake::EmbreeTruth& truth, std::span<const Segment> rays,
                  const Tolerance& tolerance) {
  size_t doubtful = 0, blocked = 0, holes = 0, wrong = 0, wrong_hits = 0;
  for (const Segment& ray : rays) {
    const Verdict expected = force.ask(ray, tolerance);
    doubtful += expected.doubtful;
    if (expected.doubtful) continue;
    blocked += expected.blocked();
    holes += expected.holes;
    wrong += truth.occluded(ray) != expected.blocked();
    const auto hit = truth.first_hit(ray);
    if (!hit || !expected.blocked())
      wrong_hits += hit.has_value() != expected.blocked();
    else
      wrong_hits += hit->triangle != expected.first.triangle || hit->instance != expected.first.instance ||
                    std::abs(double(hit->t) - expected.first.t) > 1e-4;
  }
  EXPECT_EQ(wrong, 0u);
  EXPECT_EQ(wrong_hits, 0u);
  EXPECT_LT(doubtful, rays.size() / 20);
  EXPECT_GT(blocked, rays.size() / 10);
  EXPECT_LT(blocked, rays.size() - rays.size() / 10);
  EXPECT_GT(holes, rays.size() / 10);
}

/// Every call, with and without a hint of coherence, about rays that leave no doubt, and about all.
void expect_fast(const BruteForce& force, const bake::EmbreeTruth& truth, const bake::EmbreeScene& scene,
                 std::span<const Segment> rays, bool hints) {
  std::vector<Segment> sure;
  std::vector<uint8_t> visible, visible_of_all;
  for (const Segment& ray : rays) {
    const Verdict expected = force.ask(ray, kFast);
    visible_of_all.push_back(!truth.occluded(ray));
    if (expected.doubtful) continue;
    sure.push_back(ray);
    visible.push_back(!expected.blocked());
  }
  ASSERT_GT(sure.size(), rays.size() * 8 / 10);
  bake::EmbreeRays asked(rays.size());
  for (const bake::EmbreeCall call : bake::kEmbreeCalls) {
    SCOPED_TRACE(bake::name_of(call));
    for (const bool coherent : {false, true}) {
      if (coherent && !hints) continue;
      asked.lay_out(sure, call);
      asked.ask(scene, coherent);
      EXPECT_EQ(asked.wrong(visible), 0u);
      asked.lay_out(rays, call);
      asked.ask(scene, coherent);
      EXPECT_LT(asked.wrong(visible_of_all), rays.size() / 100);
    }
  }
}

class HolesOfShapes : public testing::TestWithParam<uint64_t> {};

TEST_P(HolesOfShapes, LetRaysPassAsABruteForceSays) {
  const Leaves leaves = random_leaves(GetParam(), 25);
  BruteForce force;
  force.add(leaves, mesh::kIdentity, 0);
  expect_truth(force, bake::EmbreeTruth(leaves.mesh), random_rays(GetParam(), 20'000), kTruth);
}

TEST_P(HolesOfShapes, LetEachOfEmbreesCallsPass) {
  const Leaves leaves = random_leaves(GetParam(), 25);
  BruteForce force;
  force.add(leaves, mesh::kIdentity, 0);
  const bake::EmbreeTruth truth(leaves.mesh);
  const std::vector<Segment> rays = random_rays(GetParam(), 5'000);
  for (const bake::EmbreeBuild build : {bake::EmbreeBuild::robust, bake::EmbreeBuild::standard,
                                        bake::EmbreeBuild::compact, bake::EmbreeBuild::high})
    expect_fast(force, truth, bake::EmbreeScene(leaves.mesh, build), rays, true);
}

/// Two objects, of which one has no holes, stretched, turned and mirrored.
struct PlacedLeaves {
  explicit PlacedLeaves(uint64_t seed) : holey(random_leaves(seed, 12)), solid(random_leaves(seed + 100, 2)) {
    solid.mesh.holes.assign(solid.mesh.triangles.size(), {});
    for (uint32_t i = 0; i < instances.size(); ++i)
      force.add(instances[i].object == 0 ? holey : solid, instances[i].transform, i);
  }

  Leaves holey, solid;
  std::vector<bake::Placed> instances{{0, {0.8f, 0, 0, 0.3f, 0, 0.5f, 0.1f, 0, 0, 0, 0.9f, 0.25f}},
                                      {1, {0, 0.8f, 0, 0.5f, 0, 0, 0.8f, 0, 0.8f, 0, 0, -0.7f}},
                                      {0, {-0.6f, 0, 0.2f, -0.7f, 0, 1, 0, 0.1f, 0.3f, 0, 1, 0.5f}}};
  BruteForce force;
  std::vector<bake::EmbreeObject> objects() const { return {holey.mesh, solid.mesh}; }
};

TEST_P(HolesOfShapes, OfInstancesLetRaysPass) {
  const PlacedLeaves placed(GetParam());
  const bake::EmbreeTruth truth(placed.objects(), placed.instances);
  expect_truth(placed.force, truth, random_rays(GetParam(), 20'000), kTruthOfInstances);
}

TEST_P(HolesOfShapes, OfInstancesLetEachOfEmbreesCallsPass) {
  const PlacedLeaves placed(GetParam());
  const bake::EmbreeTruth truth(placed.objects(), placed.instances);
  const std::vector<Segment> rays = random_rays(GetParam(), 5'000);
  for (const bake::EmbreeBuild build : {bake::EmbreeBuild::robust, bake::EmbreeBuild::standard})
    expect_fast(placed.force, truth, bake::EmbreeScene(placed.objects(), placed.instances, build), rays,
                false);
}

INSTANTIATE_TEST_SUITE_P(Random, HolesOfShapes, testing::Values(1, 2, 3, 4));

TEST(HolesFilter, IsExactWhereTexelsAreTooSmallForFloats) {
  Leaves leaves = random_leaves(7, 10);
  nif::Random random(7, 2, 0);
  for (TriangleHoles& holes : leaves.mesh.holes) {
    holes = {0, 0, {}};
    for (auto& place : holes.places)
      for (int32_t& x : place) x = int32_t(random.uniform(-0x1p31, 0x1p31));
  }
  BruteForce force;
  force.add(leaves, mesh::kIdentity, 0);
  expect_truth(force, bake::EmbreeTruth(leaves.mesh), random_rays(7, 20'000), kTruth);
}

TEST(HolesFilter, AnswersForMeshesOfAnySize) {
  Leaves leaves = random_leaves(5, 15);
  const bake::EmbreeTruth truth(leaves.mesh);
  // The ground truth scales this mesh back to one of size 1, exactly.
  constexpr int kExponent = -40;
  for (mesh::Float3& p : leaves.mesh.positions)
    for (float& x : p) x = std::ldexp(x, kExponent);
  const bake::EmbreeTruth tiny(leaves.mesh);
  for (const Segment& ray : random_rays(5, 5'000)) {
    Segment moved = ray;
    for (float& x : moved.origin) x = std::ldexp(x, kExponent);
    for (float& x : moved.direction) x = std::ldexp(x, kExponent);
    EXPECT_EQ(truth.occluded(ray), tiny.occluded(moved));
  }
}

TEST(HolesFilter, IsOnlyForMeshesWithHoles) {
  Leaves leaves = random_leaves(6, 15);
  const auto filter = [&] { return bake::HolesFilter::make(leaves.mesh, bake::HoleTest::fast); };
  const int64_t with = bake::EmbreeScene(leaves.mesh, bake::EmbreeBuild::standard).memory().buffers;
  ASSERT_TRUE(filter());
  EXPECT_GE(filter()->bytes(), 15u * sizeof(float) * 6);
  const auto bytes = int64_t(filter()->bytes());
  leaves.mesh.holes.assign(leaves.mesh.triangles.size(), {});
  EXPECT_FALSE(filter());
  leaves.mesh.holes.clear();
  EXPECT_FALSE(filter());
  EXPECT_EQ(bake::EmbreeScene(leaves.mesh, bake::EmbreeBuild::standard).memory().buffers, with - bytes);
}

TEST(HolesFilter, OpensTheComponentThatItsTriangleIsOf) {
  mesh::Mesh two = cube();
  append(two, cube(), 1, {5, 0, 0});
  mesh::CleanMesh surface = mesh::clean(two);
  const auto inside = [&](float x) {
    return bake::InsideTest(surface, bake::find_closed_components(surface)).inside({x, 0.1f, 0.2f});
  };
  EXPECT_EQ(bake::find_closed_components(surface).count(), 2u);
  EXPECT_TRUE(inside(0));
  EXPECT_TRUE(inside(5));

  surface.alpha_maps.push_back(std::make_shared<AlphaMap>(AlphaMap{1, 1, {}, {1}}));
  surface.holes.resize(surface.triangles.size());
  surface.holes[14].map = 0;
  const bake::ClosedComponents closed = bake::find_closed_components(surface);
  EXPECT_EQ(closed.count(), 1u);
  EXPECT_EQ(closed.open_components, 1u);
  EXPECT_EQ(closed.turned, 0u);
  for (const uint32_t member : closed.members) EXPECT_LT(member / 2, 12u);
  EXPECT_TRUE(inside(0));
  EXPECT_FALSE(inside(5));
}

TEST(HolesFilter, SurfacesOfHolesHaveTheirSceneTruth) {
  mesh::Mesh box = cube();
  bake::Prepared prepared = bake::prepare(box);
  const Segment through{{0.3f, 0.2f, -5}, {0, 0, 1}, 0, 100};
  const auto blocked = [&] {
    const bake::Prepared* const objects[] = {&prepared};
    const bake::Placed instances[] = {{0, mesh::kIdentity}};
    const bake::SceneTruth scene(objects, instances);
    const bake::GroundTruth truth(prepared);
    EXPECT_EQ(scene.source().embree.occluded(through), truth.source().embree.occluded(through));
    EXPECT_EQ(scene.source().inside.inside({0, 0, 0}), truth.source().inside.inside({0, 0, 0}));
    return truth.source().embree.occluded(through);
  };
  EXPECT_TRUE(blocked());
  prepared.surface.alpha_maps.push_back(std::make_shared<AlphaMap>(AlphaMap{1, 1, {}, {0}}));
  prepared.surface.holes.assign(prepared.surface.triangles.size(), {0, 0, {}});
  prepared.closed = bake::find_closed_components(prepared.surface);
  EXPECT_FALSE(blocked());
}

}  // namespace
}  // namespace nif::test
