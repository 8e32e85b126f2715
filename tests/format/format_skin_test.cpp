// How objects bend, in files: everything is kept, readers may do without it, and what is wrong is refused.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "formats/nif/writer.hpp"
#include "tests/format/damaged.hpp"
#include "tests/format/optional.hpp"
#include "tests/support/random_asset.hpp"

namespace nif {
namespace {

using test::Bytes;

/// A `segment` object, two `bvh` objects of which one or more have a skin, and an `exact` one.
format::Asset asset_with_skins(uint64_t seed, uint32_t skins = 2) {
  return test::random_asset(
      seed, {.objects = 1, .instances = 1, .max_voxels = 7, .bvhs = 2, .exacts = 1, .skins = skins});
}

TEST(SkinFile, KeepsEveryWeight) {
  for (uint64_t seed = 0; seed < 20; ++seed) {
    const format::Asset asset = asset_with_skins(seed);
    const Bytes bytes = format::encode(asset);
    EXPECT_EQ(format::encoded_bytes(asset), bytes.size());
    const format::AssetView view = format::read_asset(bytes, "file");
    EXPECT_EQ(bytes, format::encode(format::to_asset(view)));
    ASSERT_EQ(view.skins.size(), 2u);
    EXPECT_EQ(view.skin_of(0), nullptr);
    EXPECT_EQ(view.skin_of(3), nullptr) << "has planes, too";
    uint64_t all = 0;
    for (const uint32_t object : {1u, 2u}) {
      const format::SkinView* seen = view.skin_of(object);
      ASSERT_NE(seen, nullptr);
      const format::Skin kept = format::to_skin(*seen), &skin = *asset.objects[object].skin;
      EXPECT_EQ(kept.weights, skin.weights);
      EXPECT_EQ(kept.joints, skin.joints);
      EXPECT_EQ(kept.targets, skin.targets);
      EXPECT_EQ(kept.joint_count, skin.joint_count);
      all += seen->bytes();
    }
    for (const format::PartBytes& part : format::bytes_by_part(view)) {
      if (std::string_view(part.name) != "skin") continue;
      EXPECT_EQ(part.bytes, all);
    }
  }
}

TEST(SkinFile, IsOptional) {
  format::Asset without = asset_with_skins(1);
  for (format::Object& object : without.objects) object.skin.reset();
  test::expect_optional(format::encode(asset_with_skins(1)), format::encode(without),
                        {format::kSkinRecords, format::kSkinValues});
}

TEST(SkinFile, RefusesWhatIsWrong) {
  format::Asset asset = asset_with_skins(2);
  test::Random random(1);
  for (const size_t object : {1u, 2u})
    asset.objects[object].skin =
        test::random_skin(random, asset.objects[object].skin->vertex_count, object == 1 ? 4 : 8, 1);
  const Bytes file = format::encode(asset);
  const auto refused = [&](uint32_t index, const std::function<void(format::SkinRecord&)>& change) {
    return test::status_of(test::with_record<format::SkinRecord>(file, format::kSkinRecords, index,
                                                                 change)) == Status::damaged_nif;
  };
  EXPECT_FALSE(refused(0, [](auto&) {}));
  EXPECT_TRUE(refused(1, [](auto& r) { r.object = 3; })) << "has planes";
  EXPECT_TRUE(refused(1, [](auto& r) { r.object = 1; })) << "twice";
  EXPECT_TRUE(refused(0, [](auto& r) { ++r.vertices; }));
  EXPECT_TRUE(refused(0, [](auto& r) { r.vertices = 0; }));
  EXPECT_TRUE(refused(0, [](auto& r) { r.joints = kernels::kMostJoints + 1; }));
  EXPECT_TRUE(refused(0, [](auto& r) { r.joints = 0; }));
  EXPECT_TRUE(refused(0, [](auto& r) { r.joints = 1; })) << "a joint is out of range";
  EXPECT_TRUE(refused(0, [](auto& r) { r.influences = 5; }));
  EXPECT_TRUE(refused(0, [](auto& r) { r.targets = 2; }));
  EXPECT_TRUE(refused(0, [](auto& r) { r.targets = 0xffffffff; }));
  EXPECT_TRUE(refused(0, [](auto& r) { r.reserved = 1; }));
  EXPECT_TRUE(refused(1, [](auto& r) { r.values.bytes = ~uint64_t{0}; }));
  const auto value_refused = [&](const std::function<void(format::Skin&)>& change) {
    format::Skin changed = *asset.objects[1].skin;
    change(changed);
    return test::status_of(test::with_skin(file, 0, changed)) == Status::damaged_nif;
  };
  EXPECT_FALSE(value_refused([](auto&) {}));
  EXPECT_TRUE(value_refused([](auto& skin) { skin.weights[0] = -1; }));
  EXPECT_TRUE(value_refused([](auto& skin) { skin.weights[0] = NAN; }));
  EXPECT_TRUE(value_refused([](auto& skin) { skin.weights[0] += 0.01f; }));
  EXPECT_TRUE(value_refused([](auto& skin) { skin.joints[0] = uint16_t(skin.joint_count); }));
  EXPECT_TRUE(value_refused([](auto& skin) { skin.targets[0][1] = INFINITY; }));
  EXPECT_TRUE(value_refused([](auto& skin) { skin.targets[0][1] = 2 * format::kMostMove; }));
}

}  // namespace
}  // namespace nif
