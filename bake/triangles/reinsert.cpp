// Reinsertion as by Meister and Bittner (Parallel Reinsertion for Bounding Volume Hierarchy Optimization, Computer Graphics
// Forum 37(2), 2018): a round finds the best place for each of many nodes in the tree as it is, and then moves those that gain
// most, as far as they do not disturb each other.
#include "bake/triangles/reinsert.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <utility>

namespace nif::bake {
namespace {

using Node = BinaryTree::Node;
constexpr uint32_t kNobody = BinaryTree::kNone;

constexpr uint32_t kMostRounds = 16;
/// A round that gains less than this share is the last one.
constexpr double kLeastGain = 0.0005;
/// Of more, a round tries the nodes with the largest boxes, which rays meet most.
constexpr size_t kMostCandidates = 1'000'000;

/// A node becomes the sibling of another.
struct Move {
  uint32_t node, beside;
  double gain;  ///< of surface
};

mesh::Box around(mesh::Box a, const mesh::Box& b) {
  a.add(b);
  return a;
}

class Reinserter {
 public:
  explicit Reinserter(BinaryTree& tree) : tree_(tree), nodes_(tree.nodes) {}

  /// Of the inner nodes.
  double surface() const {
    double sum = 0;
    for (const Node& node : nodes_)
      if (node.height != 0) sum += half_surface(node.box);
    return sum;
  }

  /// One round.
  void run() {
    const std::vector<uint32_t> tried = candidates();
    std::vector<Move> moves(tried.size());
    tbb::parallel_for(size_t{0}, tried.size(), [&](size_t i) { moves[i] = best_move(tried[i]); });
    std::erase_if(moves, [](const Move& move) { return move.gain <= 0; });
    std::sort(moves.begin(), moves.end(), [](const Move& a, const Move& b) {
      return a.gain > b.gain || (a.gain == b.gain && a.node < b.node);
    });
    for (const Move& move : moves) apply(move);
  }

 private:
  /// Children of the root stay, which keeps its number, and what is in a leaf.
  bool may_move(uint32_t node) const {
    const uint32_t parent = nodes_[node].parent;
    return node != 0 && parent != 0 && nodes_[parent].height != 0;
  }

  std::vector<uint32_t> candidates() const {
    std::vector<uint32_t> all;
    for (uint32_t node = 0; node < nodes_.size(); ++node)
      if (may_move(node)) all.push_back(node);
    if (all.size() <= kMostCandidates) return all;
    const auto larger = [&](uint32_t a, uint32_t b) {
      const double of_a = half_surface(nodes_[a].box), of_b = half_surface(nodes_[b].box);
      return of_a > of_b || (of_a == of_b && a < b);
    };
    std::nth_element(all.begin(), all.begin() + kMostCandidates, all.end(), larger);
    all.resize(kMostCandidates);
    return all;
  }

  uint32_t sibling(uint32_t node) const {
    const Node& parent = nodes_[nodes_[node].parent];
    return parent.children[parent.children[0] == node ? 1 : 0];
  }

  /// Goes from the node up, and from each ancestor down into the other child, as far as more could be gained than so far.
  Move best_move(uint32_t node) const {
    Move best{node, kNobody, 0};
    const mesh::Box& box = nodes_[node].box;
    const double own = half_surface(box);
    const uint32_t parent = nodes_[node].parent;
    // What is gained before the node is put in: its parent goes, and ancestors shrink that it is no longer below.
    double gained = half_surface(nodes_[parent].box);
    mesh::Box rest = nodes_[sibling(node)].box;                         // of the last of these
    static thread_local std::vector<std::pair<double, uint32_t>> open;  // keeps its memory
    for (uint32_t ancestor = parent, side = sibling(node);;) {
      open.assign(1, {gained, side});
      while (!open.empty()) {
        const auto [before, at] = open.back();
        open.pop_back();
        if (before - own <= best.gain) continue;  // a box around both is no smaller
        const double gain = before - half_surface(around(nodes_[at].box, box));
        if (gain > best.gain && at != sibling(node)) best = {node, at, gain};
        const double below = gain + half_surface(nodes_[at].box);
        if (nodes_[at].height == 0 || below - own <= best.gain) continue;
        for (const uint32_t child : nodes_[at].children) open.emplace_back(below, child);
      }
      if (ancestor == 0) return best;
      if (ancestor != parent) {
        rest.add(nodes_[side].box);
        gained += half_surface(nodes_[ancestor].box) - half_surface(rest);
      }
      side = sibling(ancestor);
      ancestor = nodes_[ancestor].parent;
    }
  }

  /// Earlier moves of the round have changed the tree: a move that is no longer possible, or no longer gains, is left out.
  void apply(const Move& move) {
    const uint32_t node = move.node, beside = move.beside;
    if (!may_move(node) || beside == sibling(node) || beside == nodes_[node].parent) return;
    uint32_t depth = 0;
    for (uint32_t at = beside; at != 0; at = nodes_[at].parent, ++depth)
      if (at == node) return;
    if (depth + 1 + std::max(nodes_[node].height, nodes_[beside].height) > kMostHeight) return;
    const uint32_t before = sibling(node);
    if (put_beside(node, beside) >= 0) put_beside(node, before);
  }
  /// Returns by how much the sum of all surfaces grows.
  double put_beside(uint32_t node, uint32_t beside) {
    const uint32_t parent = nodes_[node].parent, grandparent = nodes_[parent].parent;
    replace_child(grandparent, parent, sibling(node));
    replace_child(nodes_[beside].parent, beside, parent);
    nodes_[parent].children[0] = beside;
    nodes_[parent].children[1] = node;
    nodes_[beside].parent = parent;
    return refit_from(parent) + refit_from(grandparent);
  }
  void replace_child(uint32_t parent, uint32_t child, uint32_t by) {
    uint32_t(&children)[2] = nodes_[parent].children;
    children[children[0] == child ? 0 : 1] = by;
    nodes_[by].parent = parent;
  }
  double refit_from(uint32_t node) {
    double grown = 0;
    for (; node != kNobody; node = nodes_[node].parent) {
      grown -= half_surface(nodes_[node].box);
      tree_.refit(node);
      grown += half_surface(nodes_[node].box);
    }
    return grown;
  }

  BinaryTree& tree_;
  std::vector<Node>& nodes_;
};

}  // namespace

void reinsert_nodes(BinaryTree& tree) {
  Reinserter reinserter(tree);
  double surface = reinserter.surface();
  for (uint32_t round = 0; round < kMostRounds; ++round) {
    reinserter.run();
    const double now = reinserter.surface();
    if (now > (1 - kLeastGain) * surface) return;
    surface = now;
  }
}

}  // namespace nif::bake
