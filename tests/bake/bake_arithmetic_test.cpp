// At the limits of the arithmetic, certain answers are the same in every encoding, with every instruction
// set, for one ray and for many.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "bake/ground_truth/prepare.hpp"
#include "formats/nif/writer.hpp"
#include "nif/nif.hpp"
#include "tests/bake/quiet_bake.hpp"
#include "tests/support/test_shapes.hpp"

namespace nif::test {
namespace {

constexpr const char* kConfigs[] = {"isa=scalar", "isa=sse4", "isa=avx2", "isa=avx512"};

struct Said {
  uint8_t visible, certain, hit, hit_certain;
  float t;
};

/// The answers of the baked mesh to the ray: by each available instruction set, for one ray and for forty.
std::vector<Said> ask(const mesh::Mesh& mesh, const std::string& encoding, uint32_t resolution,
                      const NifRay& ray, const float* transform = nullptr) {
  bake::BakeOptions options;
  options.encoding = encoding;
  options.evaluation_rays = 0;
  if (resolution) options.resolution = resolution;
  const std::vector<std::byte> file = format::encode(bake_quietly(scene_of({mesh}), options).asset);
  std::vector<Said> all;
  for (const char* config : kConfigs) {
    std::optional<nifkit::Device> device;
    try {
      device.emplace(config);
    } catch (const nifkit::Error& error) {
      EXPECT_EQ(error.code(), NIF_ERROR_NOT_AVAILABLE) << error.what();
      continue;
    }
    const nifkit::Asset asset = nifkit::Asset::load(*device, file);
    nifkit::Scene scene(*device);
    nifkit::check(nifAddAsset(scene.get(), asset.get(), transform, nullptr, nullptr));
    scene.commit();
    for (const size_t count : {1, 40}) {
      const std::vector<NifRay> rays(count, ray);
      std::vector<uint8_t> visible(count), certain(count), hit(count), hit_certain(count);
      std::vector<float> t(count);
      scene.query(rays, nifkit::Answers().visible(visible).certain(certain));
      const NifRays query = nifMakeRays(rays.data(), count);
      auto hits = nifkit::sized<NifHits>();
      hits.hit = hit.data(), hits.certain = hit_certain.data(), hits.t = t.data();
      nifkit::check(nifIntersect(scene.get(), &query, &hits));
      for (size_t i = 0; i < count; ++i)
        all.push_back({visible[i], certain[i], hit[i], hit_certain[i], t[i]});
    }
  }
  return all;
}

/// Rounding once put `t` far from the triangle, where the planes prove that there is none.
TEST(Arithmetic, ATriangleSeenEdgeOnIsWhereItIs) {
  const mesh::Mesh mesh{"sheet", {{32, -79, 31}, {66, 56, -78}, {58, 13, -52}}, {{0, 1, 2}}};
  NifRay ray{{45.0625f, 174.75f, -17.21875f}, 0, {-4, -117, 16}, 4};  // within from t = 1.9965 to 2.0179
  for (const char* encoding : {"bvh", "exact"})
    for (const Said& said : ask(mesh, encoding, encoding[0] == 'b' ? 0 : 32, ray)) {
      if (!said.hit) continue;
      EXPECT_NEAR(said.t, 2.0072f, 0.0108f) << encoding;
      EXPECT_FALSE(said.visible) << encoding;
    }
  ray.tmax = 1.5f;
  for (const char* encoding : {"bvh", "exact", "proof"})
    for (const Said& said : ask(mesh, encoding, encoding[0] == 'b' ? 0 : 32, ray)) {
      EXPECT_TRUE(said.visible && said.certain) << encoding;
      EXPECT_FALSE(said.hit) << encoding;
    }
}

/// Corner 1 lies on the edge from 0 to 2. A sliver closes the seam that rounding would open.
TEST(Arithmetic, ASeamLetsNothingThrough) {
  mesh::Mesh mesh{
      "seam",
      {{433, -500, -372}, {544, -410, -333}, {729, -260, -268}, {611, -266, -336}, {547, -495, -307}},
      {{0, 2, 3}, {1, 0, 4}, {2, 1, 4}, {0, 1, 2}}};
  const bake::Prepared prepared = bake::prepare(mesh);
  ASSERT_EQ(prepared.surface.slivers.size(), 1u);
  ASSERT_EQ(prepared.surface.sliver_numbers, std::vector<uint32_t>{3});
  const NifRay ray{{0x1.e178p+8f, -0x1.a03p+8f, -0x1.0164p+9f}, 0, {0x1.6p+4f, 0x1.8p+1f, 0x1.e8p+5f}, 6};
  for (const char* encoding : {"bvh", "exact", "proof"})
    for (const Said& said : ask(mesh, encoding, encoding[0] == 'b' ? 0 : 64, ray)) {
      EXPECT_TRUE(!said.visible && said.certain) << encoding;
      EXPECT_TRUE(said.hit && said.hit_certain) << encoding;
    }

  // Points on no triangle close nothing, but one may lie on another point that does.
  mesh.positions.insert(mesh.positions.end(), {{9, 9, 9}, {10, 10, 10}, {12, 12, 12}, {470, -470, -359}});
  mesh.triangles.insert(mesh.triangles.end(), {{5, 6, 7}, {7, 6, 5}});
  EXPECT_EQ(bake::prepare(mesh).surface.sliver_numbers, std::vector<uint32_t>{3});
  const mesh::Mesh chain{"chain",
                         {{0, 0, 0}, {8, 0, 0}, {0, 8, 0}, {4, 0, 0}, {2, 0, 0}, {1, 0, 0}},
                         {{0, 5, 4}, {0, 1, 2}, {0, 4, 3}, {1, 0, 3}}};
  EXPECT_EQ(bake::prepare(chain).surface.sliver_numbers, (std::vector<uint32_t>{0, 2, 3}));
}

/// A mesh far from the origin of its space is moved by rounding if it is skewed about that origin.
TEST(Arithmetic, NothingIsCertainFarFromTheOriginOfASkewedMesh) {
  const mesh::Mesh mesh{"far",
                        {{590, 590, 1004.02067f},
                         {600, 590, 1004.02067f},
                         {600, 600, 1004.02067f},
                         {590, 600, 1004.02067f},
                         {590, 590, 1003},
                         {590.1f, 590, 1003},
                         {590, 590.1f, 1003},
                         {590, 590, 1005},
                         {590.1f, 590, 1005},
                         {590, 590.1f, 1005}},
                        {{0, 1, 2}, {0, 2, 3}, {4, 5, 6}, {7, 8, 9}}};
  const float skew[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0x1.0211a8p+1f, 0x1.0211a8p+1f, -0x1.f35ffcp-1f, 0};
  // These rays end beyond the sheet, but were once certainly visible.
  const NifRay rays[] = {
      {{0, 0, -0x1.b9ac2ap-2f}, 0, {0x1.26c346p-1f, 0x1.28fccap-1f, 0x1.605f78p+0f}, 0x1.009324p+10f},
      {{0, 0, 0x1.d788e8p-1f}, 0, {0x1.2a1f0ap-1f, 0x1.287eaep-1f, 0x1.61c46p+0f}, 0x1.febb48p+9f},
      {{0, 0, -0x1.d0b3b4p-1f}, 0, {0x1.2bf52cp-1f, 0x1.2a3688p-1f, 0x1.65dba6p+0f}, 0x1.fed59p+9f}};
  for (const NifRay& ray : rays)
    for (const Said& said : ask(mesh, "proof", 160, ray, skew)) EXPECT_FALSE(said.certain);
  for (const Said& said : ask(mesh, "proof", 160, {{595, 595, 1010}, 0, {0, 0, -1}, 20}))
    EXPECT_TRUE(!said.visible && said.certain) << "where it is not skewed";
}

/// Rays whose direction is too short in world space, but long enough in the cells of the sole object. What it
/// leaves open is listed.
TEST(Arithmetic, ListsOpenRaysWithShortDirections) {
  bake::BakeOptions options;
  options.encoding = "proof";
  options.resolution = 64;
  options.evaluation_rays = 0;
  const std::vector<std::byte> file = format::encode(bake_quietly(scene_of({icosphere(2)}), options).asset);
  const nifkit::Device device;
  nifkit::Scene scene(device);
  scene.add_asset(nifkit::Asset::load(device, file));
  scene.commit();
  constexpr uint32_t kRays = 1000;
  std::vector<uint32_t> listed[2];
  for (const bool slow : {false, true}) {
    const float by = slow ? 0x1p-61f : 1;  // exact
    nif::Random random(1, 0, 0);
    std::vector<NifRay> rays(kRays);
    for (NifRay& ray : rays) {  // at the silhouette, where much is open
      const float angle = float(random.uniform() * 6.28);
      ray = {{0.985f * std::cos(angle), 0.985f * std::sin(angle), -2}, 0, {0, 0, by}, 4 / by};
    }
    std::vector<uint8_t> certain(kRays);
    std::vector<float> tmin(kRays), tmax(kRays);
    listed[slow].resize(kRays);
    uint32_t count = 0;
    auto open = nifkit::sized<NifOpenRays>();
    open.capacity = kRays;
    open.rays = listed[slow].data(), open.tmin = tmin.data(), open.tmax = tmax.data(), open.count = &count;
    scene.query_open(rays, nifkit::Answers().certain(certain), open);
    listed[slow].resize(count);
    std::ranges::sort(listed[slow]);
    EXPECT_EQ(uint64_t(count), uint64_t(std::ranges::count(certain, 0)));
  }
  EXPECT_GT(listed[0].size(), 50u);
  EXPECT_EQ(listed[0], listed[1]);
}

}  // namespace
}  // namespace nif::test
