// Triangles in shaders: every answer that a shader calls certain is the CPU's, in any arithmetic that Vulkan allows, and
// few are not certain.
#include <algorithm>
#include <cmath>

#include "formats/nif/writer.hpp"
#include "kernels/reference/reference_encodings.hpp"
#include "tests/shader/shader_fixture.hpp"
#include "tests/support/query_object.hpp"
#include "tests/support/random_asset.hpp"
#include "tests/support/test_first_hits.hpp"
#include "tests/support/test_shapes.hpp"
#include "tests/support/to_world.hpp"

namespace nif::test {
namespace {

using kernels::Segment;

/// Of rays, compared with the CPU's answers.
struct Counts {
  size_t rays = 0, certain = 0, blocked = 0, different = 0;
  size_t wrong = 0;  ///< certain answers that are not the CPU's
  void operator+=(const Counts& other) {
    rays += other.rays, certain += other.certain, blocked += other.blocked;
    different += other.different, wrong += other.wrong;
  }
};

class ShaderTriangles : public ShaderTest {
 protected:
  template <class Field>
  Counts count(const Field& field, const std::vector<uint32_t>& words, const std::vector<Segment>& rays,
               const std::string& shader) {
    Counts found;
    const auto answers = ask_shader(*vulkan_, shader_code(shader), words, 0, rays);
    for (size_t i = 0; i < rays.size(); ++i) {
      const kernels::Answer cpu = kernels::query(field, rays[i]);
      const bool differs = answers[i].visible != cpu.visible;
      ++found.rays;
      found.certain += answers[i].certain;
      found.blocked += !cpu.visible;
      found.different += differs;
      found.wrong += answers[i].certain && (differs || !cpu.certain || answers[i].logit != cpu.logit);
      EXPECT_EQ(answers[i].visible == 1, answers[i].logit >= 0);
    }
    return found;
  }

  /// An asset of one object.
  struct One {
    std::vector<std::byte> file;
    format::AssetView view;
    std::vector<uint32_t> words;

    One(const nifkit::Device& device, std::vector<std::byte> bytes, uint32_t object = 0)
        : file(std::move(bytes)),
          view(format::read_asset(file, "test")),
          words(nifkit::Asset::load(device, std::span<const std::byte>(file)).shader_tables(object)) {}
    kernels::TrianglesField field() const { return view.objects[0].as<kernels::TrianglesField>(); }
  };
  One one_of(const format::TrianglesData& triangles) {
    format::Asset asset;
    format::Object object = object_of(triangles, "it");
    object.triangles = triangles;
    asset.objects.push_back(std::move(object));
    return {device_, format::encode(asset)};
  }
  One one_of(const mesh::Mesh& mesh) {
    Soup soup{mesh.positions, mesh.triangles};
    Random random(7);
    return one_of(RandomTree(soup).pack(random));
  }

  /// Rays between random points of a cube around the object, three times as large.
  static std::vector<Segment> plain_rays(Random& random, float size, float centre, size_t count) {
    std::vector<Segment> rays(count);
    for (Segment& ray : rays) {
      for (size_t a = 0; a < 3; ++a) {
        ray.origin[a] = centre + size * random.between(-3.0f, 3.0f);
        ray.direction[a] = centre + size * random.between(-1.0f, 1.0f) - ray.origin[a];
      }
      ray.tmin = 0;
      ray.tmax = random.below(2) ? random.between(0.0f, 2.0f) : INFINITY;
    }
    return rays;
  }

