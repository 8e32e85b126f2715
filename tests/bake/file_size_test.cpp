// Predicts the size of a file as parts are added and removed, which is how a bake keeps to its limit of
// bytes.
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
    for (const format::Asset& part : parts_of(whole)) size.add(format::section_bytes(part));
    EXPECT_GE(size.bytes(), bytes);
    EXPECT_LT(size.bytes(), bytes + format::kAlignment);
  }
}

TEST(FileSize, ForgetsPartsThatGo) {
  RandomAssetOptions options;
  options.bvhs = 2;
  const std::vector<format::Asset> parts = parts_of(random_asset(3, options));
  format::FileSize fields, all;
  for (const format::Asset& part : parts) {
    all.add(format::section_bytes(part));
    if (part.objects.empty() || part.objects[0].network) fields.add(format::section_bytes(part));
  }
  EXPECT_GT(all.bytes(), fields.bytes());
  for (const format::Asset& part : parts)
    if (!part.objects.empty() && part.objects[0].triangles) all.remove(format::section_bytes(part));
  EXPECT_EQ(all.bytes(), fields.bytes());
}

}  // namespace
}  // namespace nif::test
