// 100,000 rays of every named set through a scene of all encodings, whose instances are mirrored, stretched
// and lie in each other: answered by the GPU module with an emulated GPU as by the reference, both by the
// pipeline and by the one kernel. And what proofs leave open of as many, and the first hits of as many.
// NIF_TEST_SEGMENTS says how many rays instead.
#include <tbb/parallel_for.h>

#include "tests/gpu/baked.hpp"
#include "tests/gpu/gpu_hit_query.hpp"
#include "tests/gpu/gpu_open_query.hpp"
#include "tests/support/test_shapes.hpp"

namespace nif::test {
namespace {

constexpr size_t kPart = 20'011;

class GpuSceneSets : public GpuModuleTest, public testing::WithParamInterface<const char*> {};
INSTANTIATE_TEST_SUITE_P(Each, GpuSceneSets, testing::Values("on", "off"),
                         [](const auto& p) { return std::string("pipeline_") + p.param; });

/// By all outputs, or by what is visible alone, which other kernels answer. Thread-safe.
void expect_part(const TwinScenes& twins, std::span<const kernels::Segment> segments, bool all) {
  std::vector<NifRay> rays;
  for (const kernels::Segment& segment : segments) rays.push_back(to_ray(segment));
  if (all) return expect_same(query_all(twins.gpu(), rays), query_all(twins.cpu(), rays));
  std::vector<uint8_t> got(rays.size(), 7), expected(rays.size(), 8);
  query_visible(twins.gpu(), rays, got);
  query_visible(twins.cpu(), rays, expected);
  EXPECT_EQ(got, expected);
}

/// Calls part(segments, number of the part) for rays of every set that are drawn around a mesh.
template <class Part>
void for_each_part(const mesh::Mesh& mesh, const Part& part) {
  const bake::Prepared prepared = bake::prepare(mesh);
  const bake::GroundTruth truth(prepared);
  const size_t wanted = rays_of_set();
  for (const bake::RaySet set : bake::kRaySets) {
    const bake::RaysWithTruth drawn = bake::make_ray_set(truth.source(), set, wanted, 7);
    ASSERT_EQ(drawn.segments.size(), wanted) << bake::name_of(set);
    const std::span<const kernels::Segment> segments(drawn.segments);
    tbb::parallel_for(size_t{0}, wanted / kPart + 1, [&](size_t number) {
      const size_t first = number * kPart;
      part(segments.subspan(first, std::min(kPart, wanted - first)), number);
    });
  }
}

TEST_P(GpuSceneSets, AnswerAsTheReference) {
  const Baked field(torus(60, 30), "segment"), bvh(torus(60, 30), "bvh"), exact(torus(60, 30), "exact"),
      proof(torus(60, 30), "proof");
  TwinScenes twins(config() + ",pipeline=" + GetParam());
  const uint32_t learned = twins.load(field.file), proven = twins.load(bvh.file),
                 whole = twins.load(exact.file), proves = twins.load(proof.file),
                 spherical = twins.load(random_asset(1, {.objects = 0, .sphericals = 1}));
  // As it is; mirrored and half inside it; stretched across it; small turned ones; a spherical one beside.
  twins.add(learned, 0, kIdentity);
  twins.add(learned, 0, {-0.9f, 0, 0, 0.4f, 0, 0.8f, 0, 0.1f, 0, 0, 1.1f, 0.2f});
  twins.add(proven, 0, {1.2f, 0.3f, 0, -0.5f, -0.3f, 0.4f, 0, 0.3f, 0, 0, 2.0f, -0.1f});
  twins.add(learned, 0, {0.2f, 0, 0.2f, 0, 0, -0.3f, 0, 0, -0.2f, 0, 0.2f, 0.5f});
  twins.add(proven, 0, {0.1f, 0, 0, -0.6f, 0, 0.1f, 0, 0.6f, 0, 0, 0.1f, 0});
  twins.add(whole, 0, {0, 0.2f, 0, 0.5f, -0.2f, 0, 0, 0.4f, 0, 0, 0.2f, 0.3f});
  twins.add(proves, 0, {0.2f, 0, 0, 0.3f, 0, 0, 0.2f, -0.5f, 0, -0.2f, 0, -0.3f});
  twins.add(spherical, 0, {0.1f, 0, 0, 0.7f, 0, 0.1f, 0, -0.4f, 0, 0, 0.1f, 0.1f});
  twins.commit();

  for_each_part(field.scene.meshes[0], [&](std::span<const kernels::Segment> segments, size_t number) {
    expect_part(twins, segments, number % 2 == 0);
  });
}

/// What proofs leave open, of objects with proofs of their own and without: the same rays with the same bits.
TEST_F(GpuModuleTest, ListTheOpenRaysOfEverySetAsTheReference) {
  const Baked proof(torus(60, 30), "proof");
  const Baked exact(torus(60, 30), "exact");
  const Baked field(torus(60, 30), "segment");
  TwinScenes alone(config()), several(config());
  alone.add(alone.load(proof.file), 0, kIdentity);
  const uint32_t proves = several.load(proof.file), whole = several.load(exact.file),
                 learned = several.load(field.file);
  several.add(proves, 0, kIdentity);
  several.add(proves, 0, {-0.9f, 0, 0, 0.4f, 0, 0.8f, 0, 0.1f, 0, 0, 1.1f, 0.2f});
  several.add(whole, 0, {1.2f, 0.3f, 0, -0.5f, -0.3f, 0.4f, 0, 0.3f, 0, 0, 2.0f, -0.1f});
  several.add(learned, 0, {0.2f, 0, 0.2f, 0, 0, -0.3f, 0, 0, -0.2f, 0, 0.2f, 0.5f});
  alone.commit();
  several.commit();
  for (const TwinScenes* twins : {&alone, &several}) {
    std::atomic<uint64_t> open = 0;
    for_each_part(proof.scene.meshes[0], [&](std::span<const kernels::Segment> segments, size_t) {
      std::vector<NifRay> rays;
      for (const kernels::Segment& segment : segments) rays.push_back(to_ray(segment));
      const OpenAnswers expected = query_open(twins->cpu(), rays, rays.size()),
                        got = query_open_on_gpu(machine(), 0, twins->gpu(), rays, rays.size());
      expect_same(got, expected);
      EXPECT_TRUE(got.open == expected.open);
      open += expected.open.size();
    });
    EXPECT_GT(open, rays_of_set() / 100) << "too few to compare";
  }
}

/// First hits of every set, in every bit of every output: of single objects, and of a scene.
TEST_F(GpuModuleTest, FindTheFirstHitsOfEverySetAsTheReference) {
  const Baked field(torus(60, 30), "segment"), exact(torus(200, 100), "exact"), bvh(torus(200, 100), "bvh"),
      proof(torus(60, 30), "proof");
  std::vector<std::unique_ptr<TwinScenes>> scenes;
  for (const Baked* object : {&field, &exact, &bvh}) {
    scenes.push_back(std::make_unique<TwinScenes>(config()));
    scenes.back()->add(scenes.back()->load(object->file), 0, kIdentity);
  }
  TwinScenes& several = *scenes.emplace_back(std::make_unique<TwinScenes>(config()));
  const uint32_t learned = several.load(field.file), whole = several.load(exact.file),
                 triangles = several.load(bvh.file), proves = several.load(proof.file);
  several.add(learned, 0, kIdentity);
  several.add(learned, 0, {-0.9f, 0, 0, 0.4f, 0, 0.8f, 0, 0.1f, 0, 0, 1.1f, 0.2f});
  several.add(whole, 0, {1.2f, 0.3f, 0, -0.5f, -0.3f, 0.4f, 0, 0.3f, 0, 0, 2.0f, -0.1f});
  several.add(proves, 0, {0.2f, 0, 0.2f, 0, 0, -0.3f, 0, 0, -0.2f, 0, 0.2f, 0.5f});
  several.add(triangles, 0, {0.1f, 0, 0, -0.6f, 0, 0.1f, 0, 0.6f, 0, 0, 0.1f, 0});
  for (const std::unique_ptr<TwinScenes>& twins : scenes) {
    twins->commit();
    std::atomic<uint64_t> different = 0, met = 0;
    for_each_part(field.scene.meshes[0], [&](std::span<const kernels::Segment> segments, size_t) {
      std::vector<NifRay> rays;
      for (const kernels::Segment& segment : segments) rays.push_back(to_ray(segment));
      const FirstHits expected = intersect_all(twins->cpu(), rays),
                      got = intersect_on_gpu(machine(), 0, twins->gpu(), rays);
      different += count_different_hits(got, expected);
      met += uint64_t(std::count(expected.hit.begin(), expected.hit.end(), 1));
    });
    EXPECT_EQ(different, 0u);
    EXPECT_GT(met, rays_of_set());
  }
}

}  // namespace
}  // namespace nif::test
