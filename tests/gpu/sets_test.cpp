// A million rays of every named set, answered by the kernels in the emulator as by the reference: for a baked
// field by the pipeline, with the matrix instructions of each target in turn, and for a baked BVH; fewer for
// a field by the one kernel. tests/gpu/emulate.sh asks every variant, on any asset.
#include <gtest/gtest.h>

#include "tests/gpu/baked.hpp"
#include "tests/gpu/compare_sets.hpp"
#include "tests/support/shapes.hpp"

namespace nif::test {
namespace {

constexpr uint64_t kRays = 1'000'000, kFewerRays = 100'000;

void expect_equal(const Baked& baked, uint64_t count, const std::vector<KernelVariant>& variants) {
  const bake::Prepared prepared = bake::prepare(baked.scene.meshes[0]);
  const bake::GroundTruth truth(prepared);
  size_t next = 0;
  for (const bake::RaySet set : bake::kRaySets) {
    const bake::LabelledRays rays = bake::make_ray_set(truth.source(), set, count, 7);
    ASSERT_EQ(rays.segments.size(), count) << bake::name_of(set);
    const KernelVariant variant = variants[next++ % variants.size()];
    EXPECT_EQ(compare(baked.view.objects[0], rays.segments, variant).different, 0u)
        << bake::name_of(set) << " by " << variant.name();
  }
}

TEST(GpuSets, FieldsAnswerAsTheReference) {
  const Baked baked(torus(60, 30), bake::EncodingOption::segment);
  expect_equal(baked, kRays,
               {{false, MatrixKind::imma},
                {false, MatrixKind::wmma},
                {false, MatrixKind::mfma16},
                {false, MatrixKind::mfma32},
                {false, MatrixKind::dot32}});
  expect_equal(baked, kFewerRays, {{true, MatrixKind::dot32}});
}

TEST(GpuSets, BvhsAnswerAsTheReference) {
  expect_equal(Baked(torus(200, 100), bake::EncodingOption::bvh), kRays,
               {{true, MatrixKind::dot32}, {true, MatrixKind::dot64}});
}

}  // namespace
}  // namespace nif::test
