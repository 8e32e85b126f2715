// Rays of every named set through a baked field and its planes alone, answered by a shader as by the reference; and
// in looser arithmetic than Vulkan allows (rough.py), where no proof may be wrong. NIF_TEST_SEGMENTS says how many rays of each
// set instead of 100,000.
#include "formats/mesh/read.hpp"
#include "formats/nif/writer.hpp"
#include "kernels/reference/reference_encodings.hpp"
#include "kernels/shader/shader_tables.hpp"
#include "tests/gpu/baked.hpp"
#include "tests/shader/shader_fixture.hpp"
#include "tests/support/test_shapes.hpp"

namespace nif::test {
namespace {

class ShaderSets : public ShaderTest {
 protected:
  template <class Field>
  void expect_equal(const char* encoding) {
    const Baked baked(torus(60, 30), encoding);
    const nifkit::Asset asset =
        nifkit::Asset::load(nifkit::Device("shaders=on"), std::span<const std::byte>(baked.file));
    const std::vector<uint32_t> words = asset.shader_tables(0);
    const auto field = baked.view.objects[0].as<Field>();
    const bake::Prepared prepared = bake::prepare(baked.scene.meshes[0]);
    const bake::GroundTruth truth(prepared);
    uint64_t asked = 0;
    for (const bake::RaySet set : bake::kRaySets) {
      // As many rays at a time as any device has room for.
      constexpr uint64_t kMost = 500'000;
      for (uint64_t left = segments_wanted(100'000), seed = 7; left > 0; ++seed) {
        const uint64_t count = std::min(left, kMost);
        left -= count;
        const auto rays = bake::draw_ray_set(truth.source(), set, count, seed);
        const Differences found = compare(field, words, 0, rays.segments);
        EXPECT_EQ(found.all() + found.probability, 0u) << bake::name_of(set) << ": " << found;
        EXPECT_GT(found.uncertain, rays.segments.size() / 1000) << bake::name_of(set);
        asked += rays.segments.size();
      }
    }
    std::printf("%llu rays\n", static_cast<unsigned long long>(asked));
  }
};

TEST_F(ShaderSets, OfAFieldAreAnsweredAsByTheCpu) { expect_equal<kernels::SegmentField>("segment"); }
TEST_F(ShaderSets, OfPlanesAreAnsweredAsByTheCpu) { expect_equal<kernels::PlanesField>("proof"); }

/// By the grid of `balanced`; hardly trained, which does not change how large tables are.
TEST_F(ShaderSets, OfTheDragonTakeLittleMemory) {
  for (const std::filesystem::path& file : real_meshes()) {
    if (file.filename() != "stanford_dragon_871k.ply.gz") continue;
    bake::BakeOptions options;
    options.encoding = "segment";
    options.effort = 0.001;
    options.evaluation_rays = 0;
    const std::atomic<bool> cancel{false};
    const auto bytes = format::encode(bake::bake(mesh::read(file), options, {}, cancel).asset);
    const auto asset = nifkit::Asset::load(nifkit::Device("shaders=on"), std::span<const std::byte>(bytes));
    const size_t size = sizeof(uint32_t) * asset.shader_tables(0).size();
    RecordProperty("bytes", int(size));
    EXPECT_LE(size, 420'000u);
    return;
  }
  GTEST_SKIP() << "NIF_TEST_MESHES has no stanford_dragon_871k.ply.gz";
}

/// Real triangles: certain answers are the truth, in rough arithmetic too, and few are not certain.
TEST_F(ShaderSets, OfTrianglesAreProvenRight) {
  std::vector<mesh::Mesh> meshes = {torus(60, 30)};
  for (const std::filesystem::path& file : real_meshes(1'000'000))
    if (file.filename() != "soup_100.stl") meshes.push_back(mesh::read(file).meshes[0]);
  for (const mesh::Mesh& mesh : meshes)
    for (const char* encoding : {"bvh", "exact"}) {
      const Baked baked(mesh, encoding);
      const std::vector<uint32_t> words =
          nifkit::Asset::load(nifkit::Device("shaders=on"), std::span<const std::byte>(baked.file))
              .shader_tables(0);
      const bake::Prepared prepared = bake::prepare(baked.scene.meshes[0]);
      const bake::GroundTruth truth(prepared);
      size_t wrong = 0, open = 0, in_all = 0;
      for (const bake::RaySet set : bake::kRaySets) {
        const auto rays = bake::draw_ray_set(truth.source(), set, segments_wanted(10'000), 9);
        for (const char* shader : {"default", "rough"}) {
          const auto answers = ask_shader(*vulkan_, shader_code(shader), words, 0, rays.segments);
          for (size_t i = 0; i < answers.size(); ++i) {
            const bool visible =
                std::visit([&](const auto& field) { return kernels::query(field, rays.segments[i]).visible; },
                           format::field_of(baked.view.objects[0]));
            wrong += answers[i].certain && (answers[i].visible == 1) != visible;
            open += !answers[i].certain;
          }
          in_all += answers.size();
        }
      }
      EXPECT_EQ(wrong, 0u) << mesh.name << ' ' << encoding;
      EXPECT_LT(open, in_all / 100) << mesh.name << ' ' << encoding;
    }
}

/// Moves the planes of all cells together by `places` of 256, where they are farther apart.
void squeeze(std::vector<uint32_t>& words, uint32_t places) {
  namespace shader = kernels::shader;
  const uint32_t end = words[shader::kCornerTable];
  for (uint32_t i = words[shader::kVoxelWords]; i < end; ++i) {
    const uint32_t lower = kernels::lower_offset(words[i]), upper = kernels::upper_offset(words[i]);
    if (kernels::word_kind(words[i]) < kernels::kPlaneKinds && upper > lower + 2 * places)
      words[i] += (places << 16) - (places << 24);
  }
}

TEST_F(ShaderSets, AreProvenRightInRoughArithmetic) {
  const Baked baked(torus(60, 30), "segment");
  std::vector<uint32_t> words =
      nifkit::Asset::load(nifkit::Device("shaders=on"), std::span<const std::byte>(baked.file))
          .shader_tables(0);
  const bake::Prepared prepared = bake::prepare(baked.scene.meshes[0]);
  const bake::GroundTruth truth(prepared);
  const auto field = baked.view.objects[0].as<kernels::SegmentField>();
  for (const bool squeezed : {false, true}) {
    if (squeezed) squeeze(words, 6);
    size_t wrong = 0, proven = 0, rays_in_all = 0, logits = 0;
    for (const bake::RaySet set : bake::kRaySets) {
      const auto rays = bake::make_ray_set(truth.source(), set, segments_wanted(100'000), 8);
      const auto answers = ask_shader(*vulkan_, shader_code("rough"), words, 0, rays.segments);
      for (size_t i = 0; i < answers.size(); ++i) {
        proven += answers[i].certain;
        wrong += answers[i].certain && answers[i].visible != rays.visible[i];
        if (!squeezed) logits += answers[i].logit != kernels::query(field, rays.segments[i]).logit;
      }
      rays_in_all += answers.size();
    }
    EXPECT_GT(proven, rays_in_all / 2);
    if (squeezed) {
      EXPECT_GT(wrong, 0u) << "this would find a wrong proof";
    } else {
      EXPECT_EQ(wrong, 0u);
      EXPECT_GT(logits, 0u) << "the arithmetic is rough";
    }
  }
}

}  // namespace
}  // namespace nif::test
