// Every instruction set gives the reference's bits for any batch.
#include <cmath>
#include <cstring>

#include "tests/runtime/runtime_fixture.hpp"
#include "tests/support/row_of_voxels.hpp"

namespace nif::test {
namespace {

constexpr const char* kIsas[] = {"scalar",
                                 "sse4",
                                 "avx2",
                                 "avx512",
                                 "neon",
                                 "sse4,memory=least",
                                 "avx2,memory=least",
                                 "avx512,memory=least",
                                 "neon,memory=least"};

/// Tests with a device of the instruction set, and tables of either form; skipped if the machine does not
/// have it.
class IsaTest : public RuntimeTest, public testing::WithParamInterface<const char*> {
 protected:
  void SetUp() override {
    const NifError error = nifNewDevice((std::string("isa=") + GetParam()).c_str(), nullptr, &device_);
    if (error == NIF_ERROR_NOT_AVAILABLE) GTEST_SKIP() << nifGetErrorMessage();
    ASSERT_EQ(error, NIF_OK);
  }

  static void expect_reference(const kernels::SegmentField& field, const std::vector<NifRay>& rays,
                               const Answers& answers) {
    for (size_t i = 0; i < rays.size(); ++i) {
      const kernels::Answer expected = kernels::query(field, to_segment(rays[i]));
      ASSERT_EQ(answers.logit[i], expected.logit) << "ray " << i;
      ASSERT_EQ(answers.certain[i], expected.certain) << "ray " << i;
      ASSERT_EQ(answers.visible[i], expected.visible) << "ray " << i;
    }
  }

