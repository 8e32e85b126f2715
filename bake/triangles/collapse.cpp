// The dynamic programme of Ylitie, Karras and Laine (Efficient Incoherent Ray Traversal on GPUs Through Compressed Wide BVHs, High
// Performance Graphics 2017): for each node of the binary tree, the cost of what is below it if that becomes at most so many slots of
// a wide node.
#include "bake/triangles/collapse.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <vector>

namespace nif::bake {
namespace {

using format::BvhBranch;
using kernels::kBvhLeafTriangles;
using kernels::kBvhWidth;

constexpr double kImpossible = std::numeric_limits<double>::infinity();

/// What is best for a node of the binary tree.
struct Choice {
  bool leaf;  ///< of the wide tree, if it is one slot
  /// [n - 1]: how many of n slots its first child gets, the rest being for the second; 0: one slot fewer does as well.
  uint8_t first_gets[kBvhWidth];
};

/// What a node costs.
struct Cost {
  double as_slots[kBvhWidth];  ///< [n - 1]: if it becomes at most n slots; fewer than all
  uint32_t triangles;
};

class Collapser {
 public:
  explicit Collapser(const BinaryTree& tree) : nodes_(tree.nodes), choices_(tree.nodes.size()) {}

  std::deque<BvhBranch> run() {
    choose(0);
    add(0, kMostLevels);
    return std::move(branches_);
  }

 private:
  /// Recursion is at most kMostHeight deep, here and below.
  Cost choose(uint32_t at) {
    const BinaryTree::Node& node = nodes_[at];
    Choice& choice = choices_[at];
    choice = {.leaf = true, .first_gets = {}};
    const double surface = half_surface(node.box);
    Cost cost{.as_slots = {}, .triangles = 1};
    if (node.height == 0) {
      std::fill(std::begin(cost.as_slots), std::end(cost.as_slots), surface);
      cost.triangles = triangles_in(at);
      return cost;
    }
    const Cost first = choose(node.children[0]), second = choose(node.children[1]);
    cost.triangles = first.triangles + second.triangles;
    double apart[kBvhWidth];  // [n - 1]: as n slots, or as fewer if a child needs no more
    for (uint32_t slots = 2; slots <= kBvhWidth; ++slots) {
      double& least = apart[slots - 1] = kImpossible;
      for (uint32_t of_first = 1; of_first < slots; ++of_first) {
        const double sum = first.as_slots[of_first - 1] + second.as_slots[slots - of_first - 1];
        if (!(sum < least)) continue;
        least = sum;
        choice.first_gets[slots - 1] = uint8_t(of_first);
      }
    }
    const double inner = surface + apart[kBvhWidth - 1];
    choice.leaf = cost.triangles <= kBvhLeafTriangles && surface <= inner;
    cost.as_slots[0] = choice.leaf ? surface : inner;
    for (uint32_t slots = 2; slots < kBvhWidth; ++slots) {
      cost.as_slots[slots - 1] = std::min(apart[slots - 1], cost.as_slots[slots - 2]);
      if (cost.as_slots[slots - 2] <= apart[slots - 1]) choice.first_gets[slots - 1] = 0;
    }
    return cost;
  }

  /// Adds the branch for a node. It may have so many levels of wide nodes.
  BvhBranch* add(uint32_t at, uint32_t levels) {
    BvhBranch& branch = branches_.emplace_back();
    if (choices_[at].leaf) {
      take_triangles(at, branch);
      std::sort(branch.triangles, branch.triangles + branch.triangle_count);
      return &branch;
    }
    std::array<uint32_t, kBvhWidth> slots;
    const uint32_t of_first = choices_[at].first_gets[kBvhWidth - 1];
    uint32_t count = 0;
    spread(nodes_[at].children[0], of_first, slots, count);
    spread(nodes_[at].children[1], kBvhWidth - of_first, slots, count);
    const auto too_high = [&](uint32_t slot) {
      return !choices_[slot].leaf && nodes_[slot].height > 3 * (levels - 1);
    };
    if (std::any_of(slots.begin(), slots.begin() + count, too_high)) count = open_highest(at, slots);
    for (uint32_t i = 0; i < count; ++i) {
      BvhBranch* const child = add(slots[i], levels - 1);
      branch.children[branch.child_count++] = child;
    }
    return &branch;
  }
  /// Makes at most so many slots of a node, as it was chosen.
  void spread(uint32_t at, uint32_t most, std::array<uint32_t, kBvhWidth>& slots, uint32_t& count) const {
    const Choice& choice = choices_[at];
    while (most > 1 && choice.first_gets[most - 1] == 0) --most;
    if (most == 1) {
      slots[count++] = at;
      return;
    }
    const uint32_t of_first = choice.first_gets[most - 1];
    spread(nodes_[at].children[0], of_first, slots, count);
    spread(nodes_[at].children[1], most - of_first, slots, count);
  }
  /// The slots that are lowest. They are at least three lower than the node, if it is so high: seven times the highest is opened,
  /// which is one node, then two, then four.
  uint32_t open_highest(uint32_t at, std::array<uint32_t, kBvhWidth>& slots) const {
    uint32_t count = 1;
    slots[0] = at;
    while (count < kBvhWidth) {
      const auto highest =
          std::max_element(slots.begin(), slots.begin() + count,
                           [&](uint32_t a, uint32_t b) { return nodes_[a].height < nodes_[b].height; });
      const BinaryTree::Node& node = nodes_[*highest];
      if (node.height == 0) break;
      *highest = node.children[0];
      slots[count++] = node.children[1];
    }
    return count;
  }
  uint32_t triangles_in(uint32_t leaf) const {
    const BinaryTree::Node& node = nodes_[leaf];
    return node.has_children() ? triangles_in(node.children[0]) + triangles_in(node.children[1]) : 1;
  }
  void take_triangles(uint32_t at, BvhBranch& leaf) const {
    const BinaryTree::Node& node = nodes_[at];
    if (node.has_children()) {
      for (const uint32_t child : node.children) take_triangles(child, leaf);
    } else {
      leaf.triangles[leaf.triangle_count++] = node.triangle;
    }
  }

  const std::vector<BinaryTree::Node>& nodes_;
  std::vector<Choice> choices_;
  std::deque<BvhBranch> branches_;
};

}  // namespace

std::deque<BvhBranch> collapse(const BinaryTree& tree) { return Collapser(tree).run(); }

}  // namespace nif::bake
