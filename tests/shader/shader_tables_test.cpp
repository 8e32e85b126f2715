// nifGetShaderTables: what it writes, and what it refuses with which sentence.
#include <algorithm>

#include "formats/nif/writer.hpp"
#include "kernels/packed/traversal_grid.hpp"
#include "kernels/shader/shader_tables.hpp"
#include "kernels/shader/triangle_tree.hpp"
#include "tests/shader/shader_fixture.hpp"
#include "tests/support/random_asset.hpp"

namespace nif::test {
namespace {

using namespace kernels::shader;
using testing::Test;

class ShaderTables : public Test {
 protected:
  nifkit::Asset load(const format::Asset& made, const char* config = "shaders=on") {
    file_ = format::encode(made);
    return nifkit::Asset::load(nifkit::Device(config), std::span<const std::byte>(file_));
  }
  /// The sentence of a failure.
  std::string failure(const nifkit::Asset& asset, uint32_t object, NifError code) {
    uint64_t count = 7;
    EXPECT_EQ(nifGetShaderTables(asset.get(), object, nullptr, 0, &count), code);
    EXPECT_EQ(count, 7u);
    return nifGetErrorMessage();
  }
  std::vector<std::byte> file_;
};

TEST_F(ShaderTables, HaveAHeaderThatSaysWhatFollows) {
  const nifkit::Asset asset =
      load(random_asset(3, {.objects = 1, .instances = 1, .proofs = 1, .features = 2}));
  const format::AssetView view = format::read_asset(file_, "test");
  for (uint32_t i = 0; i < 2; ++i) {
    const std::vector<uint32_t> words = asset.shader_tables(i);
    const kernels::PlanesField& field = view.objects[i].planes->field;
    EXPECT_EQ(words[kMagicWord], kMagic);
    EXPECT_EQ(words[kVersionWord], kVersion);
    EXPECT_EQ(words[kWordCount], words.size());
    EXPECT_EQ(words[kFlags], (i == 0 ? uint32_t(kHasNetwork) : 0u) | kProves | kHasPlanes);
    EXPECT_EQ(words[kLevels], field.levels);
    EXPECT_EQ(words[kVoxelWords], kHeaderWords);
    EXPECT_EQ(words[kChildren], kHeaderWords + field.voxels[0] * field.voxels[1] * field.voxels[2]);
    for (uint32_t a = 0; a < 3; ++a) {
      EXPECT_EQ(words[kVoxels + a], field.voxels[a]);
      EXPECT_EQ(std::bit_cast<float>(words[kOrigin + a]), field.origin[a]);
      EXPECT_EQ(std::bit_cast<float>(words[kBounds + a]), view.objects[i].aabb_min[a]);
      EXPECT_EQ(std::bit_cast<float>(words[kBounds + 3 + a]), view.objects[i].aabb_max[a]);
    }
    EXPECT_EQ(std::bit_cast<float>(words[kBias]), view.objects[i].bias);
    if (i == 1) {
      EXPECT_EQ(words.size(), words[kChildren] + field.child_count);
    }
  }
}

/// Kernels keep such a grid in bricks; shaders have a word for each voxel.
TEST_F(ShaderTables, OfLargeGridsHaveAWordForEachVoxel) {
  constexpr uint32_t kSide = 64, kAll = kSide * kSide * kSide;
  static_assert(kAll * sizeof(uint32_t) > kernels::cpu::kMostWithoutBricks);
  format::Asset made = random_asset(3, {.objects = 0, .instances = 0, .proofs = 1});
  format::PlanesData& grid = *made.objects[0].planes;
  grid.voxels = {kSide, kSide, kSide};
  grid.levels = 0;
  const size_t bricks = format::bricks_for(kSide);
  grid.brick_table.assign(bricks * bricks * bricks, kernels::kBrickOutside);
  grid.brick_table[0] = kernels::kFirstMixedBrick;
  grid.brick_states.assign(1, {0b1, 0});
  format::leave_bare(grid);
  const std::vector<uint32_t> words = load(made).shader_tables(0);
  EXPECT_EQ(words.size(), kHeaderWords + kAll);
  EXPECT_EQ(words[kWordCount], words.size());
}

/// Walks a tree as a shader does.
TEST_F(ShaderTables, OfTrianglesAreATreeWithoutLinksBack) {
  const nifkit::Asset asset =
      load(random_asset(7, {.objects = 0, .instances = 0, .bvhs = 2, .exacts = 1, .sources = 1}));
  const format::AssetView view = format::read_asset(file_, "test");
  for (uint32_t i = 0; i < 3; ++i) {
    const std::vector<uint32_t> words = asset.shader_tables(i);
    EXPECT_EQ(words[kFlags], kProves | kHasTriangles | (i == 2 ? uint32_t(kHasPlanes) : 0u));
    const kernels::TrianglesField& field = view.objects[i].triangles->field;
    ASSERT_LT(words[kTree], words[kTreeEnd]);
    ASSERT_LE(words[kTreeEnd], words[kVertices]);
    EXPECT_EQ(words[kVertices] + 3 * field.vertex_count,
              words[kSourceBits] ? words[kSourceNumbers] : words.size());
    std::vector<uint32_t> seen(field.triangle_count);
    std::vector<uint32_t> open = {words[kTreeEnd]};  // where the walk goes on behind the boxes that it is in
    for (uint32_t at = words[kTree]; at < words[kTreeEnd];) {
      while (open.back() == at) open.pop_back();
      ASSERT_FALSE(open.empty());
      const uint32_t link = words[at + 3];
      if ((link & kTreeLeaf) == 0) {
        ASSERT_GT(words[kTree] + link, at + 4);
        ASSERT_LE(words[kTree] + link, open.back());
        open.push_back(words[kTree] + link);
        at += 4;
        continue;
      }
      const uint32_t count = link & ~kTreeLeaf;
      ASSERT_TRUE(count >= 1 && count <= 4);
      for (uint32_t k = 0; k < count; ++k) {
        const uint32_t triangle = words[at + 5] + k, corners = words[at + 6 + k];
        ASSERT_LT(triangle, field.triangle_count);
        ++seen[triangle];
        for (uint32_t c = 0; c < 3; ++c) {
          const uint32_t vertex = words[at + 4] + (corners >> (8 * c) & 255);
          ASSERT_LT(vertex, field.vertex_count);
          for (uint32_t a = 0; a < 3; ++a) {
            const uint32_t planes = words[at + a];
            const float x = std::bit_cast<float>(words[words[kVertices] + 3 * vertex + a]);
            const auto plane = [&](uint32_t step) {
              return double(std::bit_cast<float>(words[kTreeCorner + a])) +
                     double(step) * double(std::bit_cast<float>(words[kTreeStep + a]));
            };
            EXPECT_LT(plane(planes & 0xffff), double(x));
            EXPECT_GT(plane(planes >> 16), double(x));
          }
        }
      }
      at += 6 + count;
    }
    EXPECT_TRUE(std::all_of(seen.begin(), seen.end(), [](uint32_t times) { return times == 1; }));
  }
}

TEST_F(ShaderTables, AreTheSameByEveryDevice) {
  const format::Asset made = random_asset(4, {.objects = 1, .instances = 1, .features = 2});
  EXPECT_EQ(load(made, "shaders=on").shader_tables(0), load(made, "isa=scalar").shader_tables(0));
}

TEST_F(ShaderTables, OfAFileThatProvesNothingSaySo) {
  const nifkit::Asset asset =
      load(random_asset(5, {.objects = 1, .instances = 1, .features = 2, .proves_nothing = true}));
  EXPECT_EQ(asset.shader_tables(0)[kFlags], uint32_t(kHasNetwork | kHasPlanes));
}

TEST_F(ShaderTables, NeedRoom) {
  const nifkit::Asset asset = load(random_asset(3, {.objects = 1, .instances = 1, .features = 2}));
  uint64_t count = 0;
  ASSERT_EQ(nifGetShaderTables(asset.get(), 0, nullptr, 0, &count), NIF_OK);
  std::vector<uint32_t> words(count, 5u);
  uint64_t again = 9;
  EXPECT_EQ(nifGetShaderTables(asset.get(), 0, words.data(), count - 1, &again), NIF_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(std::string(nifGetErrorMessage()), "words: there is room for " + std::to_string(count - 1) +
                                                   " words, but the tables have " + std::to_string(count));
  EXPECT_EQ(again, 9u);
  EXPECT_TRUE(std::all_of(words.begin(), words.end(), [](uint32_t word) { return word == 5; }));
  EXPECT_EQ(nifGetShaderTables(asset.get(), 0, words.data(), count, &again), NIF_OK);
  EXPECT_EQ(again, count);
  EXPECT_EQ(words[kMagicWord], kMagic);
}

TEST_F(ShaderTables, AreRefusedInASentence) {
  const nifkit::Asset asset = load(
      random_asset(6, {.objects = 0, .instances = 0, .bvhs = 1, .sphericals = 1, .exacts = 1, .cutouts = 1}));
  constexpr const char* kEncodings[] = {"spherical", "cutout"};
  uint64_t count = 0;
  for (const char* encoding : kEncodings) {
    bool found = false;
    for (uint32_t i = 0; i < 4; ++i) {
      if (nifGetShaderTables(asset.get(), i, nullptr, 0, &count) == NIF_OK) continue;
      found = found || failure(asset, i, NIF_ERROR_NOT_AVAILABLE)
                               .find(std::string("has the encoding '") + encoding +
                                     "'; shaders answer 'segment', 'proof', 'bvh' and 'exact' only") !=
                           std::string::npos;
    }
    EXPECT_TRUE(found) << encoding;
  }
  EXPECT_NE(failure(asset, 4, NIF_ERROR_INVALID_ARGUMENT).find("no object 4"), std::string::npos);
  EXPECT_NE(failure(load(random_asset(6, {.objects = 1, .instances = 1, .features = 3})), 0,
                    NIF_ERROR_NOT_AVAILABLE)
                .find("do not have two features each"),
            std::string::npos);
  EXPECT_NE(failure(load(random_asset(6, {.objects = 1, .instances = 1, .features = 2, .odd_corners = true})),
                    0, NIF_ERROR_NOT_AVAILABLE)
                .find("touch no surface voxel"),
            std::string::npos);
  EXPECT_EQ(nifGetShaderTables(nullptr, 0, nullptr, 0, nullptr), NIF_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(nifGetShaderTables(asset.get(), 0, nullptr, 0, nullptr), NIF_ERROR_INVALID_ARGUMENT);
  EXPECT_STREQ(nifGetErrorMessage(), "count is null");
}

TEST_F(ShaderTables, NeedADeviceThatKeepsThem) {
  const nifkit::Asset asset = load(random_asset(3, {.objects = 1, .instances = 1, .features = 2}), "");
  if (std::string_view(nifkit::Device().info().isa) == "scalar") GTEST_SKIP() << "which keeps everything";
  EXPECT_NE(failure(asset, 0, NIF_ERROR_INVALID_OPERATION).find("make the device with shaders=on"),
            std::string::npos);
  NifDevice device = nullptr;
  EXPECT_EQ(nifNewDevice("shaders=yes", nullptr, &device), NIF_ERROR_INVALID_ARGUMENT);
}

TEST(ShaderSource, IsTheFile) {
  for (const auto& [name, language] : {std::pair("nif.glsl", NIF_SHADER_GLSL),
                                       {"nif.hlsl", NIF_SHADER_HLSL},
                                       {"nif.metal", NIF_SHADER_METAL},
                                       {"nif.wgsl", NIF_SHADER_WGSL}}) {
    std::ifstream file(std::string(NIF_SHADER_TEXTS "/") + name, std::ios::binary);
    const std::string text{std::istreambuf_iterator<char>(file), {}};
    EXPECT_GT(text.size(), 10'000u);
    EXPECT_EQ(text, nifkit::shader_source(language)) << name;
  }
  EXPECT_EQ(nifGetShaderSource(NifShaderLanguage(0)), nullptr);
}

}  // namespace
}  // namespace nif::test
