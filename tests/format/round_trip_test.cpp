// What is written is what is read, and answers as the original does.
#include <gtest/gtest.h>

#include "formats/base/utf8.hpp"
#include "formats/nif/crc32c.hpp"
#include "formats/nif/reader.hpp"
#include "formats/nif/writer.hpp"
#include "tests/support/random_asset.hpp"

namespace nif {
namespace {

using format::AssetView;

TEST(Crc32c, KnownVectors) {
  const auto crc = [](std::string_view text) { return format::crc32c(std::as_bytes(std::span(text))); };
  EXPECT_EQ(crc(""), 0u);
  EXPECT_EQ(crc("a"), 0xc1d04330u);
  EXPECT_EQ(crc("123456789"), 0xe3069283u);
  EXPECT_EQ(crc(std::string(32, '\0')), 0x8a9136aau);  // RFC 3720, B.4
  const std::string text = "The quick brown fox jumps over the lazy dog";
  for (size_t cut = 0; cut <= text.size(); ++cut) {
    const auto bytes = std::as_bytes(std::span(text));
    EXPECT_EQ(format::crc32c(bytes.subspan(cut), format::crc32c(bytes.first(cut))), 0x22620404u);
  }
}

TEST(Utf8, AcceptsWhatTheStandardDoes) {
  for (const char* good : {"", "abc", "\u00e9", "\u20ac", "\U0001f409", "\xf4\x8f\xbf\xbf"})
    EXPECT_TRUE(is_utf8(good)) << good;
  for (const char* bad : {"\xe9", "\xc0\x80", "\xe0\x80\x80", "\xed\xa0\x80", "\xf4\x90\x80\x80", "\xff",
                          "a\xc3", "\xe2\x82", "\xf0\x9f\x90", "\x80"})
    EXPECT_FALSE(is_utf8(bad)) << bad;
  EXPECT_EQ(format::clean_name("caf\xe9"), "caf\xef\xbf\xbd");
  EXPECT_EQ(format::clean_name(std::string_view("a\0b", 3)), "a\xef\xbf\xbd\x62");
  EXPECT_EQ(format::clean_name("\u00e9t\u00e9"), "\u00e9t\u00e9");
}

TEST(RoundTrip, SameBytes) {
  for (uint64_t seed = 0; seed < 40; ++seed) {
    test::RandomAssetOptions options;
    options.objects = 1 + uint32_t(seed % 5);
    options.instances = uint32_t(seed % 4);
    options.bvhs = uint32_t(seed % 3);
    options.sphericals = uint32_t(seed % 4);
    options.exacts = uint32_t(seed / 2 % 3);
    options.proofs = uint32_t(seed / 3 % 2);
    options.primaries = uint32_t(seed / 4 % 4);
    options.sources = uint32_t(seed / 2 % 3);
    options.colors = uint32_t(seed / 3 % 3);
    options.skins = uint32_t(seed / 2 % 3);
    options.translations = seed % 5 == 2;
    if (seed % 6 == 5) options.objects = 0;
    options.places_nothing = seed % 8 == 4;
    format::Asset asset = test::random_asset(seed, options);
    if (seed % 3 == 0) asset.metadata.clear();
    if (seed % 7 == 0) asset.objects[0].name.clear();
    const auto once = format::encode(asset);
    EXPECT_EQ(once, format::encode(asset));
    const AssetView view = format::read_asset(once, "once");
    EXPECT_EQ(view.places_nothing, options.places_nothing && options.instances == 0);
    EXPECT_EQ(once, format::encode(format::to_asset(view))) << "seed " << seed;
  }
}

TEST(RoundTrip, KeepsEveryField) {
  const format::Asset asset = test::random_asset(11);
  const auto bytes = format::encode(asset);
  const AssetView view = format::read_asset(bytes, "file");
  EXPECT_EQ(view.metadata, asset.metadata);
  ASSERT_EQ(view.objects.size(), asset.objects.size());
  for (size_t i = 0; i < asset.objects.size(); ++i) {
    const format::Object& object = asset.objects[i];
    const format::ObjectView& seen = view.objects[i];
    EXPECT_EQ(seen.name, object.name);
    EXPECT_EQ(seen.name.data()[seen.name.size()], '\0');
    EXPECT_EQ(seen.aabb_min, object.aabb_min);
    EXPECT_EQ(seen.aabb_max, object.aabb_max);
    EXPECT_EQ(seen.bias, object.bias);
    EXPECT_EQ(seen.triangle_count, object.triangle_count);
    EXPECT_EQ(seen.network->mlp, object.network->mlp);
  }
  ASSERT_EQ(view.instances.size(), asset.instances.size());
  for (size_t i = 0; i < asset.instances.size(); ++i) {
    EXPECT_EQ(view.instances[i].name, asset.instances[i].name);
    EXPECT_EQ(view.instances[i].object, asset.instances[i].object);
    EXPECT_EQ(view.instances[i].transform, asset.instances[i].transform);
  }
}

TEST(RoundTrip, BlocksAreAligned) {
  const auto bytes = format::encode(test::random_asset(5));
  const AssetView view = format::read_asset(bytes, "file");
  const auto offset = [&](const void* p) {
    return uint64_t(static_cast<const std::byte*>(p) - bytes.data());
  };
  for (const format::ObjectView& object : view.objects) {
    const kernels::SegmentField& field = object.as<kernels::SegmentField>();
    EXPECT_EQ(offset(field.brick_states) % format::kAlignment, 0u);
    EXPECT_EQ(offset(field.features) % format::kAlignment, 0u);
    EXPECT_EQ(offset(field.network.layers[0].biases) % format::kAlignment, 0u);
  }
}

TEST(RoundTrip, SameAnswers) {
  uint64_t open = 0;
  for (uint64_t seed = 100; seed < 120; ++seed) {
    const format::Asset asset = test::random_asset(seed);
    const auto bytes = format::encode(asset);
    const AssetView view = format::read_asset(bytes, "file");
    test::Random random(seed);
    for (size_t i = 0; i < asset.objects.size(); ++i) {
      const auto field = std::get<kernels::SegmentField>(format::field_of(asset, asset.objects[i]));
      for (int ray = 0; ray < 1000; ++ray) {
        const kernels::Segment segment = test::random_segment(random, field);
        const kernels::Answer ours = kernels::query(field, segment);
        const kernels::Answer theirs = kernels::query(view.objects[i].as<kernels::SegmentField>(), segment);
        ASSERT_EQ(ours.visible, theirs.visible);
        ASSERT_EQ(ours.certain, theirs.certain);
        ASSERT_EQ(ours.logit, theirs.logit);
        open += ours.logit != kernels::kCertainLogit && ours.logit != -kernels::kCertainLogit;
      }
    }
  }
  EXPECT_GT(open, 1000u);
}

TEST(Writer, RefusesWhatTheReaderWould) {
  const format::Asset good = test::random_asset(3);
  const auto refused = [&](auto&& change) {
    format::Asset asset = good;
    change(asset);
    try {
      format::encode(asset);
    } catch (const Error& error) {
      return error.status() == Status::internal;
    }
    return false;
  };
  EXPECT_FALSE(refused([](auto&) {}));
  EXPECT_TRUE(refused([](auto& a) { a.objects.clear(); }));
  EXPECT_TRUE(refused([](auto& a) { a.objects[0].name = "\xff"; }));
  EXPECT_TRUE(refused([](auto& a) { a.objects[0].network->features.pop_back(); }));
  EXPECT_TRUE(refused([](auto& a) { a.objects[0].planes->brick_table.pop_back(); }));
  EXPECT_TRUE(refused([](auto& a) { a.objects[0].network->mlp = 9; }));
  EXPECT_TRUE(refused([](auto& a) { a.objects[0].planes->voxels[1] = 513; }));
  EXPECT_TRUE(refused([](auto& a) { a.mlps[0].layers[0].weights[0] = -128; }));
  EXPECT_TRUE(refused([](auto& a) { a.mlps[0].layers.clear(); }));
  EXPECT_TRUE(refused([](auto& a) { a.mlps[0].layers.resize(9); }));
  EXPECT_TRUE(refused([](auto& a) { a.instances[0].object = 9; }));
}

}  // namespace
}  // namespace nif
