// 100,000 rays of every named set, answered by the kernels in the emulator as by the reference: for a baked
// field by the pipeline, with the matrix instructions of each target in turn, and for a baked BVH, an `exact`
// object and a `proof` object; fewer for a field by the one kernel, and for a field of the paper's kind, in
// both precisions. NIF_TEST_SEGMENTS says how many rays instead.
// tests/measure/emulate_sets.sh asks every variant, on any asset.
#include <gtest/gtest.h>

#include "tests/gpu/baked.hpp"
#include "tests/gpu/emulator/compare_half.hpp"
#include "tests/gpu/emulator/compare_sets.hpp"
#include "tests/support/test_shapes.hpp"

namespace nif::test {
namespace {

constexpr uint64_t kFewerRays = 100'000;

/// So many rays of each set, by the ways in turn.
void expect_equal(const Baked& baked, uint64_t count, const std::vector<EmulatedWay>& ways) {
  const bake::Prepared prepared = bake::prepare(baked.scene.meshes[0]);
  const bake::GroundTruth truth(prepared);
  size_t next = 0;
  for (const bake::RaySet set : bake::kRaySets) {
    const bake::RaysWithTruth rays = bake::make_ray_set(truth.source(), set, count, 7);
    ASSERT_EQ(rays.segments.size(), count) << bake::name_of(set);
    const EmulatedWay way = ways[next++ % ways.size()];
    EXPECT_EQ(count_different(baked.view.objects[0], rays.segments, way), 0u)
        << bake::name_of(set) << " by " << way.name();
  }
}

TEST(GpuSets, FieldsAnswerAsTheReference) {
  const Baked baked(torus(60, 30), "segment");
  expect_equal(baked, rays_of_set(),
               {{MatrixKind::imma},
                {MatrixKind::wmma},
                {MatrixKind::mfma16},
                {MatrixKind::mfma32},
                {MatrixKind::dot32}});
  expect_equal(baked, kFewerRays, {{MatrixKind::dot32, runtime::GpuWay::one_kernel}});
}

TEST(GpuSets, BvhsAnswerAsTheReference) {
  expect_equal(Baked(torus(200, 100), "bvh"), rays_of_set(), {{MatrixKind::dot32}, {MatrixKind::dot64}});
}

TEST(GpuSets, ExactObjectsAnswerAsTheReference) {
  expect_equal(Baked(torus(200, 100), "exact"), rays_of_set(), {{MatrixKind::dot32}, {MatrixKind::dot64}});
}

TEST(GpuSets, ProofsAnswerAsTheReference) {
  expect_equal(Baked(torus(200, 100), "proof"), rays_of_set(), {{MatrixKind::dot32}, {MatrixKind::dot64}});
}

/// In single precision to the bit; in half precision within the bound that follows from the arithmetic, with
/// hardly an answer that changes sides.
TEST(GpuSets, SphericalFieldsAnswerAsTheReference) {
  const Baked baked(torus(60, 30), "spherical");
  expect_equal(baked, kFewerRays, {{MatrixKind::dot32, runtime::GpuWay::one_kernel}, {MatrixKind::dot64}});
  const bake::Prepared prepared = bake::prepare(baked.scene.meshes[0]);
  const bake::GroundTruth truth(prepared);
  constexpr MatrixKind kKinds[] = {MatrixKind::wmma, MatrixKind::mfma32, MatrixKind::imma};
  for (const bake::RaySet set : bake::kRaySets) {
    const bake::RaysWithTruth rays = bake::make_ray_set(truth.source(), set, kFewerRays / 20, 7);
    for (const HalfComparison& half : compare_half(baked.view.objects[0].as<kernels::SphericalField>(),
                                                   rays.segments, rays.visible, kKinds)) {
      EXPECT_GT(half.asked, rays.segments.size() / 4) << bake::name_of(set);
      EXPECT_EQ(half.beyond, 0u) << bake::name_of(set);
      EXPECT_LT(half.different, rays.segments.size() / 200) << bake::name_of(set);
      EXPECT_GT(half.most_moved, 0) << bake::name_of(set);
    }
  }
}

}  // namespace
}  // namespace nif::test
