// Which encoding each object gets, and why; BVHs give Embree's answers; and nothing depends on the number of
// threads.

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <limits>
#include <nlohmann/json.hpp>

#include "bake/bake.hpp"
#include "bake/choice.hpp"
#include "bake/ground_truth/prepare.hpp"
#include "bake/network/corner_features.hpp"
#include "bake/triangles/builder.hpp"
#include "formats/nif/reader.hpp"
#include "formats/nif/writer.hpp"
#include "tests/bake/quiet_bake.hpp"
#include "tests/support/test_random.hpp"
#include "tests/support/test_shapes.hpp"

namespace nif::test {
namespace {

using bake::RaySet;

bake::BakeOptions quick(std::string_view encoding) {
  bake::BakeOptions options;
  options.encoding = encoding;
  options.preset = bake::Preset::fast;
  options.effort = 0.1;
  options.evaluation_rays = 20'000;
  return options;
}

/// Status and message of a refused bake; ok if it succeeds.
std::pair<Status, std::string> refusal_of(const mesh::Scene& scene, const bake::BakeOptions& options) {
  try {
    bake_quietly(scene, options);
  } catch (const Error& error) {
    return {error.status(), error.what()};
  }
  return {Status::ok, ""};
}

/// Triangles of all sizes and orientations: nothing that a network could learn.
mesh::Mesh soup(uint32_t triangles) {
  mesh::Mesh mesh{"soup", {}, {}};
  Random random(1);
  for (uint32_t t = 0; t < triangles; ++t) {
    const mesh::Float3 centre{random.unit(), random.unit(), random.unit()};
    for (int k = 0; k < 3; ++k) {
      mesh::Float3 p = centre;
      for (float& x : p) x += random.between(-0.1f, 0.1f);
      mesh.positions.push_back(p);
    }
    mesh.triangles.push_back({3 * t, 3 * t + 1, 3 * t + 2});
  }
  return mesh;
}

/// Smooth, and with enough triangles for "auto" to choose a field.
mesh::Mesh many() {
  mesh::Mesh mesh = torus(800, 130);
  mesh.name = "many";
  return mesh;
}

TEST(Encoding, OfABvhAnswersAsEmbree) {
  for (const mesh::Mesh& mesh : {icosphere(4), open_bowl(20, 40), soup(500), cube(), torus(100, 50),
                                 mesh::Mesh{"one", {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}}}}) {
    SCOPED_TRACE(mesh.name);
    bake::BakeOptions options = quick("bvh");
    options.evaluation_rays = 200'000;
    const bake::BakeResult result = bake_quietly(scene_of({mesh}), options);
    const format::Object& object = result.asset.objects[0];
    ASSERT_TRUE(object.triangles && !object.planes);
    EXPECT_EQ(object.triangles->triangles.size(), mesh.triangles.size());
    EXPECT_TRUE(result.asset.mlps.empty());
    EXPECT_EQ(result.objects[0].encoding, "bvh");
    EXPECT_EQ(result.objects[0].training_rays, 0u);
    uint64_t rays = 0;
    for (RaySet set : bake::kRaySets) {
      const bake::Accuracy& accuracy = result.sets[size_t(set)];
      rays += accuracy.rays;
      // One ray in a million passes so close to an edge that Embree's rounding decides.
      EXPECT_LE(accuracy.leak + accuracy.spurious, 3u) << bake::name_of(set);
      EXPECT_EQ(accuracy.certain, accuracy.rays) << bake::name_of(set);
      EXPECT_EQ(accuracy.certain_wrong, 0u) << bake::name_of(set);
    }
    EXPECT_GE(rays, 400'000u);
  }
}

TEST(Encoding, OfABvhCanBeWrittenWithoutMeasuring) {
  bake::BakeOptions options = quick("bvh");
  options.evaluation_rays = 0;
  const bake::BakeResult result = bake_quietly(scene_of({cube(), torus(20, 10)}), options);
  const std::vector<std::byte> file = format::encode(result.asset);
  const format::AssetView view = format::read_asset(file, "test");
  ASSERT_EQ(view.objects.size(), 2u);
  for (const format::ObjectView& object : view.objects) EXPECT_TRUE(object.is<kernels::TrianglesField>());
  const auto metadata = nlohmann::json::parse(view.metadata);
  EXPECT_EQ(metadata["options"]["encoding"], "bvh");
  EXPECT_FALSE(metadata["options"].contains("preset"));
  EXPECT_EQ(metadata["objects"][1]["encoding"], "bvh");
  EXPECT_EQ(metadata["objects"][1]["reason"], "as requested");
}

TEST(Encoding, IsChosenForEachObjectAndSaysWhy) {
  bake::BakeOptions options = quick(bake::kAutomatic);
  const bake::BakeResult result = bake_quietly(scene_of({cube(), many(), icosphere(6)}), options);
  ASSERT_EQ(result.objects.size(), 3u);
  const bake::ObjectReport &simple = result.objects[0], &large = result.objects[1],
                           &smooth = result.objects[2];
  const auto says = [](const bake::ObjectReport& object, std::string_view words) {
    EXPECT_NE(object.reason.find(words), std::string::npos) << object.reason;
  };

  EXPECT_EQ(simple.encoding, "bvh");
  says(simple, "exact: it has fewer than 200000 triangles");
  EXPECT_TRUE(simple.compared.empty()) << "planes would take more memory than allowed";

  EXPECT_EQ(large.encoding, "segment");
  says(large, "learned: it has 200000 triangles or more");
  EXPECT_TRUE(large.compared.empty()) << "what is not taken is not laid out";
  EXPECT_GT(large.training_rays, 0u);

  EXPECT_EQ(smooth.encoding, "exact");
  says(smooth, "no more memory than a compact BVH of Embree");
  says(smooth, "less work as planes in front of a BVH");
  EXPECT_LE(smooth.cost_of("exact")->resident, bake::kEmbreeBytesPerTriangle * smooth.triangles);
  EXPECT_LT(smooth.cost_of("exact")->work, smooth.cost_of("bvh")->work);
  EXPECT_EQ(smooth.training_rays, 0u);

  // Networks are numbered as if objects without one were not there.
  ASSERT_EQ(result.asset.mlps.size(), 1u);
  EXPECT_EQ(result.asset.objects[1].network->mlp, 0u);
  const auto metadata = nlohmann::json::parse(result.asset.metadata);
  for (size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(metadata["objects"][i]["encoding"], result.objects[i].encoding);
    EXPECT_EQ(metadata["objects"][i]["reason"], result.objects[i].reason);
  }
}

TEST(Encoding, FollowsThePreference) {
  const mesh::Scene scene = scene_of({icosphere(4), icosphere(6)});
  bake::BakeOptions options = quick(bake::kAutomatic);
  options.evaluation_rays = 0;
  const auto says = [](const bake::ObjectReport& object, std::string_view words) {
    EXPECT_NE(object.reason.find(words), std::string::npos) << object.reason;
  };
  const auto metadata = [](const bake::BakeResult& result) {
    return nlohmann::json::parse(result.asset.metadata);
  };

  const bake::BakeResult neither = bake_quietly(scene, options);
  EXPECT_EQ(neither.objects[0].encoding, "bvh") << "it has few triangles";
  EXPECT_EQ(neither.objects[1].encoding, "exact");
  EXPECT_FALSE(metadata(neither)["options"].contains("prefer"));

  options.prefer = bake::Preference::speed;
  const bake::BakeResult fast = bake_quietly(scene_of({icosphere(4), soup(2000)}), options);
  EXPECT_EQ(metadata(fast)["options"]["prefer"], "speed");
  EXPECT_EQ(fast.objects[0].encoding, "exact") << "planes save work for a ball";
  EXPECT_EQ(fast.objects[1].encoding, "bvh") << "but not for a soup";
  for (const bake::ObjectReport& object : fast.objects) {
    says(object,
         "exact: it has fewer than 200000 triangles, and may take any memory; speed is preferred; less work "
         "as");
    const std::string_view other = object.encoding == "bvh" ? "exact" : "bvh";
    EXPECT_LT(object.cost_of(object.encoding)->work, object.cost_of(other)->work);
  }
  says(fast.objects[0], "less work as planes in front of a BVH than as a BVH: ");
  says(fast.objects[1], "less work as a BVH than as planes in front of a BVH: ");
  EXPECT_GT(fast.objects[0].cost_of("exact")->resident,
            bake::kEmbreeBytesPerTriangle * fast.objects[0].triangles)
      << "memory does not matter";

  options.prefer = bake::Preference::bytes;
  const bake::BakeResult small = bake_quietly(scene, options);
  EXPECT_EQ(metadata(small)["options"]["prefer"], "bytes");
  for (const bake::ObjectReport& object : small.objects) {
    EXPECT_EQ(object.encoding, "bvh");
    says(object, "no more memory than a compact BVH of Embree");
    says(object, "; bytes are preferred, so it has no planes");
    EXPECT_TRUE(object.compared.empty()) << "planes are not even laid out";
  }
  EXPECT_LT(format::encode(small.asset).size(), format::encode(neither.asset).size());
}

TEST(Encoding, ThatIsNamedHasNoPreference) {
  const mesh::Scene scene = scene_of({icosphere(4)});
  for (const std::string_view encoding : {"exact", "bvh"}) {
    bake::BakeOptions options = quick(encoding);
    options.evaluation_rays = 0;
    const std::vector<std::byte> without = format::encode(bake_quietly(scene, options).asset);
    for (const bake::Preference preference : {bake::Preference::speed, bake::Preference::bytes}) {
      options.prefer = preference;
      EXPECT_TRUE(format::encode(bake_quietly(scene, options).asset) == without);
    }
  }
}

TEST(Encoding, KeepsToTheBytesGivenWhateverIsPreferred) {
  const mesh::Scene scene = scene_of({icosphere(4)});
  bake::BakeOptions options = quick(bake::kAutomatic);
  options.evaluation_rays = 0;
  options.prefer = bake::Preference::bytes;
  const uint64_t least = format::encode(bake_quietly(scene, options).asset).size();
  const auto reason_of = [&](bake::Preference preference, uint64_t most, std::string_view encoding) {
    options.prefer = preference;
    options.max_bytes = most;
    const bake::BakeResult result = bake_quietly(scene, options);
    EXPECT_LE(format::encode(result.asset).size(), most);
    EXPECT_EQ(result.objects[0].encoding, encoding);
    return result.objects[0].reason;
  };
  EXPECT_NE(
      reason_of(bake::Preference::speed, 10'000'000, "exact").find("speed is preferred; less work as planes"),
      std::string::npos);
  EXPECT_NE(reason_of(bake::Preference::speed, least + 4'000, "bvh")
                .find("but the size limit leaves no room for it"),
            std::string::npos);
  EXPECT_NE(
      reason_of(bake::Preference::bytes, 10'000'000, "bvh").find("bytes are preferred, so it has no planes"),
      std::string::npos);
}

TEST(Encoding, IsExactWhereNoAnswerMayBeWrong) {
  bake::BakeOptions options = quick(bake::kAutomatic);
  options.max_error = 0;
  const bake::BakeResult result = bake_quietly(scene_of({cube(), many()}), options);
  EXPECT_EQ(result.objects[0].encoding, "bvh");
  EXPECT_EQ(result.objects[1].encoding, "exact");
  for (const bake::ObjectReport& object : result.objects)
    EXPECT_NE(object.reason.find("exact: no answer may be wrong"), std::string::npos) << object.reason;
  EXPECT_TRUE(result.asset.mlps.empty());
  options.prefer = bake::Preference::bytes;
  for (const bake::ObjectReport& object : bake_quietly(scene_of({cube(), many()}), options).objects)
    EXPECT_EQ(object.encoding, "bvh");
}

TEST(Encoding, IsProofWhereRaysMayStayOpen) {
  bake::BakeOptions options = quick(bake::kAutomatic);
  options.open_rays = true;
  const bake::BakeResult result = bake_quietly(scene_of({cube(), many()}), options);
  EXPECT_EQ(result.objects[0].encoding, "bvh");
  EXPECT_EQ(result.objects[1].encoding, "proof");
  EXPECT_EQ(result.objects[1].reason, "proof: it has 200000 triangles or more");
  EXPECT_EQ(result.objects[1].training_rays, 0u);
  EXPECT_TRUE(result.asset.mlps.empty());
  for (const RaySet set : bake::kRaySets) {
    EXPECT_EQ(result.sets[size_t(set)].leak, 0u);
    EXPECT_EQ(result.sets[size_t(set)].certain_wrong, 0u);
  }
  // Planes that save no work are left out.
  options.encoding = "proof";
  const bake::BakeResult wild = bake_quietly(scene_of({soup(3000)}), options);
  EXPECT_EQ(wild.objects[0].encoding, "proof");
  EXPECT_NE(wild.objects[0].reason.find("planes are left out"), std::string::npos) << wild.objects[0].reason;
  EXPECT_FALSE(kernels::has_planes(format::field_of(*wild.asset.objects[0].planes)));
  EXPECT_TRUE(kernels::has_planes(format::field_of(*result.asset.objects[1].planes)));
  options.encoding = bake::kAutomatic;
  // Only planes fit.
  options.max_bytes = 200'000;
  EXPECT_EQ(bake_quietly(scene_of({many()}), options).objects[0].encoding, "proof");
}

TEST(Encoding, IsTheSameForAnyNumberOfThreadsAndWhateverIsMeasured) {
  const mesh::Scene scene = scene_of({cube(), many()});
  bake::BakeOptions options = quick(bake::kAutomatic);
  const auto bytes = [&](size_t threads) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    return format::encode(bake_quietly(scene, options).asset);
  };
  const std::vector<std::byte> one = bytes(1);
  EXPECT_TRUE(one == bytes(2));
  bake::BakeResult measured = bake_quietly(scene, options);
  options.evaluation_rays = 0;
  bake::BakeResult unmeasured = bake_quietly(scene, options);
  measured.asset.metadata = unmeasured.asset.metadata = "{}";
  EXPECT_TRUE(format::encode(measured.asset) == format::encode(unmeasured.asset));
}

TEST(Encoding, KeepsToTheBytesGiven) {
  const mesh::Scene scene = scene_of({icosphere(6), soup(2000)});
  bake::BakeOptions options = quick(bake::kAutomatic);
  const auto baked = [&](uint64_t most) {
    options.max_bytes = most;
    bake::BakeResult result = bake_quietly(scene, options);
    EXPECT_LE(format::encode(result.asset).size(), most);
    return result;
  };
  const auto is = [](const bake::ObjectReport& object, std::string_view encoding, std::string_view why) {
    EXPECT_EQ(object.encoding, encoding) << object.reason;
    EXPECT_NE(object.reason.find(why), std::string::npos) << object.reason;
  };
  const bake::BakeResult roomy = baked(10'000'000);
  is(roomy.objects[0], "exact", "exact: the size limit leaves room");
  is(roomy.objects[1], "bvh", "exact: the size limit leaves room");
  // The object that saves the most bytes is reduced first.
  const bake::BakeResult less = baked(200'000);
  is(less.objects[0], "segment", "learned: the size limit leaves no room for a BVH of");
  is(less.objects[1], "bvh", "exact: the size limit leaves room");
  const bake::BakeResult tight = baked(13'000);
  is(tight.objects[0], "segment", "learned: the size limit leaves no room for a BVH of");
  is(tight.objects[1], "segment", "learned: the size limit leaves no room for a BVH of");
}

TEST(Encoding, OfABvhDoesNotShrink) {
  bake::BakeOptions options = quick("bvh");
  options.max_bytes = 100'000;
  EXPECT_EQ(refusal_of(scene_of({icosphere(3)}), options).first, Status::ok);
  const auto [status, sentence] = refusal_of(scene_of({icosphere(6)}), options);
  EXPECT_EQ(status, Status::target_not_met);
  EXPECT_NE(sentence.find("with BVHs the asset takes"), std::string::npos) << sentence;
}

TEST(Encoding, IsExactWhereFieldsMissTheErrorAllowed) {
  bake::BakeOptions options = quick(bake::kAutomatic);
  options.max_error = 1e-5;
  const bake::BakeResult result = bake_quietly(scene_of({many()}), options);
  EXPECT_EQ(result.objects[0].encoding, "exact");
  EXPECT_NE(result.objects[0].reason.find("more than is allowed"), std::string::npos)
      << result.objects[0].reason;
  options.encoding = "segment";
  EXPECT_EQ(refusal_of(scene_of({icosphere(6)}), options).first, Status::target_not_met);
}

TEST(Encoding, IsExactWhereTrainingFails) {
  // A flat sheet: its box has no volume for rays to start in.
  mesh::Mesh sheet{"sheet", {}, {}};
  constexpr uint32_t kSide = 320;
  for (uint32_t y = 0; y <= kSide; ++y)
    for (uint32_t x = 0; x <= kSide; ++x)
      sheet.positions.push_back({static_cast<float>(x), static_cast<float>(y), 0});
  for (uint32_t y = 0; y < kSide; ++y)
    for (uint32_t x = 0; x < kSide; ++x) {
      const uint32_t corner = x + y * (kSide + 1);
      sheet.triangles.push_back({corner, corner + 1, corner + kSide + 1});
      sheet.triangles.push_back({corner + 1, corner + kSide + 2, corner + kSide + 1});
    }
  bake::BakeOptions options = quick(bake::kAutomatic);
  options.mix = bake::Mix{};
  (*options.mix)[size_t(RaySet::inner_volume)] = 1;
  const bake::BakeResult result = bake_quietly(scene_of({sheet}), options);
  EXPECT_EQ(result.objects[0].encoding, "exact");
  EXPECT_NE(result.objects[0].reason.find("training of 'sheet' failed"), std::string::npos)
      << result.objects[0].reason;
  options.encoding = "segment";
  EXPECT_EQ(refusal_of(scene_of({sheet}), options).first, Status::training_failed);
}

TEST(Encoding, OfABvhNeedsCoordinatesThatItCanComputeWith) {
  mesh::Mesh mesh = icosphere(3);
  for (mesh::Float3& p : mesh.positions)
    for (float& x : p) x = 1e18f + x * 1e14f;
  ASSERT_FALSE(bake::fits_bvh(mesh.positions));
  const auto [status, sentence] = refusal_of(scene_of({mesh}), quick("bvh"));
  EXPECT_EQ(status, Status::too_large);
  EXPECT_NE(sentence.find("icosphere"), std::string::npos) << sentence;
}

TEST(Encoding, CountsTheWorkOfBoth) {
  const mesh::Mesh fine = icosphere(6), coarse = icosphere(2);
  const auto work = [](const mesh::Mesh& mesh) {
    const bake::Prepared prepared = bake::prepare(mesh);
    const bake::GroundTruth truth(prepared);
    const format::TrianglesData bvh = bake::build_bvh(prepared.surface.positions, prepared.surface.triangles);
    return bake::work_of(format::field_of(bvh), truth.source(), 5);
  };
  EXPECT_GT(work(coarse), 0);
  EXPECT_GT(work(fine), 1.5 * work(coarse));

  const bake::Prepared prepared = bake::prepare(coarse);
  const bake::GroundTruth truth(prepared);
  const auto field_work = [&](uint32_t resolution) {
    const bake::Grid grid = bake::make_grid(prepared.box, resolution);
    format::Object object;
    object.planes.emplace();
    object.network.emplace();
    bake::store_occupancy(
        bake::classify(grid, prepared.surface, bake::voxelize(grid, prepared.surface).marks, prepared.closed),
        2, object);
    format::leave_bare(*object.planes);
    return bake::work_of(format::field_of(object, {}), truth.source(), 5);
  };
  // Empty bricks cost nothing, so the cost of a finer grid grows more slowly than its number of voxels.
  EXPECT_GT(field_work(128), 0);
  EXPECT_LT(field_work(128), 3 * field_work(32));
}

}  // namespace
}  // namespace nif::test
