// The ground truth of a scene of instances equals that of one mesh with all their triangles.
#include "bake/ground_truth/scene_truth.hpp"

#include <gtest/gtest.h>

#include "formats/mesh/transform.hpp"
#include "tests/support/test_shapes.hpp"

namespace nif::test {
namespace {

/// Two balls and a ring: one ball stretched, the other mirrored, the ring turned.
struct SmallScene {
  mesh::Mesh ball = icosphere(3), ring = torus(24, 12);
  bake::Prepared ball_object = bake::prepare(ball), ring_object = bake::prepare(ring);
  std::vector<const bake::Prepared*> objects{&ball_object, &ring_object};
  std::vector<bake::Placed> instances{{0, {2, 0, 0, 1, 0, 0.5f, 0, 2, 0, 0, 1, 3}},
                                      {1, {0, 0.8f, 0, 4, 0, 0, 0.8f, 0, 0.8f, 0, 0, 1}},
                                      {0, {-1, 0, 0, 7, 0, 1, 0, 1, 0, 0, 1, 5}}};
  bake::SceneTruth truth{objects, instances};

  mesh::Mesh whole() const {
    mesh::Mesh all;
    for (const bake::Placed& placed : instances) {
      const bake::Prepared& object = *objects[placed.object];
      const auto base = uint32_t(all.positions.size());
      for (const mesh::Float3& p : object.surface.positions)
        all.positions.push_back(mesh::transformed(placed.transform, p));
      for (mesh::Triangle t : object.surface.triangles) {
        if (mesh::determinant(placed.transform) < 0) std::swap(t[1], t[2]);
        all.triangles.push_back({base + t[0], base + t[1], base + t[2]});
      }
    }
    return all;
  }
};

TEST(SceneTruth, IsThatOfAllTriangles) {
  const SmallScene scene;
  const mesh::Mesh whole = scene.whole();
  const bake::Prepared prepared = bake::prepare(whole);
  const bake::GroundTruth truth(prepared);
  const bake::RaySource &ours = scene.truth.source(), &theirs = truth.source();
  for (size_t a = 0; a < 3; ++a) {  // ours encloses the instances' boxes
    EXPECT_LE(ours.box.min[a], theirs.box.min[a] + 1e-5f);
    EXPECT_GE(ours.box.max[a], theirs.box.max[a] - 1e-5f);
  }
  EXPECT_TRUE(ours.has_volume);
  constexpr size_t kRays = 20'000;
  for (const bake::RaySet set : bake::kRaySets) {
    SCOPED_TRACE(bake::name_of(set));
    const bake::RaysWithTruth rays = bake::make_ray_set(ours, set, kRays, 3);
    ASSERT_GT(rays.segments.size(), kRays / 2);
    size_t different = 0, beyond_doubt = 0, occluded = 0;
    for (size_t i = 0; i < rays.segments.size(); ++i) {
      occluded += !rays.visible[i];
      if (rays.visible[i] == !theirs.embree.occluded(rays.segments[i])) continue;
      ++different;
      beyond_doubt += !ours.embree.in_doubt(rays.segments[i]);
    }
    EXPECT_LT(different, kRays / 1000);
    EXPECT_EQ(beyond_doubt, 0u);
    EXPECT_GT(occluded, kRays / 100);
  }
}

TEST(SceneTruth, HitsHaveNormalsOfTheWorldAndTheirInstance) {
  const SmallScene scene;
  const mesh::Mesh whole = scene.whole();
  const bake::EmbreeTruth flat(whole);
  const bake::RaySource& source = scene.truth.source();
  const bake::RaysWithTruth rays = bake::make_ray_set(source, bake::RaySet::outer_lines, 20'000, 5);
  size_t hits = 0, alike = 0;
  std::array<size_t, 3> of_instance{};
  for (const kernels::Segment& ray : rays.segments) {
    const auto ours = source.embree.first_hit(ray), theirs = flat.first_hit(ray);
    if (!ours || !theirs) continue;
    ++hits;
    ++of_instance.at(ours->instance);
    // A mirrored instance flips the normal, which does not matter: rays start on the viewer's side.
    const double cosine = dot(ours->normal, theirs->normal) / (length(ours->normal) * length(theirs->normal));
    alike += std::abs(cosine) > 0.9999 && std::abs(ours->t - theirs->t) < 1e-3;
  }
  EXPECT_GT(hits, 1000u);
  EXPECT_GT(double(alike), 0.999 * double(hits));  // except where two triangles meet
  for (const size_t count : of_instance) EXPECT_GT(count, 100u);
}

TEST(SceneTruth, KnowsWhatIsInside) {
  const SmallScene scene;
  const bake::InsideTest& inside = scene.truth.source().inside;
  EXPECT_TRUE(inside.inside({1, 2, 3})) << "the stretched ball's middle";
  EXPECT_TRUE(inside.inside({2.8f, 2, 3}));
  EXPECT_FALSE(inside.inside({1, 2.6f, 3}));
  EXPECT_TRUE(inside.inside({7, 1, 5})) << "the mirrored ball's middle";
  EXPECT_FALSE(inside.inside({4, 0, 1})) << "the ring's hole";
}

TEST(SceneTruth, RaysStartOffTheSurfaceByTheInstancesBias) {
  const SmallScene scene;
  const bake::RaySource& source = scene.truth.source();
  ASSERT_EQ(source.biases.size(), 3u);
  // The cube roots of the scales 1 (2 by 1/2), 0.8 and 1; a ball is 2 long, and a ring 2.8.
  EXPECT_NEAR(source.biases[0], 2e-3f, 1e-4f);
  EXPECT_NEAR(source.biases[1], 0.8f * 2.8e-3f, 1e-4f);
  EXPECT_NEAR(source.biases[2], 2e-3f, 1e-4f);
}

}  // namespace
}  // namespace nif::test
