// A merged asset: its metadata says how to merge again, and its answers are those of the scene's triangles.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "bake/ground_truth/prepare.hpp"
#include "bake/merge_metadata.hpp"
#include "formats/mesh/flat_scene.hpp"
#include "formats/nif/writer.hpp"
#include "mesh/merge/merge.hpp"
#include "nif/nif.hpp"
#include "tests/bake/quiet_bake.hpp"
#include "tests/support/test_shapes.hpp"
#include "tools/common/segment_query.hpp"

namespace nif::test {
namespace {

using nlohmann::json;

mesh::MergeOptions small_objects() {
  mesh::MergeOptions options;
  options.added_triangles = 100'000;
  options.part_triangles = 500;
  options.object_triangles = 2'000;
  return options;
}

/// Balls and rings close to each other, rotated, stretched and some mirrored, and a large one that is not
/// merged.
mesh::Scene crowd() {
  mesh::Scene scene;
  scene.meshes = {icosphere(1), torus(12, 8), icosphere(3)};
  nif::Random random(7, 0, 0);
  for (uint32_t i = 0; i < 150; ++i) {
    mesh::Instance& instance = scene.instances.emplace_back();
    instance.name = "thing " + std::to_string(i);
    instance.mesh = i % 2;
    for (float& value : instance.transform) value = float(random.uniform() - 0.5);
    for (const size_t a : {size_t{3}, size_t{7}, size_t{11}}) instance.transform[a] *= 12;
    for (const size_t a : {size_t{0}, size_t{5}, size_t{10}}) instance.transform[a] += i % 3 ? 1.f : -1.f;
  }
  scene.instances.push_back({"middle", 2, mesh::kIdentity});
  return scene;
}

bake::BakeOptions exact() {
  bake::BakeOptions options;
  options.encoding = "bvh";
  options.evaluation_rays = 0;
  return options;
}

/// The combined answers of all instances of an asset.
std::vector<uint8_t> answers_of(const bake::BakeResult& result, std::span<const kernels::Segment> rays) {
  const nifkit::Device device("threads=1");
  nifkit::Scene scene(device);
  scene.add_asset(nifkit::Asset::load(device, format::encode(result.asset)));
  scene.commit();
  std::vector<uint8_t> visible(rays.size());
  NifRays query = tools::rays_of(rays);
  auto outputs = nifkit::sized<NifAnswers>();
  outputs.visible = visible.data();
  nifkit::check(nifQuery(scene.get(), &query, &outputs));
  return visible;
}

size_t different(const std::vector<uint8_t>& a, const std::vector<uint8_t>& b) {
  size_t count = 0;
  for (size_t i = 0; i < a.size(); ++i) count += a[i] != b[i];
  return count;
}

TEST(MergedBake, AnswersAsOneBvhOfAllTriangles) {
  const mesh::Scene scene = crowd(), merged = mesh::merge(scene, small_objects());
  ASSERT_GT(merged.merging->merged.size(), 5u);
  const mesh::Mesh whole = mesh::flatten(scene, "whole");
  const bake::Prepared prepared = bake::prepare(whole);
  const bake::GroundTruth truth(prepared);
  std::vector<kernels::Segment> rays;
  for (const bake::RaySet set :
       {bake::RaySet::outer_lines, bake::RaySet::inner_surface, bake::RaySet::segments}) {
    const bake::RaysWithTruth drawn = bake::make_ray_set(truth.source(), set, 20'000, 3);
    rays.insert(rays.end(), drawn.segments.begin(), drawn.segments.end());
  }
  const std::vector<uint8_t> of_merged = answers_of(bake_quietly(merged, exact()), rays),
                             of_one = answers_of(bake_quietly(scene_of({whole}), exact()), rays),
                             of_instances = answers_of(bake_quietly(scene, exact()), rays);
  EXPECT_GT(std::ranges::count(of_one, 0), 5'000);
  EXPECT_GT(std::ranges::count(of_one, 1), 5'000);
  EXPECT_EQ(different(of_merged, of_one), 0u) << "the same triangles, to the bit";
  EXPECT_LE(different(of_merged, of_instances), 20u) << "positions are rounded once";
}

TEST(MergedBake, ItsMetadataMergesAlike) {
  mesh::MergeOptions options = small_objects();
  options.nodes = {"thing*"};
  options.except = {"thing 1?"};
  const mesh::Scene merged = mesh::merge(crowd(), options);
  const bake::BakeResult result = bake_quietly(merged, exact());
  const std::optional<mesh::MergeOptions> read = bake::merge_options_of(result.asset.metadata);
  ASSERT_TRUE(read);
  const mesh::Scene again = mesh::merge(crowd(), *read);
  ASSERT_EQ(again.meshes.size(), merged.meshes.size());
  for (size_t m = 0; m < merged.meshes.size(); ++m) {
    EXPECT_EQ(again.meshes[m].positions, merged.meshes[m].positions);
    EXPECT_EQ(again.meshes[m].triangles, merged.meshes[m].triangles);
  }
  const json merge = json::parse(result.asset.metadata)["merge"];
  ASSERT_EQ(merge["objects"].size(), merged.merging->merged.size());
  for (size_t k = 0; k < merge["objects"].size(); ++k) {
    const json& object = merge["objects"][k];
    EXPECT_EQ(result.asset.instances[object["instance"].get<size_t>()].name,
              "merged " + std::to_string(k + 1));
    EXPECT_FALSE(object.contains("nodes")) << "the scene is of no glTF";
    ASSERT_EQ(object["names"].size(), merged.merging->merged[k].parts.size());
    ASSERT_EQ(object["triangles"].size(), object["names"].size());
    EXPECT_EQ(object["names"][0], merged.merging->merged[k].parts[0].name);
  }
}

/// What an application does that wants to know which mesh of the file a ray hits: `instance` and `triangle` of
/// a hit, and the counts in the metadata.
TEST(MergedBake, HitsTellTheMeshByRangesOfTriangles) {
  mesh::Scene scene = scene_of({icosphere(2), torus(12, 8), cube(), icosphere(3)});
  scene.meshes[0].triangles.push_back(scene.meshes[0].triangles[7]);  // which a bake drops
  for (size_t i = 0; i < scene.instances.size(); ++i) {
    scene.instances[i].name = "part " + std::to_string(i);
    scene.instances[i].transform[3] = 4 * float(i);
  }
  const mesh::Scene merged = mesh::merge(scene, mesh::few_copies());
  for (const char* encoding : {"bvh", "exact", "auto"}) {
    bake::BakeOptions options = exact();
    options.encoding = encoding;
    const bake::BakeResult result = bake_quietly(merged, options);
    ASSERT_EQ(result.asset.objects.size(), 1u);
    const json merge = json::parse(result.asset.metadata)["merge"];
    const std::vector<uint64_t> counts = merge["objects"][0]["triangles"];
    ASSERT_EQ(counts, (std::vector<uint64_t>{321, 192, 12, 1280}));
    const nifkit::Device device("threads=1");
    nifkit::Scene placed(device);
    placed.add_asset(nifkit::Asset::load(device, format::encode(result.asset)));
    placed.commit();
    for (size_t i = 0; i < counts.size(); ++i) {
      // Onto the ring of the torus, not through its hole.
      const NifRay ray{{4 * float(i) + (i == 1 ? 1.0f : 0.1f), 0.05f, 5}, 0, {0, 0, -1}, 10};
      uint32_t triangle = 0, instance = 9;
      auto hits = nifkit::sized<NifHits>();
      hits.triangle = &triangle, hits.instance = &instance;
      const NifRays query = nifMakeRays(&ray, 1);
      nifkit::check(nifIntersect(placed.get(), &query, &hits));
      ASSERT_EQ(instance, merge["objects"][0]["instance"]) << encoding << i;
      uint64_t before = triangle, part = 0;
      while (before >= counts[part]) before -= counts[part++];
      EXPECT_EQ(part, i) << encoding;
      EXPECT_EQ(merge["objects"][0]["names"][part], "part " + std::to_string(i));
      const mesh::Triangle& corners = scene.meshes[part].triangles[before];
      float nearest = 9, farthest = -9;
      for (const uint32_t corner : corners) {
        nearest = std::min(nearest, scene.meshes[part].positions[corner][1]);
        farthest = std::max(farthest, scene.meshes[part].positions[corner][1]);
      }
      EXPECT_TRUE(nearest <= 0.05f && farthest >= 0.05f) << "the triangle is where the ray is";
    }
  }
}

TEST(MergedBake, MaxBytesCountsTheNamesOfWhatWasMerged) {
  mesh::Scene scene = crowd();
  for (mesh::Instance& instance : scene.instances) instance.name += std::string(200, 'x');
  const mesh::Scene merged = mesh::merge(std::move(scene), small_objects());
  bake::BakeOptions options = exact();
  const uint64_t bytes = format::encode(bake_quietly(merged, options).asset).size();
  options.max_bytes = bytes - 1;
  EXPECT_EQ(status_of(merged, options), Status::target_not_met);
}

TEST(MergedBake, MetadataThatMakesNoSenseIsRefused) {
  EXPECT_FALSE(bake::merge_options_of(""));
  EXPECT_FALSE(bake::merge_options_of("[5"));
  EXPECT_FALSE(bake::merge_options_of("[5]"));
  EXPECT_FALSE(bake::merge_options_of("{}"));
  const std::string counts = R"("added_triangles": 1, "part_triangles": 2, "object_triangles": 3)";
  EXPECT_EQ(bake::merge_options_of("{\"merge\": {" + counts + "}}")->object_triangles, 3u);
  std::string names = "\"x\"";
  for (size_t i = 0; i < bake::kMostMergeNames; ++i) names += ", \"x\"";
  for (const std::string& merge :
       {std::string("null"), std::string("[]"), std::string("{}"), "{" + counts + ", \"nodes\": {}}",
        "{" + counts + ", \"except\": [" + names + "]}", "{" + counts + ", \"nodes\": [1]}",
        "{" + counts + ", \"except\": \"x\"}",
        std::string(R"({"added_triangles": -1, "part_triangles": 2, "object_triangles": 3})"),
        std::string(R"({"added_triangles": 1, "part_triangles": 1e99, "object_triangles": 3})"),
        std::string(R"({"added_triangles": 1, "part_triangles": 2, "object_triangles": "3"})")}) {
    try {
      bake::merge_options_of("{\"merge\": " + merge + "}");
      ADD_FAILURE() << merge;
    } catch (const Error& error) {
      EXPECT_EQ(error.status(), Status::mesh_mismatch) << merge;
    }
  }
}

TEST(MergedBake, RaysStartOffTheSurfaceByTheBiasOfTheParts) {
  mesh::Scene scene;
  scene.meshes = {cube()};
  for (int i = 0; i < 40; ++i)
    scene.instances.push_back({"cube", 0, {1, 0, 0, 3 * float(i), 0, 1, 0, 0, 0, 0, 1, 0}});
  const bake::BakeResult result = bake_quietly(mesh::merge(scene, small_objects()), exact());
  ASSERT_EQ(result.asset.objects.size(), 1u);
  EXPECT_FLOAT_EQ(result.asset.objects[0].bias, 2e-3f) << "a cube is 2 long, and all are 119";
}

}  // namespace
}  // namespace nif::test
