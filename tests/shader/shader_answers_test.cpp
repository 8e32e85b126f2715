// Shaders answer with the bits of the CPU: random objects and all golden ones, with random rays and odd ones.
#include <cmath>
#include <filesystem>
#include <limits>
#include <map>

#include "formats/nif/file_memory.hpp"
#include "formats/nif/writer.hpp"
#include "kernels/shader/shader_tables.hpp"
#include "tests/golden/golden.hpp"
#include "tests/shader/shader_fixture.hpp"
#include "tests/support/query_object.hpp"
#include "tests/support/row_of_voxels.hpp"

namespace nif::test {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity(),
                kNaN = std::numeric_limits<float>::quiet_NaN();

/// A ray that something is odd about.
kernels::Segment odd_segment(Random& random, const kernels::PlanesField& field) {
  kernels::Segment ray = random_segment(random, field);
  const uint32_t a = random.below(3), b = random.below(3);
  const float values[] = {kNaN,     -kNaN,     kInfinity, -kInfinity, 0.0f,      -0.0f,
                          1e-45f,   -1e-45f,   0x1p-60f,  0x1p60f,    0x1.8p61f, 3.4e38f,
                          -3.4e38f, 0x1p-126f, 0x1p-61f,  1.0f,       -1.0f,     1e-20f};
  const float value = values[random.below(uint32_t(std::size(values)))];
  switch (random.below(12)) {
    case 0:
      ray.origin[a] = value;
      break;
    case 1:
      ray.direction[a] = value;
      break;
    case 2:
      ray.tmin = value;
      break;
    case 3:
      ray.tmax = value;
      break;
    case 4:
      ray.tmin = ray.tmax = value;
      break;
    case 5:
      ray.direction[a] = ray.direction[b] = value;
      break;
    case 6:
      ray.direction[a] *= 0x1p-41f;
      break;
    case 7:
      for (float& d : ray.direction) d *= random.below(2) ? 0x1p-59f : 0x1p59f;
      break;
    case 8:
      std::swap(ray.tmin, ray.tmax);
      break;
    case 9:  // along two planes of the grid
      ray.direction[a] = ray.direction[b] = 0;
      ray.origin[a] =
          field.origin[a] + static_cast<float>(random.below(2) * field.voxels[a]) / field.voxels_per_unit;
      break;
    default: {  // the same line, from so far away
      const float back = std::ldexp(1.0f, random.between(4, 30));
      for (size_t axis = 0; axis < 3; ++axis) ray.origin[axis] -= ray.direction[axis] * back;
      ray.tmin = 0;
      ray.tmax = kInfinity;
    }
  }
  return ray;
}

class ShaderAnswers : public ShaderTest {
 protected:
  nifkit::Device device_{"shaders=on"};

