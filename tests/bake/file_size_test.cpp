// Predicts the size of a file while its parts still change, which is how a bake keeps to its limit of bytes.
#include <gtest/gtest.h>

#include <set>

#include "formats/nif/layout.hpp"
#include "formats/nif/writer.hpp"
#include "tests/support/random_asset.hpp"

namespace nif::test {
namespace {

/// The instances, then each object alone with the networks that no earlier object uses.
std::vector<format::Asset> parts_of(const format::Asset& whole) {
  std::vector<format::Asset> parts(1);
  parts[0].instances = whole.instances;
  std::set<uint32_t> known;
  for (const format::Object& object : whole.objects) {
    format::Asset& part = parts.emplace_back();
    part.objects = {object};
    if (object.network) part.mlps = {whole.mlps[object.network->mlp]};
    if (!object.spherical) continue;
    const uint32_t network = object.spherical->network;
    if (known.insert(network).second) part.spherical_networks = {whole.spherical_networks[network]};
  }
  return parts;
}

TEST(FileSize, IsThatOfTheFileUpToOneAlignment) {
  for (const auto& [objects, bvhs, sphericals] :
       {std::array{5u, 0u, 0u}, {0u, 4u, 0u}, {0u, 0u, 3u}, {4u, 3u, 3u}}) {
    RandomAssetOptions options;
    options.objects = objects, options.bvhs = bvhs, options.sphericals = sphericals;
    options.primaries = sphericals;
    format::Asset whole = random_asset(objects + bvhs, options);
    whole.metadata.clear();
    const uint64_t bytes = format::encoded_bytes(whole);
    ASSERT_EQ(bytes, format::encode(whole).size());
    format::FileSize size;
    const std::vector<format::Asset> parts = parts_of(whole);
    for (size_t i = 0; i < parts.size(); ++i) size.set(i, format::section_bytes(parts[i]));
    EXPECT_GE(size.bytes(), bytes);
    EXPECT_LT(size.bytes(), bytes + format::kAlignment);
  }
}

TEST(FileSize, ForgetsWhatAPartWasBefore) {
  RandomAssetOptions options;
  options.bvhs = 2;
  const std::vector<format::Asset> parts = parts_of(random_asset(3, options));
  format::FileSize all, twice, fields;
  for (size_t i = 0; i < parts.size(); ++i) {
    const format::SectionBytes bytes = format::section_bytes(parts[i]);
    all.set(i, bytes);
    twice.set(i, format::section_bytes(parts.back()));
    twice.set(i, bytes);
    if (parts[i].objects.empty() || parts[i].objects[0].network) fields.set(i, bytes);
  }
  EXPECT_EQ(twice.bytes(), all.bytes());
  EXPECT_GT(all.bytes(), fields.bytes());
  for (size_t i = 0; i < parts.size(); ++i)
    if (!parts[i].objects.empty() && parts[i].objects[0].triangles) all.set(i, {});
  EXPECT_EQ(all.bytes(), fields.bytes());
}

}  // namespace
}  // namespace nif::test
