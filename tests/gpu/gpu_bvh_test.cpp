// The `bvh` kernel gives the reference's answers, to the bit.
#include "tests/gpu/loaded.hpp"

namespace nif::test {
namespace {

/// It has one kernel; in a scene with other objects the pipeline's traversal calls its code, too
/// (module_answers_test).
class GpuBvhTest : public GpuWayTest {};
INSTANTIATE_TEST_SUITE_P(Each, GpuBvhTest,
                         testing::Values(EmulatedWay{MatrixKind::dot32}, EmulatedWay{MatrixKind::dot64}),
                         name_of_way);

TEST_P(GpuBvhTest, AnswersAsTheReference) {
  for (uint64_t seed = 0; seed < 10; ++seed) {
    machine().order = seed % 3;
    const Loaded asset(seed, {.objects = 0, .instances = 0, .bvhs = 4});
    for (const format::ObjectView& object : asset.view.objects)
      expect_reference(object, random_segments(object, seed, 2000 + uint32_t(seed)), GetParam());
  }
}

TEST_P(GpuBvhTest, AnswersInvalidRays) {
  const Loaded asset(5, {.objects = 0, .instances = 0, .bvhs = 1});
  auto segments = random_segments(asset.view.objects[0], 5, 6000);
  spoil(segments, 6);
  expect_reference(asset.view.objects[0], segments, GetParam());
}

/// A tree of the greatest depth, in which a node waits at each level, fits into the stack.
TEST_P(GpuBvhTest, AnswersInTheDeepestTree) {
  constexpr uint32_t kDepth = kernels::kMaxBvhDepth;
  // Each node on the way down has the next one and one that holds the second triangle, which is far away; the
  // last one holds the first triangle.
  std::vector<kernels::BvhNode> nodes(2 * kDepth - 1);
  const float vertices[6][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {5, 5, 5}, {6, 5, 5}, {5, 6, 5}};
  const uint8_t triangles[2][3] = {{0, 1, 2}, {3, 4, 5}};
  for (uint32_t i = 0; i < nodes.size(); ++i) {
    kernels::BvhNode& node = nodes[i];
    node = {};
    const uint32_t level = (i + 1) / 2;
    const bool leads_down = (i == 0 || i % 2 == 1) && level + 1 < kDepth;
    for (uint32_t& frame : node.frame) frame = 127;  // scale 1, base 0
    node.first_node = leads_down ? 2 * level + 1 : 0;
    node.first_triangle = i == 2 * kDepth - 3 ? 0 : 1;
    for (uint32_t s = 0; s < (leads_down ? 2u : 1u); ++s) {
      node.slots[s] = leads_down ? kernels::make_slot(kernels::kInnerSlot, s) : kernels::make_slot(1, 0);
      for (int a = 0; a < 3; ++a) node.high[a][s] = 8;
    }
  }
  kernels::TrianglesField field;
  field.nodes = nodes.data();
  field.vertices = vertices;
  field.triangles = triangles;
  field.node_count = uint32_t(nodes.size());
  field.vertex_count = 6;
  field.triangle_count = 2;
  field.extent = kernels::bvh_extent(nodes[0]);
  std::vector<kernels::Segment> segments;
  for (int i = 0; i < 300; ++i)
    segments.push_back({{0.02f * float(i % 100), 0.01f * float(i % 70), -1}, {0, 0, 1}, 0, 100});
  const ObjectAnswers answers = ObjectOnGpu(field, GetParam()).ask(segments);
  uint32_t blocked = 0;
  for (size_t i = 0; i < segments.size(); ++i) {
    ASSERT_EQ(answers.logit[i], kernels::query(field, segments[i]).logit);
    blocked += answers.logit[i] < 0;
  }
  EXPECT_GT(blocked, 50u);
  EXPECT_LT(blocked, 250u);
}

}  // namespace
}  // namespace nif::test