  /// Compares random and odd rays through each object of an asset that shaders take; returns how many do.
  size_t compare_objects(const std::vector<std::byte>& file, uint64_t seed, size_t rays) {
    const format::AssetView view = format::read_asset(file, "test");
    const nifkit::Asset asset = nifkit::Asset::load(device_, std::span<const std::byte>(file));
    size_t objects = 0;
    for (uint32_t i = 0; i < view.objects.size(); ++i) {
      uint64_t count = 0;
      if (nifGetShaderTables(asset.get(), i, nullptr, 0, &count) != NIF_OK) continue;
      ++objects;
      // Behind words that are not its own, as in a buffer of several objects.
      std::vector<uint32_t> words(7 * i, 0xdeadbeefu);
      const uint32_t object = uint32_t(words.size());
      const std::vector<uint32_t> tables = asset.shader_tables(i);
      words.insert(words.end(), tables.begin(), tables.end());
      std::visit(
          [&]<class Field>(const Field& field) {
            if constexpr (std::is_base_of_v<kernels::PlanesField, Field> &&
                          !std::is_base_of_v<kernels::TrianglesField, Field>) {
              Random random(seed + i);
              std::vector<kernels::Segment> segments;
              for (size_t k = 0; k < rays; ++k)
                segments.push_back(k % 4 == 0 ? odd_segment(random, field) : random_segment(random, field));
              const Differences found = compare(field, words, object, segments, "wide");
              EXPECT_EQ(found.all() + found.probability, 0u) << "object " << i << ": " << found << "";
            }
          },
          format::field_of(view.objects[i]));
    }
    return objects;
  }
};

TEST_F(ShaderAnswers, OfRandomObjectsAreTheCpus) {
  size_t objects = 0;
  for (uint64_t seed = 1; seed <= 6; ++seed)
    objects += compare_objects(
        format::encode(random_asset(seed, {.objects = 2, .instances = 1, .proofs = 1, .features = 2})), seed,
        5000);
  EXPECT_EQ(objects, 18u);
}

TEST_F(ShaderAnswers, OfGoldenObjectsAreTheGoldenOnes) {
  size_t compared = 0;
  for (const auto& entry : std::filesystem::directory_iterator(NIF_GOLDEN_FOLDER)) {
    std::filesystem::path path = entry.path();
    if (path.extension() != ".nif") continue;
    SCOPED_TRACE(path.string());
    const nifkit::Asset asset = nifkit::Asset::load(device_, path.string());
    std::ifstream file(path.replace_extension(".answers"), std::ios::binary);
    std::map<uint32_t, std::vector<GoldenAnswer>> of_object;
    for (GoldenAnswer golden; file.read(reinterpret_cast<char*>(&golden), sizeof(golden));)
      of_object[golden.object].push_back(golden);
    for (const auto& [object, answers] : of_object) {
      uint64_t count = 0;
      if (nifGetShaderTables(asset.get(), object, nullptr, 0, &count) != NIF_OK) continue;
      std::vector<kernels::Segment> rays;
      for (const GoldenAnswer& golden : answers) rays.push_back(golden.ray);
      const std::vector<uint32_t> words = asset.shader_tables(object);
      const bool triangles = (words[kernels::shader::kFlags] & kernels::shader::kHasTriangles) != 0;
      const auto shader = ask_shader(*vulkan_, shader_code("wide"), words, 0, rays);
      for (size_t i = 0; i < rays.size(); ++i) {
        if (triangles && !shader[i].certain) continue;
        ++compared;
        EXPECT_EQ(shader[i].visible, answers[i].visible) << object << ", ray " << i;
        EXPECT_EQ(shader[i].certain, answers[i].certain) << object << ", ray " << i;
        EXPECT_EQ(shader[i].logit, answers[i].logit) << object << ", ray " << i;
      }
    }
  }
  EXPECT_GT(compared, 1000u);
}

TEST_F(ShaderAnswers, MayHaveManyIntervals) {
  const auto file = format::encode(asset_of_a_row(8));
  const format::AssetView view = format::read_asset(file, "test");
  const nifkit::Asset asset = nifkit::Asset::load(device_, std::span<const std::byte>(file));
  const auto field = view.objects[0].as<kernels::SegmentField>();
  Random random(9);
  std::vector<kernels::Segment> rays;
  for (const NifRay& ray : rays_in_a_row(random, field, 2000))
    rays.push_back({{ray.origin[0], ray.origin[1], ray.origin[2]},
                    {ray.direction[0], ray.direction[1], ray.direction[2]},
                    ray.tmin,
                    ray.tmax});
  const Differences found = compare(field, asset.shader_tables(0), 0, rays, "wide");
  EXPECT_GT(found.uncertain, 1000u);
  EXPECT_EQ(found.all() + found.probability, 0u) << found;
}

/// An object of a file, with random rays through it; one in four is odd.
struct RaysOfObject {
  std::vector<std::byte> file;
  format::AssetView view;
  kernels::SegmentField field;
  std::vector<uint32_t> words;
  std::vector<kernels::Segment> rays;

