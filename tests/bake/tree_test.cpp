// Trees over triangles, as the baker improves them: that they stay trees, that no step makes them worse, and that the largest depth
// holds whatever their shape.
#include <gtest/gtest.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>

#include "bake/triangles/binary_tree.hpp"
#include "bake/triangles/builder.hpp"
#include "bake/triangles/collapse.hpp"
#include "bake/triangles/reinsert.hpp"
#include "kernels/reference/triangles/refit.hpp"
#include "tests/support/test_random.hpp"

namespace nif::test {
namespace {

using bake::BinaryTree;

struct Soup {
  std::vector<mesh::Float3> positions;
  std::vector<mesh::Triangle> triangles;

  void add(const mesh::Float3& a, const mesh::Float3& b, const mesh::Float3& c) {
    const auto first = uint32_t(positions.size());
    positions.insert(positions.end(), {a, b, c});
    triangles.push_back({first, first + 1, first + 2});
  }
  BinaryTree tree() const { return bake::build_binary_tree(positions, triangles); }
};

/// Triangles of very different sizes, many of them slivers.
Soup random_soup(uint32_t count, uint64_t seed) {
  Random random(seed);
  Soup soup;
  for (uint32_t i = 0; i < count; ++i) {
    mesh::Float3 corners[3];
    const float size = std::exp2(random.between(-8.0f, 0.0f));
    for (uint32_t a = 0; a < 3; ++a) {
      corners[0][a] = random.between(-1.0f, 1.0f);
      const float edge = random.between(-size, size);
      corners[1][a] = corners[0][a] + edge;
      corners[2][a] = corners[0][a] + edge * 0.5f + random.between(-0.01f, 0.01f);
    }
    soup.add(corners[0], corners[1], corners[2]);
  }
  return soup;
}

/// Each within the next.
Soup nested_soup(uint32_t count) {
  Soup soup;
  for (uint32_t i = 1; i <= count; ++i) {
    const float r = float(i);
    soup.add({-r, -r, -r}, {r, r, -r}, {r, -r, r});
  }
  return soup;
}

/// A fan: what spans half of the mesh and has no surface to speak of.
Soup fan(uint32_t count) {
  Soup soup;
  const auto rim = [&](uint32_t i) {
    const float angle = 6.2831853f * float(i) / float(count);
    return mesh::Float3{std::cos(angle), 0, std::sin(angle)};
  };
  for (uint32_t i = 0; i < count; ++i) soup.add({0, 0, 0}, rim(i), rim(i + 1));
  return soup;
}

void expect_same(const mesh::Box& a, const mesh::Box& b) {
  EXPECT_EQ(a.min, b.min);
  EXPECT_EQ(a.max, b.max);
}

/// Returns the triangles below a node.
std::vector<uint32_t> check(const BinaryTree& tree, const Soup& soup, uint32_t at = 0) {
  const BinaryTree::Node& node = tree.nodes[at];
  if (!node.has_children()) {
    EXPECT_EQ(node.height, 0u);
    expect_same(node.box, mesh::bounds(soup.positions, std::span(soup.triangles).subspan(node.triangle, 1)));
    return {node.triangle};
  }
  std::vector<uint32_t> all;
  uint32_t height = 0;
  mesh::Box box = mesh::bounds(std::span<const mesh::Float3>(), {});
  for (const uint32_t child : node.children) {
    EXPECT_EQ(tree.nodes[child].parent, at);
    const std::vector<uint32_t> of_child = check(tree, soup, child);
    all.insert(all.end(), of_child.begin(), of_child.end());
    height = std::max(height, tree.nodes[child].height + 1);
    box.add(tree.nodes[child].box);
    if (node.height == 0) {
      EXPECT_EQ(tree.nodes[child].height, 0u);
    }
  }
  expect_same(node.box, box);
  if (node.height == 0) {
    EXPECT_LE(all.size(), kernels::kBvhLeafTriangles);
  } else {
    EXPECT_EQ(node.height, height);
  }
  return all;
}
void check_whole(const BinaryTree& tree, const Soup& soup) {
  std::vector<uint32_t> all = check(tree, soup);
  ASSERT_EQ(all.size(), soup.triangles.size());
  std::sort(all.begin(), all.end());
  for (uint32_t i = 0; i < all.size(); ++i) EXPECT_EQ(all[i], i);
  EXPECT_LE(tree.nodes[0].height, bake::kMostHeight);
}

double surface(const BinaryTree& tree) {
  double sum = 0;
  for (const BinaryTree::Node& node : tree.nodes)
    if (node.height != 0) sum += bake::half_surface(node.box);
  return sum;
}

/// A wide tree, looked at as a reader does.
struct Wide {
  std::map<uint32_t, uint32_t> triangles;  ///< how often
  uint32_t levels = 0;
  double cost = 0;  ///< the surfaces of nodes and leaves
  mesh::Box box = mesh::bounds(std::span<const mesh::Float3>(), {});

