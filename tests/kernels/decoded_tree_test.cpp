// Decoded `bvh` objects have the triangles of the file, each once, in boxes that hold them; and the SIMD kernels give the
// reference's bits, whether an object is decoded or not.
#include "kernels/cpu/triangles/decoded_tree.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "kernels/reference/triangles/triangles_hit.hpp"
#include "tests/kernels/each_way.hpp"
#include "tests/support/random_bvh.hpp"
#include "tests/support/random_exact.hpp"

namespace nif::test {
namespace {

using kernels::TrianglesField;
using kernels::cpu::decode;
using kernels::cpu::DecodedNode;
using kernels::cpu::DecodedTree;

constexpr size_t kNoLimit = std::numeric_limits<size_t>::max();

std::vector<format::TrianglesData> trees() {
  Random random(1);
  std::vector<format::TrianglesData> all;
  for (const uint32_t triangles : {1u, 2u, 4u, 5u, 9u, 33u, 300u, 2000u})
    for (const float size : {1.0f, 1e-12f, 1e12f})
      for (const float centre : {0.0f, 1000.0f})
        all.push_back(random_bvh(random, triangles, centre * size, size));
  // More triangles at the same t than a ray keeps candidates.
  Soup same;
  same.positions = {{-1, -1, 2}, {3, -1, 2}, {0, 1, 2}, {1, 2, 2}};
  for (uint32_t i = 0; i < 60; ++i) same.triangles.push_back({0, 1, 2 + i % 2});
  all.push_back(RandomTree(same).pack(random));
  // A town on a ground of a few large triangles, on one plane, on slopes, and as slivers.
  for (const float slope : {0.0f, 0.3f, 1e-5f})
    for (const float depth : {1.0f, 1e-4f, 1e-9f, 1e-13f}) {
      Soup town = random_soup(random, 400, 0, 0.05f);
      const uint32_t first = uint32_t(town.positions.size());
      for (uint32_t i = 0; i < 8; ++i) {
        const float angle = float(i) * 0.8f, x = std::cos(angle), z = std::sin(angle) * depth;
        town.positions.push_back({x, slope * x, z});
        town.triangles.push_back({first + i, first + (i + 1) % 8, i});
      }
      all.push_back(RandomTree(town).pack(random));
    }
  return all;
}

/// Counts how often each triangle is below a node, and checks boxes and corners.
class Checker {
 public:
  Checker(const TrianglesField& field, const DecodedTree& tree)
      : tree_(tree), seen_(field.triangle_count), corners_(field.triangle_count) {
    for (uint32_t n = 0; n < field.node_count; ++n) {
      const kernels::BvhNode& node = field.nodes[n];
      for (const uint8_t slot : node.slots) {
        if (slot == 0 || kernels::slot_kind(slot) == kernels::kInnerSlot) continue;
        for (uint32_t i = 0; i < kernels::slot_kind(slot); ++i) {
          const uint32_t triangle = node.first_triangle + kernels::slot_rank(slot) + i;
          for (uint32_t k = 0; k < 3; ++k)
            corners_[triangle][k] = field.vertices[node.first_vertex + field.triangles[triangle][k]];
        }
      }
    }
  }
  void visit(uint32_t number, const float (&low)[3], const float (&high)[3], uint32_t depth) {
    ASSERT_LT(depth, kernels::kMaxBvhDepth);
    const DecodedNode& node = tree_.nodes[number];
    ++nodes_;
    for (uint32_t s = 0; s < kernels::kBvhWidth; ++s) {
      if (!(node.low[0][s] <= node.high[0][s])) continue;
      float box_low[3], box_high[3];
      for (uint32_t a = 0; a < 3; ++a) {
        box_low[a] = node.low[a][s];
        box_high[a] = node.high[a][s];
        if (depth > 0) {
          ASSERT_GE(box_low[a], low[a]);
          ASSERT_LE(box_high[a], high[a]);
        }
      }
      if ((node.order[0] >> (24 + s) & 1) != 0) {
        ASSERT_NO_FATAL_FAILURE(visit(node.children[s], box_low, box_high, depth + 1));
      } else {
        check_leaf(node.children[s], box_low, box_high);
      }
    }
    for (const uint32_t order : node.order) {
      uint32_t slots = 0;
      for (uint32_t i = 0; i < kernels::kBvhWidth; ++i) slots |= 1u << (order >> 3 * i & 7);
      ASSERT_EQ(slots, 255u);  // each once
    }
  }
  /// The large triangles, which no node leads to.
  void check_large() {
    constexpr float kAnywhere[2][3] = {{-kernels::kNoHit, -kernels::kNoHit, -kernels::kNoHit},
                                       {kernels::kNoHit, kernels::kNoHit, kernels::kNoHit}};
    for (uint32_t i = 0; i < tree_.large.size(); ++i) {
      const kernels::cpu::LargeTriangle& large = tree_.large[i];
      const uint32_t leaf = i / kernels::kBvhLeafTriangles * kernels::kBvhLeafTriangles;
      if (i == leaf)
        check_leaf(leaf + std::min(uint32_t(tree_.large.size()) - i, kernels::kBvhLeafTriangles) - 1,
                   kAnywhere[0], kAnywhere[1]);
      const uint32_t triangle = tree_.leaves[i / kernels::kBvhLeafTriangles].triangles[i - leaf];
      for (uint32_t k = 0; k < 3; ++k) {
        double along = 0;
        for (uint32_t a = 0; a < 3; ++a) {
          EXPECT_EQ(large.corners[k][a], corners_[triangle][k][a]);
          EXPECT_LE(std::abs(large.corners[k][a]), tree_.reach);
          EXPECT_LE(std::abs(large.normal[a]), 1.0f);
          along += double{large.normal[a]} * double{large.corners[k][a]};
        }
        if (std::isfinite(large.steepness)) {
          EXPECT_LE(std::abs(along - double{large.offset}), large.flatness);
        }
      }
    }
  }
  /// Each large triangle is in one box.
  void check_large_boxes() {
    uint32_t found = 0;
    for (const kernels::cpu::LargeBox& box : tree_.large_boxes) {
      EXPECT_EQ(found & box.triangles, 0u);
      found |= box.triangles;
      for (uint32_t i = 0; i < tree_.large.size(); ++i)
        for (uint32_t k = 0; k < 3 && (box.triangles >> i & 1) != 0; ++k)
          for (uint32_t a = 0; a < 3; ++a) {
            EXPECT_LE(box.low[a], tree_.large[i].corners[k][a]);
            EXPECT_GE(box.high[a], tree_.large[i].corners[k][a]);
          }
    }
    EXPECT_EQ(found, (1u << tree_.large.size()) - 1);
  }
  const std::vector<uint32_t>& seen() const { return seen_; }
  uint32_t nodes() const { return nodes_; }

