// No certain answer is ever wrong: random and adversarial segments on generated and on real meshes, against
// Embree.
#include <gtest/gtest.h>
#include <tbb/parallel_for.h>

#include <atomic>

#include "formats/mesh/read.hpp"
#include "kernels/reference/planes/grid_traversal.hpp"
#include "tests/bake/adversary.hpp"
#include "tests/bake/exact_truth.hpp"
#include "tests/bake/hard_shapes.hpp"
#include "tests/support/occupied_object.hpp"
#include "tests/support/real_meshes.hpp"

namespace nif::test {
namespace {

struct Counts {
  uint64_t certain_visible = 0, certain_occluded = 0, embree_misses = 0;
  std::vector<Segment> doubtful;  // Embree disagrees
  std::vector<Segment> wrongly;   // exact predicates disagree, too

  void expect_none_wrong() const {
    for (const Segment& s : wrongly)
      ADD_FAILURE() << "a certain answer is wrong: origin " << s.origin[0] << ' ' << s.origin[1] << ' '
                    << s.origin[2] << ", direction " << s.direction[0] << ' ' << s.direction[1] << ' '
                    << s.direction[2] << ", t " << s.tmin << ".." << s.tmax;
  }
};

Counts count_certain(const OccupiedObject& o, uint64_t segments) {
  constexpr uint64_t kBlock = 10'000;
  const Adversary adversary(o);
  std::vector<Counts> parts(segments / kBlock);
  tbb::parallel_for(uint64_t{0}, uint64_t(parts.size()), [&](uint64_t b) {
    nif::Random random(17, 4, b);
    kernels::FullTraversal traversal;
    for (uint64_t i = 0; i < kBlock; ++i) {
      const Segment s = adversary.draw(random);
      kernels::traverse_segment(o.field, s, traversal);
      if (!traversal.certain) continue;
      const bool visible = traversal.verdict == kernels::Verdict::visible;
      (visible ? parts[b].certain_visible : parts[b].certain_occluded) += 1;
      if (o.truth->source().embree.occluded(s) == visible) parts[b].doubtful.push_back(s);
    }
  });
  Counts all;
  for (Counts& part : parts) {
    all.certain_visible += part.certain_visible;
    all.certain_occluded += part.certain_occluded;
    all.doubtful.insert(all.doubtful.end(), part.doubtful.begin(), part.doubtful.end());
  }
  if (all.doubtful.empty()) return all;
  const ExactTruth exact(o.prepared.surface.positions, o.prepared.surface.triangles);
  for (const Segment& s : all.doubtful) {
    kernels::FullTraversal traversal;
    kernels::traverse_segment(o.field, s, traversal);
    const bool visible = traversal.verdict == kernels::Verdict::visible;
    const double reach = length(to_double(std::to_array(s.origin)) - to_double(o.prepared.box.min)) +
                         2 * o.prepared.box.diagonal();
    if (exact.occluded(s, reach) != visible)
      ++all.embree_misses;
    else
      all.wrongly.push_back(s);
  }
  return all;
}

/// For each generated mesh and number of cuts.
constexpr uint64_t kFewSegments = 200'000;

class CertainOnShapes : public testing::TestWithParam<std::tuple<int, uint32_t>> {
 protected:
  static void expect_none_wrong(uint64_t segments) {
    const auto [number, levels] = GetParam();
    const auto shape = Shape(number);
    const OccupiedObject o(make_shape(shape, levels), resolution_of(shape, levels), {.levels = levels});
    const Counts counts = count_certain(o, segments);
    counts.expect_none_wrong();
    EXPECT_GT(counts.certain_visible, segments / 20);
    EXPECT_GT(counts.certain_occluded, segments / (shape == kNearFaces ? 2000 : 200));
    EXPECT_LT(counts.embree_misses,
              segments / 1000);  // more would be the traversal's fault, not Embree's
  }
};

TEST_P(CertainOnShapes, IsNeverWrong) { expect_none_wrong(kFewSegments); }
TEST_P(CertainOnShapes, IsNeverWrongOnMillions) { expect_none_wrong(segments_wanted(1'000'000)); }

INSTANTIATE_TEST_SUITE_P(Generated, CertainOnShapes,
                         testing::Combine(testing::Range(0, int(kShapes)), testing::Values(0u, 2u, 4u)));

struct Mutation {
  const char* name;
  Shape shape;
  CellOptions options;
};

class CertainOnFlaws : public testing::TestWithParam<Mutation> {};

/// The segments are hard enough for these tests to find errors.
TEST_P(CertainOnFlaws, AreNoticed) {
  const auto& [name, shape, options] = GetParam();
  const OccupiedObject o(make_shape(shape, options.levels), resolution_of(shape, options.levels), options);
  EXPECT_GT(count_certain(o, kFewSegments).wrongly.size(), 0u);
}

INSTANTIATE_TEST_SUITE_P(
    Cells, CertainOnFlaws,
    testing::Values(Mutation{"no_padding", kNearFaces, {.levels = 2, .padding = 0}},
                    Mutation{"walls_everywhere", kSoup, {.levels = 2, .flaw = walls_everywhere}},
                    Mutation{"walls_of_doubles", kDoubled, {.levels = 2, .flaw = walls_everywhere}},
                    Mutation{"narrow_planes", kBowl, {.levels = 2, .flaw = narrow_planes}},
                    Mutation{"pockets_inside", kNearFaces, {.levels = 0, .flaw = pockets_inside}}),
    [](const auto& mutation) { return std::string(mutation.param.name); });

TEST(CertainOnRealMeshes, IsNeverWrong) {
  if (!real_mesh_folder()) GTEST_SKIP() << "NIF_TEST_MESHES is not set";
  const uint64_t segments = segments_wanted(100'000);
  for (const std::filesystem::path& file : real_meshes(4'000'000)) {
    SCOPED_TRACE(file.filename().string());
    const mesh::Scene scene = mesh::read(file);
    // The largest object of a file stands for the others.
    const auto largest = std::max_element(
        scene.meshes.begin(), scene.meshes.end(),
        [](const auto& a, const auto& b) { return a.triangles.size() < b.triangles.size(); });
    // The finest cells of any preset: those of `high`.
    const OccupiedObject o(*largest, 64, {.levels = 3, .thickness = 0.5});
    const Counts counts = count_certain(o, segments);
    counts.expect_none_wrong();
    std::printf(
        "%-45s %4.1f %% certainly visible, %4.1f %% certainly occluded, %d wrong; %d missed by Embree\n",
        file.filename().c_str(), 100.0 * double(counts.certain_visible) / double(segments),
        100.0 * double(counts.certain_occluded) / double(segments), int(counts.wrongly.size()),
        int(counts.embree_misses));
    EXPECT_LT(counts.embree_misses, segments / 10'000);  // more would be the traversal's fault
  }
}

/// Roughly the shares in docs/results/planes.md.
TEST(CertainOnTheDragon, AnswersNearlyAllOfTheNamedSets) {
  const auto folder = real_mesh_folder();
  if (!folder) GTEST_SKIP() << "NIF_TEST_MESHES is not set";
  const mesh::Scene scene = mesh::read(*folder / "stanford_dragon_871k.ply.gz");
  const OccupiedObject o(scene.meshes[0], 64, {.levels = 2});
  EXPECT_GT(double(o.cells.walls), 0.95 * double(o.cells.planes));
  EXPECT_LT(o.object.planes->voxel_records.size() + o.object.planes->children.size(), 65'000u);
  for (const auto& [set, least] :
       {std::pair(bake::RaySet::outer_lines, 0.99), std::pair(bake::RaySet::inner_surface, 0.95),
        std::pair(bake::RaySet::segments, 0.97)}) {
    const bake::RaysWithTruth rays = bake::make_ray_set(o.truth->source(), set, 2'000'000, 5);
    std::atomic<uint64_t> certain{0}, wrong{0};
    tbb::parallel_for(tbb::blocked_range<size_t>(0, rays.segments.size(), 10'000), [&](const auto& range) {
      kernels::FullTraversal traversal;
      for (size_t i = range.begin(); i < range.end(); ++i) {
        kernels::traverse_segment(o.field, rays.segments[i], traversal);
        if (!traversal.certain) continue;
        ++certain;
        wrong += (traversal.verdict == kernels::Verdict::visible) != (rays.visible[i] != 0);
      }
    });
    EXPECT_EQ(wrong, 0u) << bake::name_of(set);
    EXPECT_GE(double(certain), least * double(rays.segments.size())) << bake::name_of(set);
  }
}

}  // namespace
}  // namespace nif::test