  void ask_random_fields(uint64_t first, uint64_t end);
  void ask_two_features(uint64_t first, uint64_t end);
};

INSTANTIATE_TEST_SUITE_P(Each, IsaTest, testing::ValuesIn(kIsas), [](const auto& p) {
  const std::string name = p.param;
  const size_t comma = name.find(',');
  return comma == std::string::npos ? name : name.substr(0, comma) + "_least";
});

void IsaTest::ask_random_fields(uint64_t first, uint64_t end) {
  for (uint64_t seed = first; seed < end; ++seed) {
    const format::AssetView& view =
        make(seed, {.objects = 3, .instances = 0, .max_voxels = seed % 2 ? 14u : 40u});
    const NifAsset asset = load();
    Random random(seed);
    for (uint32_t object = 0; object < 3; ++object) {
      const kernels::SegmentField& field = view.objects[object].as<kernels::SegmentField>();
      const auto rays = random_rays(random, field, 3000);
      expect_reference(field, rays, query_all(scene_of(asset, object), rays));
    }
  }
}

TEST_P(IsaTest, RandomFields) { ask_random_fields(0, 8); }
TEST_P(IsaTest, ManyRandomFields) { ask_random_fields(8, 40); }

/// Objects with two features per corner have their own kernels, whose tables replace the asset's bytes;
/// unless there are features where no baker would put them.
void IsaTest::ask_two_features(uint64_t first, uint64_t end) {
  for (const bool odd_corners : {false, true}) {
    for (uint64_t seed = first; seed < end; ++seed) {
      const format::AssetView& view = make(seed, {.objects = 2,
                                                  .instances = 0,
                                                  .max_voxels = seed % 2 ? 14u : 40u,
                                                  .features = 2,
                                                  .odd_corners = odd_corners});
      const NifAsset asset = load();
      Random random(seed);
      for (uint32_t object = 0; object < 2; ++object) {
        const kernels::SegmentField& field = view.objects[object].as<kernels::SegmentField>();
        const auto rays = random_rays(random, field, 3000);
        const NifScene scene = scene_of(asset, object);
        const Answers answers = query_all(scene, rays);
        expect_reference(field, rays, answers);
        // One by one, as the reference answers them from the kernels' tables.
        for (size_t i = 0; i < rays.size(); i += 7) {
          const Answers one = query_all(scene, {rays[i]});
          ASSERT_EQ(one.logit[0], answers.logit[i]) << "ray " << i;
          ASSERT_EQ(one.probability[0], answers.probability[i]) << "ray " << i;
        }
        for (size_t i = 0; i < rays.size(); ++i) {
          if (answers.certain[i]) continue;
          const auto [scale, threshold] =
              view.objects[object].as<kernels::SegmentField>().network.calibration;
          const double log_odds = double(answers.logit[i] + threshold) * scale;
          ASSERT_NEAR(answers.probability[i], 1 / (1 + std::exp(-log_odds)), 1e-5) << "ray " << i;
        }
      }
    }
  }
}

TEST_P(IsaTest, TwoFeatures) { ask_two_features(0, 6); }
TEST_P(IsaTest, TwoFeaturesOfManyFields) { ask_two_features(6, 30); }

/// Origins and ends on planes and corners of voxels and cells, directions along axes and diagonals: every
/// kind of tie.
TEST_P(IsaTest, RaysThroughPlanesAndCorners) {
  for (uint64_t seed = 0; seed < 40; ++seed) {
    const format::AssetView& view = make(seed, {.objects = 1, .instances = 0, .max_voxels = 30});
    const NifScene scene = scene_of(load(), 0);
    const kernels::SegmentField& field = view.objects[0].as<kernels::SegmentField>();
    Random random(seed);
    std::vector<NifRay> rays(4000);
    for (NifRay& ray : rays) {
      const float half = random.below(2) ? 0.5f : 1.0f;
      const float per_unit = random.below(2) ? field.cells_per_unit : field.voxels_per_unit;
      for (size_t a = 0; a < 3; ++a) {
        const auto size = int32_t(float(field.voxels[a]) / field.voxels_per_unit * per_unit);
        ray.origin[a] = field.origin[a] + float(random.between(-2, size + 2)) * half / per_unit;
        ray.direction[a] = float(random.between(-2, 2)) * (random.below(8) ? 1.0f : 1e-13f);
      }
      ray.tmin = random.below(3) ? 0.0f : -INFINITY;
      ray.tmax = random.below(3) ? INFINITY : float(random.between(0, 20)) / field.voxels_per_unit;
    }
    expect_reference(field, rays, query_all(scene, rays));
  }
}

/// Rays along a row of voxels in which every other one is open: more ends of intervals than kernels have room
/// for, for one ray and for all.
TEST_P(IsaTest, ManyIntervals) {
  Random random(1);
  file_ = format::encode(asset_of_a_row(1));
  view_ = std::make_unique<format::AssetView>(format::read_asset(file_, "file"));
  const kernels::SegmentField& field = view_->objects[0].as<kernels::SegmentField>();

  const auto traversal = std::make_unique<kernels::FullTraversal>();
  const std::vector<NifRay> rays = rays_in_a_row(random, field, 6000);
  size_t few = 0, many = 0, turns = 0;
  for (const NifRay& ray : rays) {
    kernels::traverse_segment(field, to_segment(ray), *traversal);
    if (traversal->verdict == kernels::Verdict::open) ++(traversal->interval_count <= 32 ? few : many);
    turns += 2 * traversal->interval_count;
  }
  EXPECT_GT(few, rays.size() / 4);
  EXPECT_GT(many, rays.size() / 4);
  EXPECT_GT(turns, 20 * rays.size());
  expect_reference(field, rays, query_all(scene_of(load(), 0), rays));
}

TEST_P(IsaTest, InvalidRays) {
  const float odd[] = {NAN,    INFINITY, -INFINITY, 0.0f,  -0.0f, 1e-45f,
                       1e-30f, 3e38f,    -3e38f,    1e20f, 1.0f,  0.5f};
  const format::AssetView& view = make(5, {.objects = 1, .instances = 0, .max_voxels = 14});
  const NifScene scene = scene_of(load(), 0);
  Random random(1);
  auto rays = random_rays(random, view.objects[0].as<kernels::SegmentField>(), 20000);
  for (NifRay& ray : rays) {
    float* members[] = {&ray.origin[0],    &ray.origin[1],    &ray.origin[2],    &ray.tmin,
                        &ray.direction[0], &ray.direction[1], &ray.direction[2], &ray.tmax};
    for (uint32_t k = random.below(4); k > 0; --k)
      *members[random.below(8)] = odd[random.below(std::size(odd))];
  }
  expect_reference(view.objects[0].as<kernels::SegmentField>(), rays, query_all(scene, rays));
}

TEST_P(IsaTest, AnyBatchAndAlignment) {
  const format::AssetView& view = make(7, {.objects = 1, .instances = 0, .max_voxels = 30});
  const NifScene scene = scene_of(load(), 0);
  Random random(7);
  const auto rays = random_rays(random, view.objects[0].as<kernels::SegmentField>(), 2600);
  const Answers whole = query_all(scene, rays);
  for (const size_t count : {1, 2, 3, 4, 5, 8, 15, 16, 17, 31, 63, 65, 127, 1023, 1024, 1025, 2049, 2600}) {
    // Misaligned by one byte, in structures of an odd size.
    constexpr size_t kStride = sizeof(NifRay) + 3;
    std::vector<char> bytes(count * kStride + 1);
    for (size_t i = 0; i < count; ++i) std::memcpy(bytes.data() + 1 + i * kStride, &rays[i], sizeof(NifRay));
    const auto member = [&](size_t offset) {
      return reinterpret_cast<const float*>(bytes.data() + 1 + offset);
    };
    NifRays query = nifMakeRays(rays.data(), count);
    for (size_t a = 0; a < 3; ++a) {
      query.origin[a] = member(offsetof(NifRay, origin) + 4 * a);
      query.direction[a] = member(offsetof(NifRay, direction) + 4 * a);
    }
    query.tmin = member(offsetof(NifRay, tmin));
    query.tmax = member(offsetof(NifRay, tmax));
    query.origin_stride = query.direction_stride = query.tmin_stride = query.tmax_stride = kStride;
    Answers answers(count);
    const NifAnswers outputs = answers.outputs();
    ASSERT_EQ(nifQuery(scene, &query, &outputs), NIF_OK);
    for (size_t i = 0; i < count; ++i) {
      ASSERT_EQ(answers.logit[i], whole.logit[i]) << count;
      ASSERT_EQ(answers.certain[i], whole.certain[i]) << count;
    }
  }
}

}  // namespace
}  // namespace nif::test
