// kernels/shader/nif.metal compiled as C++, with what it uses of Metal's standard library from tests/shader/metal, and run on the
// CPU: planes and networks give the bits of nifQuery, and what is certain about triangles is the same. No compiler of Apple's
// has seen the text.
#include <gtest/gtest.h>
#include <nif/nif.hpp>

#include <bit>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <map>
#include <vector>

#include "formats/nif/reader.hpp"
#include "formats/nif/writer.hpp"
#include "tests/golden/golden.hpp"
#include "tests/runtime/open_answers.hpp"
#include "tests/support/query_object.hpp"
#include "tests/support/random_asset.hpp"
#include "tests/support/test_first_hits.hpp"

// IEEE's arithmetic: the CPU's reach.
#define NIF_PROVES true
#define NIF_CERTAIN_REACH 16384.0f
#define NIF_NETWORK_WORDS 34
#undef NIF_NONE  // nif.h's macro
#include "kernels/shader/nif.metal"
#undef device
#undef constant

namespace nif::test {
namespace {

struct Counts {
  size_t rays = 0, certain = 0, blocked = 0, different = 0, colored = 0;
  size_t wrong = 0;  ///< certain answers that are not the CPU's
};

/// Rays through a committed scene, by its own words or by those of its sole object.
class Comparison {
 public:
  Comparison(const nifkit::Scene& scene, const std::vector<uint32_t>& words, bool is_scene)
      : scene_(scene), words_(words), is_scene_(is_scene) {}

  Counts visibility(const std::vector<NifRay>& rays, uint32_t mask = 0xffffffffu) const {
    std::vector<uint8_t> visible(rays.size()), certain(rays.size());
    std::vector<int32_t> logits(rays.size());
    const std::vector<uint32_t> masks(rays.size(), mask);
    NifRays asked = nifMakeRays(rays.data(), rays.size());
    asked.mask = is_scene_ ? masks.data() : nullptr;
    auto answers = nifkit::sized<NifAnswers>();
    answers.visible = visible.data();
    answers.certain = certain.data();
    answers.logit = logits.data();
    EXPECT_EQ(nifQuery(scene_.get(), &asked, &answers), NIF_OK);
    Counts found;
    for (size_t i = 0; i < rays.size(); ++i) {
      Nif nif = made();
      const float3 from = origin(rays[i]), way = direction(rays[i]);
      const NifAnswer answer = is_scene_ ? nif.nif_query_scene(0, from, way, rays[i].tmin, rays[i].tmax, mask)
                                         : nif.nif_query(0, from, way, rays[i].tmin, rays[i].tmax);
      const bool same = answer.visible == (visible[i] != 0) && answer.certain == (certain[i] != 0) &&
                        answer.logit == logits[i];
      add(found, answer.certain, visible[i] == 0, !same, answer.visible != (visible[i] != 0));
    }
    return found;
  }

  Counts first_hits(const std::vector<NifRay>& rays) const {
    FirstHits hits(rays.size());
    const NifRays asked = nifMakeRays(rays.data(), rays.size());
    const NifHits outputs = hits.outputs();
    EXPECT_EQ(nifIntersect(scene_.get(), &asked, &outputs), NIF_OK);
    Counts found;
    size_t recolored = 0;
    for (size_t i = 0; i < rays.size(); ++i) {
      Nif nif = made();
      const float3 from = origin(rays[i]), way = direction(rays[i]);
      const NifHit hit = is_scene_
                             ? nif.nif_first_hit_scene(0, from, way, rays[i].tmin, rays[i].tmax, 0xffffffffu)
                             : nif.nif_first_hit(0, from, way, rays[i].tmin, rays[i].tmax);
      const bool same = hit.hit == (hits.hit[i] != 0) &&
                        (!hit.hit || (hit.triangle == hits.triangle[i] &&
                                      std::abs(hit.t - hits.t[i]) <= 1e-3f * std::abs(hits.t[i]) + 1e-6f));
      add(found, hit.certain, hits.hit[i] != 0, !same, !same);
      if (!same || !hit.hit) continue;
      for (int a = 0; a < 3; ++a) recolored += !(std::abs(hit.color[a] - hits.color[3 * i + a]) <= 1e-5f);
      found.colored += hit.color[0] != 0.5f;
    }
    EXPECT_LE(recolored, rays.size() / 100);  // points between two voxels
    return found;
  }

 private:
  Nif made() const {
    Nif nif;
    std::memset(&nif, 0xff, sizeof(nif));  // nothing may depend on what was there
    nif.nif_words = words_.data();
    return nif;
  }
  static float3 origin(const NifRay& ray) { return {ray.origin[0], ray.origin[1], ray.origin[2]}; }
  static float3 direction(const NifRay& ray) {
    return {ray.direction[0], ray.direction[1], ray.direction[2]};
  }
  static void add(Counts& found, bool certain, bool blocked, bool different, bool other) {
    ++found.rays;
    found.certain += certain;
    found.blocked += blocked;
    found.different += different;
    found.wrong += certain && other;
  }