 private:
  void check_leaf(uint32_t child, const float (&low)[3], const float (&high)[3]) {
    const kernels::cpu::DecodedLeaf& leaf = tree_.leaves[child / kernels::kBvhLeafTriangles];
    for (uint32_t i = 0; i <= child % kernels::kBvhLeafTriangles; ++i) {
      const uint32_t triangle = leaf.triangles[i];
      ASSERT_LT(triangle, seen_.size());
      ++seen_[triangle];
      for (uint32_t k = 0; k < 3; ++k)
        for (uint32_t a = 0; a < 3; ++a) {
          const float at = leaf.corners[k][a][i];
          EXPECT_EQ(at, corners_[triangle][k][a]);
          EXPECT_GE(at, low[a]);
          EXPECT_LE(at, high[a]);
        }
    }
  }

  const DecodedTree& tree_;
  std::vector<uint32_t> seen_;
  std::vector<std::array<const float*, 3>> corners_;
  uint32_t nodes_ = 0;
};

TEST(DecodedTree, HasEachTriangleOnceInBoxesThatHoldIt) {
  uint32_t before = 0, after = 0, large = 0, small = 0;
  for (const format::TrianglesData& bvh : trees()) {
    const TrianglesField field = format::field_of(bvh);
    const DecodedTree tree = decode(field, kNoLimit, std::pmr::new_delete_resource());
    ASSERT_FALSE(tree.nodes.empty());
    EXPECT_EQ(reinterpret_cast<uintptr_t>(tree.nodes.data()) % alignof(DecodedNode), 0u);
    Checker checker(field, tree);
    const float none[3] = {};
    ASSERT_NO_FATAL_FAILURE(checker.visit(0, none, none, 0));
    ASSERT_NO_FATAL_FAILURE(checker.check_large());
    ASSERT_NO_FATAL_FAILURE(checker.check_large_boxes());
    for (const uint32_t times : checker.seen()) ASSERT_EQ(times, 1u);
    before += field.node_count;
    after += checker.nodes();
    large += uint32_t(tree.large.size());
    small += field.triangle_count - uint32_t(tree.large.size());
  }
  EXPECT_LT(after, before);  // nodes are filled up
  EXPECT_GT(large, 100u);
  EXPECT_GT(small, 10000u);
}

TEST(DecodedTree, KeepsItsLimit) {
  Random random(2);
  const format::TrianglesData bvh = random_bvh(random, 500);
  const TrianglesField field = format::field_of(bvh);
  std::pmr::memory_resource* const memory = std::pmr::new_delete_resource();
  const size_t bytes = decode(field, kNoLimit, memory).bytes();
  EXPECT_GT(bytes, 500 * 40u);
  EXPECT_EQ(decode(field, bytes, memory).bytes(), bytes);
  for (const size_t most : {size_t{0}, size_t{1000}, bytes / 2, bytes - 1})
    EXPECT_EQ(decode(field, most, memory).bytes(), 0u) << most;
}

class DecodedKernels : public testing::TestWithParam<Way> {};

TEST_P(DecodedKernels, GiveTheReferencesBits) {
  if (!kernels::cpu::available(GetParam().isa)) GTEST_SKIP() << "this machine does not have it";
  Random random(3);
  Asked asked;
  for (const format::TrianglesData& bvh : trees()) {
    const TreePayload payload(bvh);
    ASSERT_NO_FATAL_FAILURE(expect_reference_bits(
        payload.field(), GetParam(), random, asked, [&] { return random_segment(random, payload.field()); },
        [](const kernels::Segment&, const kernels::Answer&, const kernels::Hit&) {}));
  }
  EXPECT_GT(asked.met, asked.rays / 4);
}

/// Rays that go almost the same way, so that kernels send them through the tree together: from one point, or parallel.
class Bundles {
 public:
  Bundles(Random& random, const TrianglesField& field) : random_(random), field_(field) {}

