// Rays of every named set through a baked field and its planes alone, answered by a shader as by the reference.
// NIF_TEST_SEGMENTS says how many rays of each set instead of 100,000.
#include "formats/nif/writer.hpp"
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
    for (const bake::RaySet set : bake::kRaySets) {
      const auto rays = bake::draw_ray_set(truth.source(), set, segments_wanted(100'000), 7);
      const Differences found = compare(field, words, 0, rays.segments);
      EXPECT_EQ(found.all() + found.probability, 0u) << bake::name_of(set) << ": " << found;
      EXPECT_GT(found.uncertain, rays.segments.size() / 1000) << bake::name_of(set);
    }
  }
};

TEST_F(ShaderSets, OfAFieldAreAnsweredAsByTheCpu) { expect_equal<kernels::SegmentField>("segment"); }
TEST_F(ShaderSets, OfPlanesAreAnsweredAsByTheCpu) { expect_equal<kernels::PlanesField>("proof"); }

}  // namespace
}  // namespace nif::test