  RaysOfObject(const nifkit::Device& device, uint64_t seed, bool proves_nothing = false)
      : file(format::encode(random_asset(
            seed, {.objects = 1, .instances = 1, .features = 2, .proves_nothing = proves_nothing}))),
        view(format::read_asset(file, "test")),
        field(view.objects[0].as<kernels::SegmentField>()),
        words(nifkit::Asset::load(device, std::span<const std::byte>(file)).shader_tables(0)) {
    Random random(seed);
    for (size_t k = 0; k < 8000; ++k)
      rays.push_back(k % 4 == 0 ? odd_segment(random, field) : random_segment(random, field));
  }
};

TEST_F(ShaderAnswers, AreProvenOnlyNearByUnlessTheArithmeticIsKnown) {
  const RaysOfObject all(device_, 1);
  const auto known = ask_shader(*vulkan_, shader_code("wide"), all.words, 0, all.rays);
  const auto shader = ask_shader(*vulkan_, shader_code("default"), all.words, 0, all.rays);
  size_t proven = 0, fewer = 0;
  for (size_t i = 0; i < all.rays.size(); ++i) {
    float reach = 0;
    for (size_t a = 0; a < 3; ++a)
      reach =
          std::max(reach, std::abs(all.rays[i].origin[a] - all.field.origin[a]) * all.field.cells_per_unit);
    EXPECT_EQ(shader[i].certain, known[i].certain && !(reach > 8192 && all.rays[i].tmin <= all.rays[i].tmax));
    if (all.words[21] <= 12) {
      EXPECT_EQ(shader[i].visible, known[i].visible);
      EXPECT_EQ(shader[i].logit, known[i].logit);
    }
    proven += shader[i].certain;
    fewer += known[i].certain && !shader[i].certain;
  }
  EXPECT_GT(proven, 2000u);
  EXPECT_GT(fewer, 10u);
}

TEST_F(ShaderAnswers, LeaveOpenWhatTheShaderHasNoRoomFor) {
  const RaysOfObject all(device_, 2);
  ASSERT_GT(all.words[21], 4u);
  size_t open = 0;
  const auto shader = ask_shader(*vulkan_, shader_code("small"), all.words, 0, all.rays);
  for (size_t i = 0; i < all.rays.size(); ++i) {
    const kernels::Answer answer = kernels::query(all.field, all.rays[i]);
    if (shader[i].logit == kernels::kOpenLogit) {
      ++open;
      EXPECT_FALSE(answer.certain);
      EXPECT_EQ(shader[i].visible + shader[i].certain, 0u);
    } else {
      EXPECT_EQ(shader[i].logit, answer.logit);
    }
  }
  EXPECT_GT(open, 1000u);
}

TEST_F(ShaderAnswers, AreNeverCertainIfTheFileProvesNothing) {
  const RaysOfObject all(device_, 1, true);
  for (const ShaderAnswer& answer : ask_shader(*vulkan_, shader_code("wide"), all.words, 0, all.rays))
    EXPECT_EQ(answer.certain, 0u);
}

TEST_F(ShaderAnswers, LeaveOpenWhatAreNoTables) {
  RaysOfObject all(device_, 1);
  all.rays.resize(200);
  for (const uint32_t wrong : {0u, 1u}) {
    std::vector<uint32_t> words = all.words;
    words[wrong] = wrong == 0 ? 0x4e494653u : 3u;  // the other byte order, a later version
    for (const ShaderAnswer& answer : ask_shader(*vulkan_, shader_code("query"), words, 0, all.rays)) {
      EXPECT_EQ(answer.visible + answer.certain, 0u);
      EXPECT_EQ(answer.logit, kernels::kOpenLogit);
    }
  }
}

TEST_F(ShaderAnswers, ByTheDevicesDotProductsAreTheCpus) {
  if (!vulkan_->has_dot_products()) GTEST_SKIP() << "VK_KHR_shader_integer_dot_product is missing";
  for (const uint64_t seed : {1, 2, 3}) {
    const RaysOfObject all(device_, seed);
    const Differences found = compare(all.field, all.words, 0, all.rays, "wide_dot4");
    EXPECT_EQ(found.all() + found.probability, 0u) << found;
  }
}

TEST_F(ShaderAnswers, InHlslAreTheCpus) {
  for (const uint64_t seed : {1, 2, 3}) {
    const RaysOfObject all(device_, seed);
    const Differences found = compare(all.field, all.words, 0, all.rays, "wide_hlsl", "prove_hlsl");
    EXPECT_EQ(found.all() + found.probability, 0u) << found;
  }
}

}  // namespace
}  // namespace nif::test