  kernels::Segment operator()() {
    if (left_-- == 0) {
      left_ = random_.below(70);
      first_ = random_segment(random_, field_);
      from_a_point_ = random_.below(2) == 0;
      constexpr float kSpreads[] = {0, 1e-6f, 1e-3f, 0.03f, 0.2f};
      spread_ = kSpreads[random_.below(std::size(kSpreads))];
    }
    kernels::Segment segment = first_;
    float size = 0;
    for (const float x : segment.direction) size = std::max(size, std::abs(x));
    if (!from_a_point_) size = field_.extent;
    for (float& x : from_a_point_ ? segment.direction : segment.origin)
      x += size * spread_ * (2 * random_.unit() - 1);
    switch (random_.below(40)) {
      case 0:
        segment.tmin = std::numeric_limits<float>::quiet_NaN();
        break;
      case 1:
        segment.tmax = segment.tmin - 1;
        break;
      case 2:
        segment.tmax = segment.tmin + (segment.tmax - segment.tmin) * random_.unit();
        break;
      case 3:
        segment = random_segment(random_, field_);
        break;
      default:
        break;
    }
    return segment;
  }

 private:
  Random& random_;
  const TrianglesField& field_;
  kernels::Segment first_{};
  bool from_a_point_ = false;
  float spread_ = 0;
  uint32_t left_ = 0;
};

TEST_P(DecodedKernels, GiveTheReferencesBitsForRaysThatGoTogether) {
  if (!kernels::cpu::available(GetParam().isa)) GTEST_SKIP() << "this machine does not have it";
  Random random(4);
  Asked asked;
  for (const format::TrianglesData& bvh : trees()) {
    const TreePayload payload(bvh);
    Bundles bundles(random, payload.field());
    ASSERT_NO_FATAL_FAILURE(
        expect_reference_bits(payload.field(), GetParam(), random, asked, bundles,
                              [](const kernels::Segment&, const kernels::Answer&, const kernels::Hit&) {}));
  }
  EXPECT_GT(asked.met, asked.rays / 4);
}

/// Of rays that start outside, kernels leave the grid of an `exact` object out.
TEST_P(DecodedKernels, GiveTheReferencesBitsOfExactObjectsFromOutsideAndInside) {
  if (!kernels::cpu::available(GetParam().isa)) GTEST_SKIP() << "this machine does not have it";
  Random random(5);
  Asked asked;
  uint32_t few_boxes = 0;
  for (int k = 0; k < 12; ++k) {
    const RandomExact exact = random_exact(random, 9);
    const TreePayload payload(exact.triangles);
    const kernels::ExactField field{format::field_of(exact.planes), payload.field()};
    few_boxes += boxes_met(decode(payload.field(), kNoLimit, std::pmr::new_delete_resource())) < 20;
    for (const uint32_t outside_of_10 : {0u, 5u, 10u}) {
      const auto draw = [&] {
        kernels::Segment segment = random_segment(random, field.triangles);
        if (random.below(10) >= outside_of_10) return segment;
        const float back = 4 * field.triangles.extent / kernels::largest_of(segment.direction);
        for (size_t a = 0; std::isfinite(back) && a < 3; ++a)
          segment.origin[a] -= back * segment.direction[a];
        segment.tmax = std::numeric_limits<float>::infinity();
        return segment;
      };
      ASSERT_NO_FATAL_FAILURE(
          expect_reference_bits(field, GetParam(), random, asked, draw,
                                [](const kernels::Segment&, const kernels::Answer&, const kernels::Hit&) {}));
    }
  }
  EXPECT_GT(few_boxes, 6u);
  EXPECT_GT(asked.met, asked.rays / 8);
}

TEST(DecodedTree, CountsTheBoxesThatLinesMeet) {
  std::pmr::memory_resource* const memory = std::pmr::new_delete_resource();
  EXPECT_EQ(boxes_met(DecodedTree{}), 0);
  Random random(6);
  const format::TrianglesData one = random_bvh(random, 4);  // one leaf
  EXPECT_EQ(boxes_met(decode(format::field_of(one), kNoLimit, memory, nullptr, true)), 1);
  // Slivers across a square overlap; the same number of small triangles does not.
  Soup slivers, tiles;
  for (uint32_t i = 0; i < 200; ++i) {
    const float y = float(i) / 200, x = float(i % 20), z = float(i / 20);
    slivers.positions.insert(slivers.positions.end(), {{0, 0, 0}, {1, y, 0}, {1, y + 0.005f, 0}});
    tiles.positions.insert(tiles.positions.end(), {{x, z, 0}, {x + 0.9f, z, 0}, {x, z + 0.9f, 0}});
    slivers.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
    tiles.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
  }
  const auto boxes = [&](const Soup& soup) {
    const format::TrianglesData data = RandomTree(soup).pack(random);
    return boxes_met(decode(format::field_of(data), kNoLimit, memory, nullptr, true));
  };
  EXPECT_GT(boxes(slivers), 1.5 * boxes(tiles));
}

INSTANTIATE_TEST_SUITE_P(Each, DecodedKernels, each_way(), name_of);

}  // namespace
}  // namespace nif::test
