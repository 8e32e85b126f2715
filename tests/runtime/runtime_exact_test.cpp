// Scenes of `exact` objects answer like the same scenes of `bvh` objects, in every bit and under any
// transform.
#include <array>

#include "tests/runtime/runtime_fixture.hpp"
#include "tests/support/query_object.hpp"

namespace nif::test {
namespace {

class TwinObjects : public RuntimeTest, public testing::WithParamInterface<const char*> {
 protected:
  void SetUp() override {
    if (nifNewDevice(GetParam(), nullptr, &device_) == NIF_ERROR_NOT_AVAILABLE)
      GTEST_SKIP() << nifGetErrorMessage();
  }

  NifAsset load_bytes(const std::vector<std::byte>& bytes) {
    NifAsset asset = nullptr;
    EXPECT_EQ(nifLoadAssetMemory(device_, bytes.data(), bytes.size(), NIF_LOAD_COPY, &asset), NIF_OK);
    assets_.push_back(asset);
    return asset;
  }
};

INSTANTIATE_TEST_SUITE_P(Each, TwinObjects,
                         testing::Values("isa=scalar", "isa=sse4", "isa=avx2", "isa=avx512", "isa=neon",
                                         "threads=3", "memory=least"),
                         [](const auto& p) {
                           const std::string name = p.param;
                           return name.starts_with("isa=") ? name.substr(4) : name.substr(0, name.find('='));
                         });

/// Scales, mirrors, shears and moves, from a little to so much that nothing can be proven any more.
std::array<float, 12> any_transform(Random& random) {
  std::array<float, 12> transform = kIdentity;
  const float scale = std::exp2(random.between(-6.0f, 6.0f)), shear = random.below(3) ? 0.5f : 20.0f;
  for (size_t row = 0; row < 3; ++row)
    for (size_t k = 0; k < 4; ++k)
      transform[4 * row + k] = k == 3     ? random.between(-8.0f, 8.0f)
                               : row == k ? (random.below(4) ? scale : -scale) * random.between(0.3f, 3.0f)
                                          : scale * random.between(-shear, shear);
  return transform;
}

TEST_P(TwinObjects, AnswerAlikeThroughAnyTransform) {
  uint64_t proven = 0, blocked = 0, rays_asked = 0;
  for (uint64_t seed = 0; seed < 12; ++seed) {
    format::Asset exact = random_asset(seed, {.objects = 0, .instances = 0, .exacts = 3});
    format::Asset bvhs = exact;
    for (format::Object& object : bvhs.objects) object.planes.reset();
    const std::vector<std::byte> file = format::encode(exact);
    const format::AssetView view = format::read_asset(file, "exact");
    const NifAsset planes = load_bytes(file), triangles = load_bytes(format::encode(bvhs));
    Random random(seed);
    const NifScene first = new_scene(), second = new_scene();
    const uint32_t instances = seed % 3 == 0 ? 1 : 1 + random.below(12);
    std::vector<std::array<float, 12>> placed;
    std::vector<uint32_t> objects;
    for (uint32_t i = 0; i < instances; ++i) {
      placed.push_back(any_transform(random));
      objects.push_back(random.below(3));
      const NifError error = nifAddInstance(first, planes, objects.back(), placed.back().data(), nullptr);
      ASSERT_EQ(nifAddInstance(second, triangles, objects.back(), placed.back().data(), nullptr), error);
      if (error == NIF_OK) continue;
      placed.pop_back();
      objects.pop_back();
    }
    if (placed.empty()) continue;
    ASSERT_EQ(nifCommitScene(first), NIF_OK);
    ASSERT_EQ(nifCommitScene(second), NIF_OK);
    std::vector<NifRay> rays;
    while (rays.size() < 3000) {  // near an object in its own space, then transformed to the world
      const uint32_t i = random.below(uint32_t(placed.size()));
      kernels::Segment ray = random_segment(random, view.objects[objects[i]]);
      if (random.below(16) == 0)
        for (float& x : ray.origin) x *= std::exp2(random.between(3.0f, 20.0f));
      kernels::Segment world = ray;
      for (size_t row = 0; row < 3; ++row) {
        const float* m = &placed[i][4 * row];
        world.origin[row] = m[0] * ray.origin[0] + m[1] * ray.origin[1] + m[2] * ray.origin[2] + m[3];
        world.direction[row] = m[0] * ray.direction[0] + m[1] * ray.direction[1] + m[2] * ray.direction[2];
      }
      rays.push_back(to_ray(world));
    }
    const Answers ours = query_all(first, rays), expected = query_all(second, rays);
    ASSERT_TRUE(ours == expected) << "seed " << seed;
    rays_asked += rays.size();
    for (size_t i = 0; i < rays.size(); ++i) {
      proven += ours.certain[i];
      blocked += !ours.visible[i];
    }
  }
  EXPECT_GT(blocked, rays_asked / 20);
  EXPECT_GT(proven, rays_asked / 4);
  EXPECT_LT(proven, rays_asked);
}

}  // namespace
}  // namespace nif::test
