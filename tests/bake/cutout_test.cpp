// Objects with holes become `cutout` objects, unless they are asked to be learned or planes, and others do not; they say
// what the ground truth says; objects share alpha maps; fields learn holes, and planes prove nothing by what has some.
#include <gtest/gtest.h>

#include <cmath>

#include "bake/ground_truth/embree_truth.hpp"
#include "bake/ground_truth/prepare.hpp"
#include "bake/ground_truth/ray_sets.hpp"
#include "formats/base/random.hpp"
#include "formats/nif/reader.hpp"
#include "formats/nif/writer.hpp"
#include "tests/bake/quiet_bake.hpp"
#include "tests/support/test_random.hpp"
#include "tests/support/test_shapes.hpp"

namespace nif::test {
namespace {

using kernels::Segment;
using mesh::TriangleAlpha;

/// A disc that blocks, in the middle of a picture.
std::shared_ptr<const mesh::AlphaMap> disc(uint32_t side, mesh::Wrap wrap) {
  mesh::AlphaMap map{side, side, {wrap, wrap}, {}};
  map.tiles.resize(size_t(map.tiles_of_row()) * map.tiles_of_row());
  const double middle = side / 2.0;
  for (uint32_t y = 0; y < side; ++y)
    for (uint32_t x = 0; x < side; ++x)
      if (std::hypot(x + 0.5 - middle, y + 0.5 - middle) < 0.4 * side)
        map.tiles[y / 8 * map.tiles_of_row() + x / 8] |= uint64_t{1} << (x % 8 + 8 * (y % 8));
  return std::make_shared<const mesh::AlphaMap>(std::move(map));
}

/// Cards of two triangles that each show a whole picture, in all directions, and a solid ball.
mesh::Mesh bush(uint64_t seed, uint32_t cards, const mesh::AlphaMaps& maps) {
  Random random(seed);
  mesh::Mesh mesh = icosphere(1);
  for (mesh::Float3& p : mesh.positions)
    for (float& x : p) x *= 0.3f;
  mesh.name = "bush";
  mesh.alpha_maps = maps;
  mesh.alpha.assign(mesh.triangles.size(), TriangleAlpha::solid);
  mesh.holes.resize(mesh.triangles.size());
  for (uint32_t i = 0; i < cards; ++i) {
    mesh::Float3 corner, along[2];
    for (size_t a = 0; a < 3; ++a) {
      corner[a] = random.between(-1.0f, 1.0f);
      for (auto& side : along) side[a] = random.between(-0.5f, 0.5f);
    }
    const auto first = uint32_t(mesh.positions.size());
    for (uint32_t k = 0; k < 4; ++k) {
      mesh::Float3 p = corner;
      for (size_t a = 0; a < 3; ++a)
        p[a] += (k == 1 || k == 2 ? along[0][a] : 0.0f) + (k >= 2 ? along[1][a] : 0.0f);
      mesh.positions.push_back(p);
    }
    const uint32_t map = random.below(uint32_t(maps.size()));
    const int32_t side = int32_t(maps[map]->width) << mesh::TriangleHoles::kFraction;
    const std::array<std::array<int32_t, 2>, 4> at{{{0, 0}, {side, 0}, {side, side}, {0, side}}};
    for (uint32_t second = 1; second <= 2; ++second) {
      mesh.triangles.push_back({first, first + second, first + second + 1});
      mesh.alpha.push_back(TriangleAlpha::cut);
      mesh.holes.push_back({map, 0, {at[0], at[second], at[second + 1]}});
    }
  }
  return mesh;
}

bake::BakeOptions options_of(const char* encoding) {
  bake::BakeOptions options;
  options.encoding = encoding;
  options.evaluation_rays = 0;
  return options;
}

Segment random_ray(Random& random) {
  Segment ray;
  for (size_t a = 0; a < 3; ++a) {
    ray.origin[a] = random.between(-2.0f, 2.0f);
    ray.direction[a] = random.between(-1.0f, 1.0f) - ray.origin[a];
  }
  ray.tmin = 0;
  ray.tmax = random.below(2) ? std::numeric_limits<float>::infinity() : random.between(0.2f, 2.0f);
  return ray;
}

TEST(Cutout, SaysWhatTheGroundTruthSays) {
  const mesh::Scene scene =
      scene_of({bush(1, 300, {disc(37, mesh::Wrap::clamp), disc(64, mesh::Wrap::repeat)})});
  const bake::BakeResult result = bake_quietly(scene, options_of("auto"));
  ASSERT_EQ(result.objects[0].encoding, "cutout");
  const bake::Prepared prepared = bake::prepare(scene.meshes[0]);
  const bake::EmbreeTruth truth(prepared.surface);
  mesh::CleanMesh cards = prepared.surface;
  cards.holes.clear();
  const bake::EmbreeTruth solid(cards);
  const kernels::AnyField field = format::field_of(result.asset, result.asset.objects[0]);
  Random random(2);
  uint32_t blocked = 0, holes_matter = 0, differ = 0;
  constexpr uint32_t kRays = 30'000;
  for (uint32_t i = 0; i < kRays; ++i) {
    const Segment ray = random_ray(random);
    const kernels::Answer answer = kernels::query(field, ray);
    EXPECT_TRUE(answer.certain);
    const bool expected = truth.occluded(ray);
    differ += answer.visible == expected;
    blocked += expected;
    holes_matter += expected != solid.occluded(ray);
    const kernels::Hit hit = kernels::intersect(field, ray);
    ASSERT_EQ(hit.t < std::numeric_limits<float>::infinity(), !answer.visible);
  }
  EXPECT_EQ(differ, 0u);
  EXPECT_GT(blocked, kRays / 10);
  EXPECT_GT(holes_matter, kRays / 20);
}

TEST(Cutout, IsForObjectsWithHolesAlone) {
  const mesh::AlphaMaps maps{disc(40, mesh::Wrap::repeat)};
  mesh::Mesh other = bush(2, 20, {disc(40, mesh::Wrap::repeat)});  // an equal map
  other.name = "other";
  const mesh::Scene scene = scene_of({bush(1, 30, maps), icosphere(2), other});
  for (const char* encoding : {"auto", "bvh", "exact"}) {
    const bake::BakeOptions options = options_of(encoding);
    const bake::BakeResult result = bake_quietly(scene, options);
    ASSERT_EQ(result.objects.size(), 3u) << encoding;
    for (const size_t i : {0, 2}) {
      EXPECT_EQ(result.objects[i].encoding, "cutout") << encoding;
      EXPECT_EQ(result.objects[i].reason, "it has holes") << encoding;
    }
    EXPECT_NE(result.objects[1].encoding, "cutout") << encoding;
    EXPECT_EQ(result.asset.alpha_maps.size(), 1u) << encoding;
    const std::vector<std::byte> file = format::encode(result.asset);
    const format::AssetView view = format::read_asset(file, "file");
    ASSERT_EQ(view.alpha_maps.size(), 1u);
    EXPECT_EQ(std::vector<uint64_t>(view.alpha_maps[0].tiles, view.alpha_maps[0].tiles + 25), maps[0]->tiles);
    // Each card shows one of two halves of the picture.
    EXPECT_EQ(view.objects[0].holes->field.patch_count, 2u);
  }
}

/// Options of a quick bake of any encoding.
bake::BakeOptions quick(const char* encoding, uint32_t resolution) {
  bake::BakeOptions options = options_of(encoding);
  options.resolution = resolution;
  options.effort = 0.05;
  options.spherical.rays = 200'000;
  options.spherical.fields.outer.resolution = options.spherical.fields.inner.resolution = 16;
  return options;
}

TEST(Cutout, MakesWayForWhatIsLearnedOrOpenIfThatIsAskedFor) {
  const mesh::Scene scene = scene_of({bush(1, 30, {disc(40, mesh::Wrap::repeat)}), icosphere(2)});
  for (const char* encoding : {"segment", "proof", "spherical"}) {
    SCOPED_TRACE(encoding);
    bake::BakeOptions options = quick(encoding, 12);
    if (encoding == std::string("spherical")) options.resolution.reset();
    const bake::BakeResult result = bake_quietly(scene, options);
    ASSERT_EQ(result.objects.size(), 2u);
    for (const bake::ObjectReport& object : result.objects) {
      EXPECT_EQ(object.encoding, encoding);
      EXPECT_EQ(object.reason, "as requested");
    }
    EXPECT_EQ(result.asset.alpha_maps.size(), 0u);
    EXPECT_NO_THROW(format::read_asset(format::encode(result.asset), "file"));
  }
  // With auto, it is exact whatever else is said.
  bake::BakeOptions options = options_of("auto");
  options.open_rays = true;
  EXPECT_EQ(bake_quietly(scene, options).objects[0].encoding, "cutout");
  options = options_of("auto");
  options.max_bytes = 30'000;
  EXPECT_EQ(bake_quietly(scene, options).objects[0].encoding, "cutout");
}

TEST(Cutout, SharesANetwork) {
  bake::BakeOptions options = quick("spherical", 12);
  options.resolution.reset();
  options.spherical.shared_network = true;
  const bake::BakeResult result =
      bake_quietly(scene_of({icosphere(1), bush(1, 5, {disc(9, mesh::Wrap::clamp)})}), options);
  for (const bake::ObjectReport& object : result.objects) EXPECT_EQ(object.encoding, "spherical");
}

/// A closed mesh some of whose triangles have holes.
mesh::Mesh pierced(mesh::Mesh mesh, uint64_t seed, double share) {
  Random random(seed);
  mesh.alpha_maps = {disc(16, mesh::Wrap::clamp)};
  mesh.alpha.assign(mesh.triangles.size(), TriangleAlpha::solid);
  mesh.holes.resize(mesh.triangles.size());
  constexpr int32_t kSide = 16 << mesh::TriangleHoles::kFraction;
  for (size_t t = 0; t < mesh.triangles.size(); ++t) {
    if (random.between(0.0f, 1.0f) >= float(share)) continue;
    mesh.alpha[t] = TriangleAlpha::cut;
    mesh.holes[t] = {0, 0, {{{0, 0}, {kSide, 0}, {kSide / 2, kSide}}}};
  }
  return mesh;
}

struct Counted {
  uint32_t certain = 0, certain_blocked = 0, wrong = 0, blocked = 0;
};

/// Answers rays at random, and others that start and end close to the surface, where walls and sides decide.
Counted count_answers(const mesh::Mesh& mesh, const char* encoding, uint32_t resolution, uint32_t rays) {
  const bake::BakeResult result = bake_quietly(scene_of({mesh}), quick(encoding, resolution));
  EXPECT_EQ(result.objects[0].encoding, encoding);
  const bake::Prepared prepared = bake::prepare(mesh);
  const bake::GroundTruth truth(prepared);
  const kernels::AnyField field = format::field_of(result.asset, result.asset.objects[0]);
  Random random(7);
  nif::Random drawn(8, 0, 0);
  Counted counted;
  for (uint32_t i = 0; i < rays; ++i) {
    Segment ray = random_ray(random);
    if (i % 2) {
      const auto start = bake::draw_surface_point(truth.source(), drawn);
      if (!start) continue;
      ray = bake::draw_from(*start, drawn);
      if (i % 4 == 1) ray.tmax = random.between(0.0f, 0.1f);
    }
    const kernels::Answer answer = kernels::query(field, ray);
    const bool blocked = truth.source().embree.occluded(ray);
    counted.blocked += blocked;
    counted.certain += answer.certain;
    counted.certain_blocked += answer.certain && !answer.visible;
    if (answer.certain && answer.visible == blocked && !truth.source().embree.in_doubt(ray)) ++counted.wrong;
  }
  return counted;
}

TEST(Cutout, PlanesProveNothingByWhatHasHoles) {
  constexpr uint32_t kRays = 20'000;
  for (const uint32_t resolution : {8, 24, 64}) {
    SCOPED_TRACE(resolution);
    for (uint64_t seed = 1; seed <= 3; ++seed) {
      const Counted counted =
          count_answers(bush(seed, 60, {disc(37, mesh::Wrap::clamp)}), "proof", resolution, kRays);
      EXPECT_EQ(counted.wrong, 0u);
      EXPECT_GT(counted.certain, kRays / 20);
    }
    for (const double share : {0.01, 0.3, 1.0}) {
      SCOPED_TRACE(share);
      const Counted ball = count_answers(pierced(icosphere(3), 4, share), "proof", resolution, kRays),
                    ring = count_answers(pierced(torus(48, 24), 5, share), "proof", resolution, kRays);
      EXPECT_EQ(ball.wrong, 0u);
      EXPECT_EQ(ring.wrong, 0u);
      EXPECT_GT(ball.blocked, kRays / 10);
      if (share < 1) continue;
      EXPECT_EQ(ball.certain_blocked + ring.certain_blocked, 0u) << "nothing is solid";
    }
    const Counted half = count_answers(pierced(icosphere(3), 4, 0.3), "segment", resolution, kRays);
    EXPECT_EQ(half.wrong, 0u);
  }
  // Where nothing has holes they do prove that rays are blocked, so the test above could fail.
  EXPECT_GT(count_answers(icosphere(3), "proof", 64, kRays).certain_blocked, kRays / 20);
  EXPECT_GT(count_answers(pierced(icosphere(3), 4, 0.01), "proof", 64, kRays).certain_blocked, kRays / 20);
}

/// A field that had learned the cards as if they were solid would be wrong where light passes their holes.
TEST(Cutout, FieldsLearnHoles) {
  const mesh::Scene scene = scene_of({bush(1, 12, {disc(37, mesh::Wrap::clamp)})});
  bake::BakeOptions options = quick("segment", 48);
  options.effort = 1;
  options.evaluation_rays = 20'000;
  const bake::SetAccuracies sets = bake_quietly(scene, options).objects[0].sets;
  mesh::Scene cards = scene;
  cards.meshes[0].holes.clear();
  cards.meshes[0].alpha.clear();
  const bake::Prepared with = bake::prepare(scene.meshes[0]), without = bake::prepare(cards.meshes[0]);
  const bake::GroundTruth truth(with), solid(without);
  for (const bake::RaySet set : {bake::RaySet::outer_lines, bake::RaySet::inner_surface}) {
    const bake::RaysWithTruth rays = bake::make_ray_set(truth.source(), set, 20'000, 3);
    uint32_t differ = 0;
    for (size_t i = 0; i < rays.segments.size(); ++i)
      differ += (rays.visible[i] == 0) != solid.source().embree.occluded(rays.segments[i]);
    const double as_solid = double(differ) / double(rays.segments.size());
    EXPECT_GT(as_solid, 0.01);
    EXPECT_LT(sets[size_t(set)].error(), as_solid / 2) << bake::name_of(set);
    EXPECT_EQ(sets[size_t(set)].certain_wrong, 0u);
  }
}

TEST(Cutout, TheSameMeshGivesTheSameBytes) {
  const mesh::Scene scene =
      scene_of({bush(3, 100, {disc(20, mesh::Wrap::mirror), disc(9, mesh::Wrap::clamp)})});
  const auto bytes = [&] { return format::encode(bake_quietly(scene, options_of("auto")).asset); };
  EXPECT_EQ(bytes(), bytes());
}

}  // namespace
}  // namespace nif::test