  const nifkit::Scene& scene_;
  const std::vector<uint32_t>& words_;
  const bool is_scene_;
};

class ShaderMetal : public testing::Test {
 protected:
  /// An object alone, in its own space.
  void compare(const nifkit::Asset& asset, uint32_t object, const std::vector<NifRay>& rays) {
    uint64_t count = 0;
    if (nifGetShaderTables(asset.get(), object, nullptr, 0, &count) != NIF_OK) return;
    const std::vector<uint32_t> words = asset.shader_tables(object);
    nifkit::Scene scene(runtime_);
    scene.add_instance(asset, object);
    scene.commit();
    const Comparison comparison(scene, words, false);
    const Counts found = comparison.visibility(rays);
    if ((words[3] & 4) != 0) {
      add(triangles_, found);
      add(hits_, comparison.first_hits(rays));
    } else {
      EXPECT_EQ(found.different, 0u) << "object " << object;
      add(planes_, found);
    }
  }
  static void add(Counts& sum, const Counts& found) {
    EXPECT_EQ(found.wrong, 0u);
    sum.rays += found.rays;
    sum.certain += found.certain;
    sum.blocked += found.blocked;
    sum.colored += found.colored;
  }

  const nifkit::Device runtime_{"shaders=on"};
  Counts planes_, triangles_, hits_;
};

TEST_F(ShaderMetal, AnswersRandomObjectsAsTheCpu) {
  for (uint64_t seed = 1; seed <= 6; ++seed) {
    const auto file = format::encode(random_asset(seed, {.objects = 2,
                                                         .instances = 6,
                                                         .bvhs = 1,
                                                         .exacts = 1,
                                                         .proofs = 1,
                                                         .features = 2,
                                                         .colors = 4,
                                                         .sources = 1}));
    const format::AssetView view = format::read_asset(file, "test");
    const nifkit::Asset asset = nifkit::Asset::load(runtime_, std::span<const std::byte>(file));
    for (uint32_t i = 0; i < view.objects.size(); ++i) {
      Random random(seed + i);
      std::vector<NifRay> rays(3000);
      for (NifRay& ray : rays) ray = to_nif_ray(random_segment(random, view.objects[i]));
      compare(asset, i, rays);
    }
  }
  for (const Counts& counts : {planes_, triangles_, hits_}) {
    EXPECT_GT(counts.rays, 10'000u);
    EXPECT_GT(counts.certain, counts.rays / 3);
    EXPECT_GT(counts.blocked, counts.rays / 20);
  }
  EXPECT_GT(hits_.colored, 500u);
}

TEST_F(ShaderMetal, AnswersGoldenRaysAsTheCpu) {
  for (const auto& entry : std::filesystem::directory_iterator(NIF_GOLDEN_FOLDER)) {
    std::filesystem::path path = entry.path();
    if (path.extension() != ".nif") continue;
    const nifkit::Asset asset = nifkit::Asset::load(runtime_, path.string());
    std::ifstream file(path.replace_extension(".answers"), std::ios::binary);
    std::map<uint32_t, std::vector<NifRay>> of_object;
    for (GoldenAnswer golden; file.read(reinterpret_cast<char*>(&golden), sizeof(golden));)
      of_object[golden.object].push_back(to_nif_ray(golden.ray));
    for (const auto& [object, rays] : of_object) compare(asset, object, rays);
  }
  EXPECT_GT(planes_.rays, 1000u);
  EXPECT_GT(triangles_.rays, 1000u);
}

TEST_F(ShaderMetal, AnswersScenesAsTheCpu) {
  Counts all, hits;
  for (uint64_t seed = 1; seed <= 6; ++seed) {
    const bool triangles = seed % 2 == 0;
    const auto file = format::encode(random_asset(
        seed, triangles
                  ? RandomAssetOptions{.objects = 0, .instances = 6, .bvhs = 1, .exacts = 1, .sources = 1}
                  : RandomAssetOptions{.objects = 2, .instances = 6, .proofs = 1, .features = 2}));
    const format::AssetView view = format::read_asset(file, "test");
    const nifkit::Asset asset = nifkit::Asset::load(runtime_, std::span<const std::byte>(file));
    nifkit::Scene scene(runtime_);
    scene.add_asset(asset);
    scene.commit();
    const std::vector<uint32_t> words = scene.shader_tables();
    const Comparison comparison(scene, words, true);
    for (const uint32_t mask : {0xffffffffu, 1u}) {
      const Counts found = comparison.visibility(rays_near(view, seed, 3000), mask);
      if (!triangles) {
        EXPECT_EQ(found.different, 0u) << "seed " << seed;
      }
      add(all, found);
    }
    if (triangles) add(hits, comparison.first_hits(rays_near(view, seed, 3000)));
  }
  EXPECT_GT(all.certain, all.rays / 5);
  EXPECT_GT(hits.certain, hits.rays / 5);
  EXPECT_GT(hits.blocked, hits.rays / 20);
}

}  // namespace
}  // namespace nif::test