  Wide(const format::BvhBranch& branch, const Soup& soup) {
    if (branch.child_count == 0) {
      EXPECT_GE(branch.triangle_count, 1u);
      EXPECT_LE(branch.triangle_count, kernels::kBvhLeafTriangles);
      for (uint32_t i = 0; i < branch.triangle_count; ++i) {
        ++triangles[branch.triangles[i]];
        box.add(soup.positions, soup.triangles[branch.triangles[i]]);
      }
    }
    for (uint32_t i = 0; i < branch.child_count; ++i) {
      const Wide child(*branch.children[i], soup);
      for (const auto& [triangle, count] : child.triangles) triangles[triangle] += count;
      levels = std::max(levels, child.levels + 1);
      cost += child.cost;
      box.add(child.box);
    }
    cost += bake::half_surface(box);
  }
};

Wide collapsed(const BinaryTree& tree, const Soup& soup) {
  const std::deque<format::BvhBranch> branches = bake::collapse(tree);
  Wide wide(branches.front(), soup);
  EXPECT_EQ(wide.triangles.size(), soup.triangles.size());
  for (const auto& [triangle, count] : wide.triangles) EXPECT_EQ(count, 1u) << triangle;
  EXPECT_LE(wide.levels, bake::kMostLevels);
  return wide;
}

/// What the wide tree costs if each node opens its largest child until it is full.
double greedy_cost(const BinaryTree& tree, uint32_t at) {
  const BinaryTree::Node& node = tree.nodes[at];
  const double own = bake::half_surface(node.box);
  if (node.height == 0) return own;
  std::vector<uint32_t> slots = {node.children[0], node.children[1]};
  while (slots.size() < kernels::kBvhWidth) {
    const auto largest = std::max_element(slots.begin(), slots.end(), [&](uint32_t a, uint32_t b) {
      const auto of = [&](uint32_t slot) {
        return tree.nodes[slot].height == 0 ? -1 : bake::half_surface(tree.nodes[slot].box);
      };
      return of(a) < of(b);
    });
    if (tree.nodes[*largest].height == 0) break;
    const BinaryTree::Node& opened = tree.nodes[*largest];
    *largest = opened.children[0];
    slots.push_back(opened.children[1]);
  }
  double cost = own;
  for (const uint32_t slot : slots) cost += greedy_cost(tree, slot);
  return cost;
}

TEST(Tree, StaysOneAndGetsNoWorse) {
  for (const Soup& soup : {random_soup(1, 1), random_soup(2, 2), random_soup(5, 3), random_soup(40, 4),
                           random_soup(3000, 5), nested_soup(700), fan(500)}) {
    SCOPED_TRACE(soup.triangles.size());
    BinaryTree tree = soup.tree();
    ASSERT_NO_FATAL_FAILURE(check_whole(tree, soup));
    const double before = surface(tree), wide_before = collapsed(tree, soup).cost;
    EXPECT_LE(wide_before, greedy_cost(tree, 0) * 1.000001);
    bake::reinsert_nodes(tree);
    ASSERT_NO_FATAL_FAILURE(check_whole(tree, soup));
    EXPECT_LE(surface(tree), before * 1.000001);
    const double wide = collapsed(tree, soup).cost;
    // Where the tree is so high that nodes must be opened for their height, the cost does not decide.
    if (tree.nodes[0].height < bake::kMostHeight) {
      EXPECT_LE(wide, greedy_cost(tree, 0) * 1.000001);
    }
    if (soup.triangles.size() >= 500) {
      EXPECT_LT(surface(tree), before * 0.97);
    }
  }
}

// What is put together badly comes apart again.
TEST(Tree, IsFoundFromABadOne) {
  const Soup soup = random_soup(1000, 7);
  const double good = surface(soup.tree());
  // Neighbours by number, which lie anywhere.
  BinaryTree tree;
  const auto build = [&](const auto& self, uint32_t first, uint32_t count, uint32_t parent) -> uint32_t {
    const auto at = uint32_t(tree.nodes.size());
    tree.nodes.emplace_back().parent = parent;
    if (count == 1) {
      tree.nodes[at].triangle = first;
      tree.nodes[at].box = mesh::bounds(soup.positions, std::span(soup.triangles).subspan(first, 1));
    } else {
      const uint32_t left = self(self, first, count / 2, at);
      const uint32_t right = self(self, first + count / 2, count - count / 2, at);
      tree.nodes[at].children[0] = left;
      tree.nodes[at].children[1] = right;
      tree.refit(at);
    }
    return at;
  };
  build(build, 0, 1000, BinaryTree::kNone);
  const double bad = surface(tree);
  bake::reinsert_nodes(tree);
  check_whole(tree, soup);
  EXPECT_GT(bad, 3 * good);
  EXPECT_LT(surface(tree), 2 * good);
}

// A chain as high as any tree may be.
TEST(Tree, IsNeverTooDeep) {
  const uint32_t count = bake::kMostHeight + 1;
  const Soup soup = nested_soup(count);
  BinaryTree chain;
  chain.nodes.resize(2 * count - 1);
  // Nodes 0, 2, 4 ... are inner ones, except the last; all others are leaves.
  for (uint32_t i = 0; i + 1 < count; ++i) {
    chain.nodes[2 * i].children[0] = 2 * i + 1;
    chain.nodes[2 * i].children[1] = 2 * i + 2;
    chain.nodes[2 * i + 1].parent = chain.nodes[2 * i + 2].parent = 2 * i;
  }
  for (uint32_t i = 0; i < count; ++i) {
    BinaryTree::Node& leaf = chain.nodes[i + 1 < count ? 2 * i + 1 : 2 * i];
    leaf.triangle = count - 1 - i;
    leaf.box = mesh::bounds(soup.positions, std::span(soup.triangles).subspan(leaf.triangle, 1));
  }
  for (uint32_t i = count - 1; i-- > 0;) chain.refit(2 * i);
  ASSERT_EQ(chain.nodes[0].height, bake::kMostHeight);
  check_whole(chain, soup);
  collapsed(chain, soup);
  bake::reinsert_nodes(chain);
  check_whole(chain, soup);
  collapsed(chain, soup);
}

// Boxes that are all alike do not say where to split.
TEST(Tree, OfEqualBoxesIsPacked) {
  Soup soup;
  for (uint32_t i = 0; i < 3000; ++i) soup.add({0, 0, 0}, {1, 0, 0}, {0, 1, 1});
  BinaryTree tree = soup.tree();
  check_whole(tree, soup);
  bake::reinsert_nodes(tree);
  check_whole(tree, soup);
  collapsed(tree, soup);
  EXPECT_EQ(bake::build_bvh(soup.positions, soup.triangles).triangles.size(), 3000u);
}

// Coordinates as large as the encoding takes, and as small, and without any extent.
TEST(Tree, OfAnySizeIsPacked) {
  for (const float size : {0.0f, 1e-38f, 1e-45f, 0.25f * kernels::kMaxVertexCoordinate}) {
    Soup soup = random_soup(300, 9);
    for (mesh::Float3& p : soup.positions)
      for (float& x : p) x *= size / 2;
    ASSERT_TRUE(bake::fits_bvh(soup.positions));
    BinaryTree tree = soup.tree();
    bake::reinsert_nodes(tree);
    check_whole(tree, soup);
    collapsed(tree, soup);
    bake::build_bvh(soup.positions, soup.triangles);
  }
}

TEST(Tree, IsTheSameForAnyNumberOfThreads) {
  const Soup soup = random_soup(2000, 11);
  const auto built = [&](int threads) {
    tbb::task_arena arena(threads);
    return arena.execute([&] { return bake::build_bvh(soup.positions, soup.triangles); });
  };
  const format::TrianglesData one = built(1), three = built(3);
  ASSERT_EQ(one.nodes.size(), three.nodes.size());
  EXPECT_EQ(std::memcmp(one.nodes.data(), three.nodes.data(), one.nodes.size() * sizeof(one.nodes[0])), 0);
  EXPECT_EQ(one.triangles, three.triangles);
}

}  // namespace
}  // namespace nif::test