  nifkit::Device device_{"shaders=on"};
};

TEST_F(ShaderTriangles, OfRandomObjectsAreNeverWronglyCertain) {
  size_t objects = 0;
  Counts odd, boundless;
  for (uint64_t seed = 1; seed <= 6; ++seed) {
    const auto file = format::encode(
        random_asset(seed, {.objects = 0, .instances = 0, .bvhs = 2, .exacts = 2, .sources = 2}));
    const format::AssetView view = format::read_asset(file, "test");
    const nifkit::Asset asset = nifkit::Asset::load(device_, std::span<const std::byte>(file));
    for (uint32_t i = 0; i < view.objects.size(); ++i) {
      const std::vector<uint32_t> words = asset.shader_tables(i);
      Random random(100 * seed + i);
      std::vector<Segment> rays;
      for (size_t k = 0; k < 4000; ++k) rays.push_back(random_segment(random, view.objects[i]));
      std::visit(
          [&](const auto& field) {
            for (const char* shader : {"query", "default", "rough"}) {
              const Counts found = count(field, words, rays, shader);
              EXPECT_EQ(found.wrong, 0u) << shader << ", object " << i << " of " << seed;
              odd += found;
            }
            boundless += count(field, words, rays, "boundless");
          },
          format::field_of(view.objects[i]));
      ++objects;
    }
  }
  EXPECT_EQ(objects, 24u);
  EXPECT_GT(odd.certain, odd.rays / 4);
  EXPECT_GT(odd.blocked, odd.rays / 10);
  EXPECT_GT(boundless.wrong, 0u) << "this would find a wrong proof";
}

TEST_F(ShaderTriangles, AreMostlyCertain) {
  for (const auto& [centre, size] : {std::pair(0.0f, 1.0f), {0.0f, 1e-6f}, {0.0f, 1e6f}, {100.0f, 1.0f}}) {
    Random random(3);
    const One one = one_of(random_bvh(random, 500, centre, size));
    const auto rays = plain_rays(random, size, centre, 20'000);
    for (const char* shader : {"default", "rough"}) {
      const Counts found = count(one.field(), one.words, rays, shader);
      EXPECT_EQ(found.wrong, 0u) << shader << ' ' << centre << ' ' << size;
      EXPECT_LT(found.rays - found.certain, found.rays / 100) << shader << ' ' << centre << ' ' << size;
      EXPECT_LE(found.different, found.rays - found.certain);
      EXPECT_GT(found.blocked, found.rays / 10);
    }
  }
}

TEST_F(ShaderTriangles, OfExtremeSizesAreAnsweredWithoutProof) {
  for (const float size : {1e-20f, 1e15f}) {
    Random random(4);
    const One one = one_of(random_bvh(random, 200, 0, size));
    const auto rays = plain_rays(random, size, 0, 5000);
    const Counts found = count(one.field(), one.words, rays, "default");
    EXPECT_EQ(found.certain, 0u) << size;
    EXPECT_LT(found.different, found.rays / 50) << size;
  }
}

/// No ray leaves a closed surface between its triangles, even through vertices and edges.
TEST_F(ShaderTriangles, LetNoRayThroughEdges) {
  const mesh::Mesh ball = icosphere(3);
  const One one = one_of(ball);
  Random random(5);
  std::vector<Segment> rays;
  for (size_t k = 0; k < 20'000; ++k) {
    const mesh::Triangle& triangle = ball.triangles[random.below(uint32_t(ball.triangles.size()))];
    const float share = random.below(4) ? random.unit() : 0;
    Segment ray{{}, {}, 0, INFINITY};
    for (size_t a = 0; a < 3; ++a) {
      ray.origin[a] = random.between(-0.5f, 0.5f);
      const float from = ball.positions[triangle[0]][a], to = ball.positions[triangle[1]][a];
      ray.direction[a] = from + share * (to - from) - ray.origin[a];
    }
    rays.push_back(ray);
  }
  for (const char* shader : {"default", "rough"})
    for (const ShaderAnswer& answer : ask_shader(*vulkan_, shader_code(shader), one.words, 0, rays))
      EXPECT_EQ(answer.visible, 0u) << shader;
}

TEST_F(ShaderTriangles, AreNeverCertainIfTheFileProvesNothing) {
  const One one(device_, format::encode(random_asset(
                             8, {.objects = 0, .instances = 0, .bvhs = 1, .proves_nothing = true})));
  Random random(9);
  std::vector<Segment> rays;
  for (size_t k = 0; k < 2000; ++k) rays.push_back(random_segment(random, one.view.objects[0]));
  size_t different = 0;
  for (size_t i = 0;
       const ShaderAnswer& answer : ask_shader(*vulkan_, shader_code("query"), one.words, 0, rays)) {
    EXPECT_EQ(answer.certain, 0u);
    different += answer.visible != kernels::query(one.field(), rays[i++]).visible;
  }
  EXPECT_LT(different, rays.size() / 10);
}

/// Compares first hits with those of an only instance. Returns how many are certain.
struct HitCounts {
  size_t rays = 0, hits = 0, certain = 0, colored = 0;
};
HitCounts compare_hits(const std::vector<ShaderHit>& shader, const nifkit::Scene& scene,
                       const std::vector<Segment>& rays, const char* name) {
  std::vector<NifRay> asked;
  for (const Segment& ray : rays) asked.push_back(to_ray(ray));
  FirstHits cpu(rays.size());
  const NifRays query = nifMakeRays(asked.data(), asked.size());
  const NifHits outputs = cpu.outputs();
  EXPECT_EQ(nifIntersect(scene.get(), &query, &outputs), NIF_OK) << nifGetErrorMessage();
  HitCounts found;
  size_t wrong = 0, far = 0, turned = 0, recolored = 0;
  for (size_t i = 0; i < rays.size(); ++i) {
    const ShaderHit& hit = shader[i];
    ++found.rays;
    found.hits += hit.hit;
    found.certain += hit.certain;
    if (!hit.hit) {
      EXPECT_EQ(hit.triangle, NIF_NONE);
      EXPECT_EQ(hit.instance, NIF_NONE);
      EXPECT_EQ(hit.t, INFINITY);
    }
    if (!hit.certain) continue;
    wrong += hit.hit != cpu.hit[i] || hit.triangle != cpu.triangle[i];
    if (!hit.hit || hit.triangle != cpu.triangle[i]) continue;
    wrong += hit.instance != NIF_NONE && hit.instance != cpu.instance[i];
    far += !(std::abs(hit.t - cpu.t[i]) <= 1e-3f * std::max(std::abs(cpu.t[i]), 1e-3f));
    float cosine = 0, other = 0;
    for (size_t a = 0; a < 3; ++a) {
      cosine += hit.normal[a] * cpu.normal[3 * i + a];
      other = std::max(other, std::abs(hit.color[a] - cpu.color[3 * i + a]));
    }
    recolored += !(other <= 1e-5f);
    found.colored += hit.color[0] != 0.5f;
    turned += !(cosine > 0.999f);
  }
  EXPECT_EQ(wrong, 0u) << name;
  EXPECT_EQ(far, 0u) << name;
  EXPECT_LE(turned, rays.size() / 1000) << name;  // of triangles that are nearly edges
  // Between two voxels: many of these triangles lie there, where rougher arithmetic decides otherwise.
  EXPECT_LE(recolored, rays.size() / (std::string_view(name) == "hits_rough" ? 200 : 1000)) << name;
  return found;
}

TEST_F(ShaderTriangles, HaveTheFirstHitsOfTheCpu) {
  HitCounts odd, plain;
  for (uint64_t seed = 1; seed <= 4; ++seed) {
    const auto file = format::encode(random_asset(
        seed, {.objects = 0, .instances = 0, .bvhs = 2, .exacts = 2, .colors = 2, .sources = 3}));
    const format::AssetView view = format::read_asset(file, "test");
    const nifkit::Asset asset = nifkit::Asset::load(device_, std::span<const std::byte>(file));
    for (uint32_t i = 0; i < view.objects.size(); ++i) {
      nifkit::Scene scene(device_);
      scene.add_instance(asset, i);
      scene.commit();
      Random random(100 * seed + i);
      std::vector<Segment> rays;
      for (size_t k = 0; k < 4000; ++k) rays.push_back(random_segment(random, view.objects[i]));
      float size = 0;
      for (size_t a = 0; a < 3; ++a)
        size = std::max({size, std::abs(view.objects[i].aabb_min[a]), std::abs(view.objects[i].aabb_max[a])});
      const auto others = plain_rays(random, size, 0, 4000);
      const std::vector<uint32_t> words = asset.shader_tables(i);
      for (const char* shader : {"hits", "hits_hlsl", "hits_rough"}) {
        SCOPED_TRACE(seed);
        const auto of_odd =
            compare_hits(hits_of_shader(*vulkan_, shader_code(shader), words, rays), scene, rays, shader);
        const auto of_plain =
            compare_hits(hits_of_shader(*vulkan_, shader_code(shader), words, others), scene, others, shader);
        odd.certain += of_odd.certain, odd.rays += of_odd.rays;
        plain.certain += of_plain.certain, plain.rays += of_plain.rays, plain.hits += of_plain.hits;
        plain.colored += of_plain.colored;
      }
    }
  }
  EXPECT_GT(odd.certain, odd.rays / 5);
  EXPECT_GT(plain.certain, plain.rays * 9 / 10);  // some of these triangles are there twice
  EXPECT_GT(plain.hits, plain.rays / 10);
  EXPECT_GT(plain.colored, plain.rays / 50);
}

TEST_F(ShaderTriangles, MayBeLeftOut) {
  const One one(device_, format::encode(random_asset(8, {.objects = 0, .instances = 0, .bvhs = 1})));
  Random random(9);
  std::vector<Segment> rays;
  for (size_t k = 0; k < 500; ++k) rays.push_back(random_segment(random, one.view.objects[0]));
  for (const ShaderAnswer& answer : ask_shader(*vulkan_, shader_code("planes"), one.words, 0, rays)) {
    EXPECT_EQ(answer.visible + answer.certain, 0u);
    EXPECT_EQ(answer.logit, kernels::kOpenLogit);
  }
}

}  // namespace
}  // namespace nif::test
