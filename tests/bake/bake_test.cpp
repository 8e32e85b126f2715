// Bakes scenes to assets: what is kept, shared and refused; and the file gives the answers of the baker's
// copy.
#include "bake/bake.hpp"

#include <gtest/gtest.h>
#include <tbb/parallel_for.h>

#include <nlohmann/json.hpp>

#include "bake/ground_truth/prepare.hpp"
#include "formats/mesh/read.hpp"
#include "formats/nif/reader.hpp"
#include "formats/nif/writer.hpp"
#include "kernels/reference/reference_encodings.hpp"
#include "nif/nif.h"
#include "tests/bake/quiet_bake.hpp"
#include "tests/support/real_meshes.hpp"
#include "tests/support/test_shapes.hpp"

namespace nif::test {
namespace {

using bake::RaySet;

bake::BakeOptions quick() { return small_field(0.1); }

mesh::Scene two_kinds_thrice() {
  mesh::Scene scene;
  scene.meshes = {torus(40, 20), icosphere(3), torus(40, 20)};
  scene.meshes[0].name = "ring";
  scene.meshes[1].name = "ball";
  scene.meshes[2].name = "ring again";
  scene.instances = {
      {"a", 0, {}}, {"b", 1, mesh::kIdentity}, {"c", 2, {2, 0, 0, 5, 0, -1, 0, 6, 0, 0, 3, 7}}};
  scene.instances[0].transform = {1, 0, 0, 1, 0, 1, 0, 2, 0, 0, 1, 3};
  scene.source_hash = 0x123456789abcdef0;
  return scene;
}

TEST(Bake, KeepsNamesInstancesAndBoundsAndSharesEqualMeshes) {
  const mesh::Scene scene = two_kinds_thrice();
  const bake::BakeResult result = bake_quietly(scene, quick());
  const std::vector<std::byte> file = format::encode(result.asset);
  const format::AssetView view = format::read_asset(file, "test");
  ASSERT_EQ(view.objects.size(), 2u);
  EXPECT_EQ(view.objects[0].name, "ring");
  EXPECT_EQ(view.objects[1].name, "ball");
  for (size_t i = 0; i < 2; ++i) {
    const mesh::Box box = mesh::bounds(scene.meshes[i].positions, scene.meshes[i].triangles);
    EXPECT_EQ(view.objects[i].aabb_min, box.min);
    EXPECT_EQ(view.objects[i].aabb_max, box.max);
    EXPECT_EQ(view.objects[i].triangle_count, scene.meshes[i].triangles.size());
  }
  ASSERT_EQ(view.instances.size(), 3u);
  const uint32_t objects[] = {0, 1, 0};
  for (size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(view.instances[i].name, scene.instances[i].name);
    EXPECT_EQ(view.instances[i].object, objects[i]);
    EXPECT_EQ(view.instances[i].transform, scene.instances[i].transform);
  }
  const auto metadata = nlohmann::json::parse(view.metadata);
  EXPECT_EQ(metadata["source"]["hash"], "xxh3-64:123456789abcdef0");
  EXPECT_EQ(metadata["objects"].size(), 2u);
  EXPECT_GT(metadata["accuracy"]["outer-lines"]["rays"], 0);
}

TEST(Bake, LeavesOutMeshesWithoutArea) {
  mesh::Scene scene = two_kinds_thrice();
  scene.meshes[1] = {"line", {{0, 0, 0}, {1, 1, 1}, {2, 2, 2}}, {{0, 1, 2}}};
  const bake::BakeResult result = bake_quietly(scene, quick());
  EXPECT_EQ(result.asset.objects.size(), 1u);
  EXPECT_EQ(result.asset.instances.size(), 2u);
  EXPECT_EQ(result.notes.size(), 1u);
  bake::BakeOptions strict = quick();
  strict.strict = true;
  EXPECT_EQ(status_of(scene, strict), Status::needs_repair);
  scene.meshes = {scene.meshes[1]};
  scene.instances = {{"line", 0, mesh::kIdentity}};
  EXPECT_EQ(status_of(scene, quick()), Status::all_degenerate);
}

TEST(Bake, MeasuresNothingWithoutRays) {
  bake::BakeOptions options = quick();
  options.evaluation_rays = 0;
  const bake::BakeResult result = bake_quietly(two_kinds_thrice(), options);
  for (RaySet set : bake::kRaySets) {
    EXPECT_EQ(result.sets[size_t(set)].rays, 0u);
    EXPECT_EQ(result.hits[size_t(set)].rays, 0u);
  }
  EXPECT_TRUE(nlohmann::json::parse(result.asset.metadata)["accuracy"].empty());
}

TEST(Bake, LeavesOutInstancesWithoutAnInverse) {
  mesh::Scene scene = two_kinds_thrice();
  scene.instances[2].transform = {1, 0, 0, 5, 0, 0, 0, 6, 0, 0, 1, 7};
  const bake::BakeResult result = bake_quietly(scene, quick());
  EXPECT_EQ(result.asset.objects.size(), 2u);
  EXPECT_EQ(result.asset.instances.size(), 2u);
  EXPECT_EQ(result.notes.size(), 1u);
}

class BakeOfBytes : public testing::TestWithParam<bool> {};
INSTANTIATE_TEST_SUITE_P(Uncoded, BakeOfBytes, testing::Bool());

TEST_P(BakeOfBytes, StaysWithinThem) {
  mesh::Scene scene;
  scene.meshes = {icosphere(6)};
  scene.instances = {{"ball", 0, mesh::kIdentity}};
  bake::BakeOptions options = quick();
  options.resolution = 64;
  options.uncoded = GetParam();
  const size_t free = format::encode(bake_quietly(scene, options).asset).size();
  options.max_bytes = free * 2 / 3;
  const bake::BakeResult bounded = bake_quietly(scene, options);
  const size_t size = format::encode(bounded.asset).size();
  EXPECT_LE(size, *options.max_bytes);
  EXPECT_GE(size, *options.max_bytes * 2 / 3);
  options.max_bytes = 500;
  EXPECT_EQ(status_of(scene, options), Status::target_not_met);
}

TEST(Bake, RefusesAnErrorThatItDidNotReach) {
  bake::BakeOptions options = quick();
  options.max_error = 1e-7;
  EXPECT_EQ(status_of(two_kinds_thrice(), options), Status::target_not_met);
}

bake::BakeResult bake_alone(const mesh::Mesh& mesh) {
  mesh::Scene scene;
  scene.meshes = {mesh};
  scene.instances = {{"it", 0, mesh::kIdentity}};
  return bake_quietly(scene, quick());
}

TEST(Bake, BakesTheFewestTriangles) {
  for (const mesh::Mesh& mesh : {mesh::Mesh{"one", {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}}}, cube()}) {
    const bake::BakeResult result = bake_alone(mesh);
    for (RaySet set : bake::kRaySets) {
      EXPECT_EQ(result.sets[size_t(set)].certain_wrong, 0u) << mesh.name;
      EXPECT_LT(result.sets[size_t(set)].error(), 0.05) << mesh.name << ' ' << bake::name_of(set);
    }
  }
}

TEST(Bake, IsNeverCertainlyWrongOfANeedleThatNoGridResolves) {
  const bake::BakeResult result =
      bake_alone({"needle", {{0, 0, 0}, {1000, 0, 0}, {1000, 0.1f, 0}}, {{0, 1, 2}}});
  for (RaySet set : bake::kRaySets)
    EXPECT_EQ(result.sets[size_t(set)].certain_wrong, 0u) << bake::name_of(set);
}

TEST(Bake, RefusesSizesThatCannotBeComputedWith) {
  mesh::Scene scene;
  scene.meshes = {mesh::Mesh{"vast", {{0, 0, 0}, {3e38f, 0, 0}, {0, 3e38f, 0}}, {{0, 1, 2}}}};
  scene.instances = {{"it", 0, mesh::kIdentity}};
  EXPECT_EQ(status_of(scene, quick()), Status::too_large);
}

/// The runtime's answers from the file equal the reference's answers from the baker's own arrays.
void expect_same_answers(const mesh::Scene& scene, const bake::BakeOptions& options, size_t rays_per_set) {
  const bake::BakeResult result = bake_quietly(scene, options);
  const std::vector<std::byte> file = format::encode(result.asset);
  NifDevice device = nullptr;
  NifAsset asset = nullptr;
  ASSERT_EQ(nifNewDevice(nullptr, nullptr, &device), NIF_OK);
  ASSERT_EQ(nifLoadAssetMemory(device, file.data(), file.size(), NIF_LOAD_COPY, &asset), NIF_OK);
  const bake::PreparedScene prepared = bake::prepare(scene);
  for (uint32_t i = 0; i < result.asset.objects.size(); ++i) {
    NifScene alone = nullptr;
    ASSERT_EQ(nifNewScene(device, &alone), NIF_OK);
    ASSERT_EQ(nifAddInstance(alone, asset, i, nullptr, nullptr), NIF_OK);
    ASSERT_EQ(nifCommitScene(alone), NIF_OK);
    const format::Object& object = result.asset.objects[i];
    const kernels::AnyField field = format::field_of(result.asset, object);
    const bake::GroundTruth truth(prepared.objects[i]);
    for (RaySet set : bake::kRaySets) {
      const bake::RaysWithTruth rays = bake::make_ray_set(truth.source(), set, rays_per_set, 31);
      const size_t count = rays.segments.size();
      std::vector<uint8_t> visible(count), certain(count);
      std::vector<int32_t> logits(count);
      const kernels::Segment& first = rays.segments.front();
      NifRays query{};
      auto outputs = nifkit::sized<NifAnswers>();
      query.struct_size = sizeof(query);
      query.count = count;
      for (int a = 0; a < 3; ++a)
        query.origin[a] = &first.origin[a], query.direction[a] = &first.direction[a];
      query.tmin = &first.tmin, query.tmax = &first.tmax;
      query.origin_stride = query.direction_stride = query.tmin_stride = query.tmax_stride =
          sizeof(kernels::Segment);
      outputs.visible = visible.data(), outputs.certain = certain.data(), outputs.logit = logits.data();
      ASSERT_EQ(nifQuery(alone, &query, &outputs), NIF_OK);
      size_t differing = 0;
      for (size_t r = 0; r < count; ++r) {
        const kernels::Answer own = kernels::query(field, rays.segments[r]);
        differing +=
            own.visible != (visible[r] != 0) || own.certain != (certain[r] != 0) || own.logit != logits[r];
      }
      EXPECT_EQ(differing, 0u) << object.name << ' ' << bake::name_of(set);
    }
    nifReleaseScene(alone);
  }
  nifReleaseAsset(asset);
  nifReleaseDevice(device);
}

TEST(LoadedAsset, AnswersAsTheBakersOwnCopy) { expect_same_answers(two_kinds_thrice(), quick(), 1'000'000); }

TEST(LoadedAsset, AnswersAsTheBakersOwnBvhs) {
  bake::BakeOptions options = quick();
  options.encoding = "bvh";
  expect_same_answers(two_kinds_thrice(), options, 200'000);
}

TEST(LoadedAsset, AnswersAsTheBakersOwnCopyOfTheDragon) {
  const auto folder = real_mesh_folder();
  if (!folder) GTEST_SKIP() << "NIF_TEST_MESHES is not set";
  bake::BakeOptions options = quick();
  options.resolution = 96;
  expect_same_answers(mesh::read(*folder / "stanford_dragon_871k.ply.gz"), options, 1'000'000);
}

}  // namespace
}  // namespace nif::test
