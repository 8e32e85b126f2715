// Cut-out trees and the forest: what is written is read back with holes; triangles, bytes and pictures are what they claim.
#include "mesh/generate/cutout_tree.hpp"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <set>

#include "formats/base/random.hpp"
#include "formats/base/status.hpp"
#include "formats/mesh/box.hpp"
#include "formats/mesh/gltf/gltf_writer.hpp"
#include "formats/mesh/image.hpp"
#include "formats/mesh/read.hpp"
#include "formats/mesh/transform.hpp"
#include "mesh/generate/forest.hpp"
#include "mesh/generate/png.hpp"
#include "tests/support/surfaces.hpp"
#include "tests/support/temp_dir.hpp"
#include "tests/support/test_shapes.hpp"

namespace nif::generate {
namespace {

std::string text_of(const std::vector<std::byte>& bytes) {
  return std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size());
}

mesh::Scene read_back(const PaintedScene& made) {
  const test::TempDir folder;
  mesh::ReadLimits limits;
  limits.alpha.read = true;
  return mesh::read(folder.write("scene.glb", text_of(mesh::encode_glb(made.scene, &made.paint))), limits);
}

using Texels = std::vector<std::array<uint8_t, 4>>;

void expect_decoded(uint32_t width, uint32_t height, const Texels& texels) {
  const std::string png = text_of(encode_png(width, height, texels));
  uint64_t budget = mesh::detail::kMostTexels;
  std::string why;
  const auto colours = mesh::detail::decode_image(png, budget, why);
  const auto alpha = mesh::detail::decode_alpha(png, budget, why);
  ASSERT_TRUE(colours && alpha) << why;
  ASSERT_EQ(colours->width, width);
  ASSERT_EQ(colours->height, height);
  for (size_t i = 0; i < texels.size(); ++i) {
    for (size_t c = 0; c < 3; ++c) ASSERT_EQ(colours->texels[3 * i + c], texels[i][c]) << i;
    ASSERT_EQ(alpha->alpha[i], texels[i][3] * 257) << i;
  }
}

TEST(Png, IsDecodedAsTheTexelsThatItWasMadeFrom) {
  Random random(1, 2, 3);
  for (const auto& [width, height] :
       {std::pair{1u, 1u}, {2, 3}, {7, 1}, {1, 9}, {64, 64}, {333, 100}, {2000, 40}})
    for (const uint32_t values : {1u, 2u, 5u, 256u}) {
      SCOPED_TRACE(testing::Message() << width << " x " << height << ", " << values << " values");
      Texels texels(size_t{width} * height);
      for (auto& texel : texels)
        for (uint8_t& value : texel) value = uint8_t(random.below(values) * 255 / values);
      expect_decoded(width, height, texels);
      // Long runs, of every length up to what deflate can repeat and beyond.
      uint32_t run = 0;
      for (size_t i = 0, left = 0; i < texels.size(); ++i, --left) {
        if (left == 0) left = ++run;
        if (left != run) texels[i] = texels[i - 1];
      }
      expect_decoded(width, height, texels);
    }
}

TEST(Png, RepetitionsOfAllDistancesAreDecoded) {
  Random random(4, 5, 6);
  Texels texels(size_t{512} * 128);
  for (size_t i = 0; i < texels.size(); ++i) {
    const auto back = size_t(random.below(9000));
    texels[i] = back > 0 && back < i && random.below(9) != 0
                    ? texels[i - back]
                    : std::array<uint8_t, 4>{uint8_t(random.bits()), 1, 2, uint8_t(random.bits())};
  }
  expect_decoded(512, 128, texels);
}

TEST(Twigs, CoverAboutAThirdOfTheirPictures) {
  for (size_t kind = 0; kind < kTreeKinds; ++kind)
    for (const uint64_t seed : {1, 2}) {
      SCOPED_TRACE(testing::Message() << tree_kind(kind).name << ", seed " << seed);
      uint64_t budget = mesh::detail::kMostTexels;
      std::string why;
      const auto picture =
          mesh::detail::decode_alpha(text_of(draw_twigs(tree_kind(kind).foliage, seed)), budget, why);
      ASSERT_TRUE(picture) << why;
      ASSERT_EQ(picture->width, kPictureSide);
      constexpr uint32_t kSide = kPictureSide / kTwigs;
      std::array<uint32_t, kTwigs * kTwigs> blocking{};
      for (uint32_t y = 0; y < kPictureSide; ++y)
        for (uint32_t x = 0; x < kPictureSide; ++x) {
          const bool blocks = picture->alpha[size_t{y} * kPictureSide + x] >= 32768;
          blocking[y / kSide * kTwigs + x / kSide] += blocks;
          const bool at_border = x % kSide == 0 || x % kSide == kSide - 1 || y % kSide == 0;
          ASSERT_FALSE(blocks && at_border) << x << ' ' << y << ": neighbours show";
        }
      for (const uint32_t texels : blocking) {
        EXPECT_GT(texels, 0.15 * kSide * kSide);
        EXPECT_LT(texels, 0.6 * kSide * kSide);
      }
    }
}

TEST(CutoutTree, IsReadBackWithHoles) {
  const PaintedScene made = make_cutout_tree({5'000, 3});
  const mesh::Scene read = read_back(made);
  EXPECT_TRUE(read.notes.empty()) << read.notes[0].text;
  ASSERT_EQ(read.meshes.size(), 1u);
  const mesh::Mesh &mesh = read.meshes[0], &tree = made.scene.meshes[0];
  EXPECT_EQ(mesh.positions, tree.positions);
  EXPECT_EQ(mesh.triangles, tree.triangles);
  ASSERT_EQ(mesh.alpha_maps.size(), 1u);
  EXPECT_EQ(mesh.alpha_maps[0]->width, kPictureSide);
  ASSERT_EQ(mesh.holes.size(), tree.triangles.size());
  size_t twigs = 0;
  for (size_t i = 0; i < mesh.holes.size(); ++i) {
    const bool twig = tree.look.materials[i] == 1;
    twigs += twig;
    ASSERT_EQ(mesh.holes[i].any(), twig) << i;
    ASSERT_EQ(mesh.alpha[i], twig ? mesh::TriangleAlpha::cut : mesh::TriangleAlpha::solid) << i;
  }
  EXPECT_GE(twigs, tree.triangles.size() * 3 / 4) << "leaves get the most";
  ASSERT_EQ(read.see_through.size(), 1u);
  EXPECT_EQ(read.see_through[0].name, "oak-twigs");
  EXPECT_EQ(read.see_through[0].cut, twigs);
  EXPECT_EQ(read.see_through[0].filled, 0u);
}

TEST(CutoutTree, HasClosedLimbs) {
  for (size_t kind = 0; kind < kTreeKinds; ++kind) {
    SCOPED_TRACE(tree_kind(kind).name);
    mesh::Mesh limbs = make_cutout_mesh(tree_kind(kind), {20'000, 2});
    const auto twigs = std::ranges::find(limbs.look.materials, 1u) - limbs.look.materials.begin();
    limbs.triangles.resize(size_t(twigs));
    uint32_t last = 0;
    for (const mesh::Triangle& t : limbs.triangles) last = std::max({last, t[0], t[1], t[2]});
    limbs.positions.resize(last + 1);
    test::expect_closed(limbs);
    for (const mesh::Mesh& surface : test::surfaces(limbs)) EXPECT_GT(test::signed_volume(surface), 0);
  }
}

TEST(CutoutTree, HasAsManyTrianglesAsItMay) {
  for (size_t kind = 0; kind < kTreeKinds; ++kind)
    for (const uint64_t triangles : {100, 150, 999, 1'000, 8'000, 10'000, 123'457}) {
      const mesh::Mesh tree = make_cutout_mesh(tree_kind(kind), {triangles, 1});
      EXPECT_LE(tree.triangles.size(), triangles);
      EXPECT_GE(double(tree.triangles.size()), 0.95 * double(triangles)) << tree_kind(kind).name;
      for (const mesh::Float3& p : tree.positions)
        for (const float x : p) ASSERT_TRUE(std::abs(x) < 25) << triangles;  // also false for NaN
    }
  for (const uint64_t triangles : {uint64_t{0}, kFewestTriangles - 1, kMostTriangles + 1}) {
    try {
      make_cutout_tree({triangles, 1});
      ADD_FAILURE() << triangles;
    } catch (const Error& error) {
      EXPECT_EQ(error.status(), Status::usage);
    }
  }
}

TEST(CutoutTree, DependsOnTheRequestAlone) {
  const auto bytes = [](const Request& request, size_t threads) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    const PaintedScene made = make_cutout_tree(request);
    return mesh::encode_glb(made.scene, &made.paint);
  };
  const auto once = bytes({3'000, 1}, 1);
  EXPECT_TRUE(once == bytes({3'000, 1}, 4));
  EXPECT_FALSE(once == bytes({3'000, 2}, 4));
  EXPECT_FALSE(once == bytes({3'000, uint64_t{1} << 40}, 4));
}

TEST(Forest, IsReadBackWithHoles) {
  const PaintedScene made = make_forest({300, 5});
  const mesh::Scene read = read_back(made);
  EXPECT_TRUE(read.notes.empty()) << read.notes[0].text;
  ASSERT_EQ(read.meshes.size(), 1 + kTreeKinds);
  EXPECT_EQ(read.meshes[0].name, "ground");
  EXPECT_TRUE(read.meshes[0].holes.empty());
  for (size_t m = 1; m < read.meshes.size(); ++m) {
    const mesh::Mesh& tree = read.meshes[m];
    SCOPED_TRACE(tree.name);
    EXPECT_EQ(tree.name, tree_kind(m - 1).name);
    EXPECT_LE(tree.triangles.size(), kForestTreeTriangles);
    EXPECT_TRUE(tree.positions == made.scene.meshes[m].positions);
    EXPECT_TRUE(tree.triangles == made.scene.meshes[m].triangles);
    EXPECT_EQ(tree.alpha_maps.size(), 1u);
    const auto cut = std::ranges::count_if(tree.holes, &mesh::TriangleHoles::any);
    EXPECT_GE(size_t(cut), tree.triangles.size() * 3 / 4);
  }
  ASSERT_EQ(read.instances.size(), 300u);
  for (size_t i = 0; i < read.instances.size(); ++i) {
    EXPECT_EQ(read.instances[i].name, made.scene.instances[i].name);
    EXPECT_EQ(read.instances[i].transform, made.scene.instances[i].transform);
  }
  EXPECT_EQ(read.cameras.size(), 3u);
}

TEST(Forest, HasAsManyInstancesAsItIsAskedFor) {
  for (const auto& [instances, seed] : {std::pair{kForestFewestInstances, 1u}, {101u, 2u}, {4'321u, 3u}}) {
    SCOPED_TRACE(testing::Message() << instances << " instances, seed " << seed);
    const mesh::Scene forest = make_forest({instances, seed}).scene;
    ASSERT_EQ(forest.instances.size(), instances);
    std::set<uint32_t> used;
    std::set<std::string> names;
    for (const mesh::Instance& instance : forest.instances) {
      used.insert(instance.mesh);
      names.insert(instance.name);
      EXPECT_GT(mesh::determinant(instance.transform), 0.1) << instance.name;
    }
    EXPECT_EQ(used.size(), forest.meshes.size());
    EXPECT_EQ(names.size(), instances);
  }
  for (const uint32_t instances : {0u, kForestFewestInstances - 1, kForestMostInstances + 1}) {
    try {
      make_forest({instances, 1});
      ADD_FAILURE() << instances;
    } catch (const Error& error) {
      EXPECT_EQ(error.status(), Status::usage);
    }
  }
}

// A foot that floats or is buried would show in every picture.
TEST(Forest, TreesStandOnItsGround) {
  const mesh::Scene forest = make_forest({500, 4}).scene;
  test::expect_closed(forest.meshes[0]);
  const std::vector<mesh::Float3>& ground = forest.meshes[0].positions;
  const auto stands = [&](const mesh::Instance& tree) {
    return std::ranges::any_of(forest.instances, [&](const mesh::Instance& plot) {
      if (plot.mesh != 0) return false;
      const float x = tree.transform[3] - plot.transform[3], z = tree.transform[11] - plot.transform[11];
      return std::ranges::any_of(ground, [&](const mesh::Float3& p) {
        return std::abs(p[0] - x) < 0.7f && std::abs(p[2] - z) < 0.7f &&
               std::abs(p[1] - tree.transform[7]) < 0.4f;
      });
    });
  };
  for (const mesh::Instance& instance : forest.instances)
    EXPECT_TRUE(instance.mesh == 0 || stands(instance)) << instance.name;
}

TEST(Forest, DependsOnTheRequestAlone) {
  const auto bytes = [](const ForestRequest& request, size_t threads) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    const PaintedScene made = make_forest(request);
    return mesh::encode_glb(made.scene, &made.paint);
  };
  const auto once = bytes({200, 1}, 1);
  EXPECT_TRUE(once == bytes({200, 1}, 4));
  EXPECT_FALSE(once == bytes({200, 2}, 4));
}

}  // namespace
}  // namespace nif::generate
