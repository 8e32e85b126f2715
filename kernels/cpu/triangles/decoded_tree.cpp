// Decodes the tree and the triangles of an object.
#include "kernels/cpu/triangles/decoded_tree.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <utility>

namespace nif::kernels::cpu {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

struct Box {
  float low[3], high[3];
};

Box around(const Box& a, const Box& b) {
  Box box;
  for (uint32_t i = 0; i < 3; ++i) {
    box.low[i] = std::min(a.low[i], b.low[i]);
    box.high[i] = std::max(a.high[i], b.high[i]);
  }
  return box;
}

/// Half the surface: rays meet a box as often as this says. In double precision, where it cannot overflow.
double surface(const Box& box) {
  double size[3];
  for (uint32_t i = 0; i < 3; ++i) size[i] = double{box.high[i]} - double{box.low[i]};
  return size[0] * size[1] + size[1] * size[2] + size[2] * size[0];
}

/// What is in a slot: a node, or a leaf.
struct Item {
  Box box;
  uint32_t node;   ///< of the field, if it is one
  uint32_t count;  ///< of triangles; 0: a node
  uint32_t triangles[kBvhLeafTriangles];
  uint32_t first_vertex[kBvhLeafTriangles];  ///< what the triangles' indices count from
};

struct Items {
  Item items[kBvhWidth];
  uint32_t count = 0;

  void remove(uint32_t i) {
    std::copy(items + i + 1, items + count, items + i);
    --count;
  }
};

Box box_of(const TrianglesField& field, uint32_t first_vertex, uint32_t triangle) {
  Box box;
  for (uint32_t corner = 0; corner < 3; ++corner) {
    const float* const at = field.vertices[size_t{first_vertex} + field.triangles[triangle][corner]];
    const Box point{{at[0], at[1], at[2]}, {at[0], at[1], at[2]}};
    box = corner == 0 ? point : around(box, point);
  }
  return box;
}

Item item_of(const BvhNode& node, uint32_t slot) {
  Item item{};
  for (uint32_t a = 0; a < 3; ++a) {
    item.box.low[a] = frame_plane(node.frame[a], node.low[a][slot]);
    item.box.high[a] = frame_plane(node.frame[a], node.high[a][slot]);
  }
  const uint32_t kind = slot_kind(node.slots[slot]), rank = slot_rank(node.slots[slot]);
  if (kind == kInnerSlot) {
    item.node = node.first_node + rank;
    return item;
  }
  item.count = kind;
  for (uint32_t i = 0; i < kind; ++i) {
    item.triangles[i] = node.first_triangle + rank + i;
    item.first_vertex[i] = node.first_vertex;
  }
  return item;
}

/// Joins leaves while that makes rays test fewer of them.
void join_leaves(Items& all) {
  for (;;) {
    double most = 0;
    uint32_t first = 0, second = 0;
    for (uint32_t i = 0; i < all.count; ++i)
      for (uint32_t k = i + 1; k < all.count; ++k) {
        const Item &a = all.items[i], &b = all.items[k];
        if (a.count == 0 || b.count == 0 || a.count + b.count > kBvhLeafTriangles) continue;
        const double gain = surface(a.box) + surface(b.box) - surface(around(a.box, b.box));
        if (gain > most) {
          most = gain;
          first = i;
          second = k;
        }
      }
    if (second == 0) return;
    Item &a = all.items[first], &b = all.items[second];
    a.box = around(a.box, b.box);
    std::copy_n(b.triangles, b.count, a.triangles + a.count);
    std::copy_n(b.first_vertex, b.count, a.first_vertex + a.count);
    a.count += b.count;
    all.remove(second);
  }
}

/// A triangle that the tree goes without.
struct Large {
  double surface;  ///< of its box
  uint32_t triangle, first_vertex;
};

/// The tree of the file without its large triangles, and with boxes around what blocks light of the others.
class RestOfTree {
 public:
  RestOfTree(const TrianglesField& field, const BlockingBoxes* holes, bool moves,
             std::pmr::memory_resource* memory)
      : field_(field), holes_(holes), changed_(memory) {
    if (moves) return;
    Box whole{};
    const Items root = items_of(0);
    for (uint32_t i = 0; i < root.count; ++i)
      whole = i == 0 ? root.items[0].box : around(whole, root.items[i].box);
    least_ = field.triangle_count <= kMostLarge ? 0 : kLargeBox * surface(whole);
    choose_large(0);
    if (changes()) take_out(0);
    // In the order of nodes.
    std::sort(changed_.begin(), changed_.end(),
              [](const Changed& a, const Changed& b) { return a.node < b.node; });
  }

  uint32_t large_count() const { return large_count_; }
  const Large* large() const { return large_; }
  const TrianglesField& field() const { return field_; }

  Items items_of(uint32_t number) const {
    const BvhNode& node = field_.nodes[number];
    Items all;
    for (uint32_t s = 0; s < kBvhWidth && node.slots[s] != 0; ++s) {
      Item item = item_of(node, s);
      if (!changes() || without_large(item)) all.items[all.count++] = item;
    }
    join_leaves(all);
    return all;
  }

 private:
  /// A node whose box is not that of the file.
  struct Changed {
    uint32_t node;
    bool empty;  ///< there are only large triangles below it
    Box box;     ///< around the others
  };

  bool is_large(uint32_t triangle) const {
    return std::any_of(large_, large_ + large_count_,
                       [&](const Large& large) { return large.triangle == triangle; });
  }

  bool changes() const { return large_count_ != 0 || holes_ != nullptr; }

  /// A box around what blocks light.
  Box blocking_box(uint32_t first_vertex, uint32_t triangle) const {
    Box box = box_of(field_, first_vertex, triangle);
    if (holes_ == nullptr) return box;
    const float* corners[3];
    for (uint32_t k = 0; k < 3; ++k)
      corners[k] = field_.vertices[size_t{first_vertex} + field_.triangles[triangle][k]];
    holes_->shrink(triangle, corners, box.low, box.high);
    return box;
  }

  /// Removes the large triangles from an item, and changes its box. Returns false if nothing is left.
  bool without_large(Item& item) const {
    if (item.count == 0) {
      const auto found = std::lower_bound(changed_.begin(), changed_.end(), item.node,
                                          [](const Changed& a, uint32_t node) { return a.node < node; });
      if (found == changed_.end() || found->node != item.node) return true;
      item.box = found->box;
      return !found->empty;
    }
    uint32_t kept = 0;
    Box rest{};
    for (uint32_t i = 0; i < item.count; ++i) {
      if (is_large(item.triangles[i])) continue;
      const Box box = blocking_box(item.first_vertex[i], item.triangles[i]);
      rest = kept == 0 ? box : around(rest, box);
      item.triangles[kept] = item.triangles[i];
      item.first_vertex[kept++] = item.first_vertex[i];
    }
    if (kept == item.count && holes_ == nullptr) return true;
    item.count = kept;
    item.box = rest;
    return kept != 0;
  }

  /// Goes to all boxes that may hold a large triangle. Recursion is at most kMaxBvhDepth deep.
  void choose_large(uint32_t number) {
    const BvhNode& node = field_.nodes[number];
    for (uint32_t s = 0; s < kBvhWidth && node.slots[s] != 0; ++s) {
      const Item item = item_of(node, s);
      if (surface(item.box) < least_) continue;
      if (item.count == 0) choose_large(item.node);
      for (uint32_t i = 0; i < item.count; ++i)
        add_large({surface(box_of(field_, item.first_vertex[i], item.triangles[i])), item.triangles[i],
                   item.first_vertex[i]});
    }
  }
  void add_large(const Large& large) {
    if (large.surface < least_ || (holes_ != nullptr && holes_->has_holes(large.triangle))) return;
    uint32_t at = large_count_;
    if (at == kMostLarge && large.surface <= large_[at - 1].surface) return;
    if (at == kMostLarge) --at;
    large_count_ = at + 1;
    for (; at > 0 && large_[at - 1].surface < large.surface; --at) large_[at] = large_[at - 1];
    large_[at] = large;
  }

  /// Notes which nodes have other boxes than in the file. Returns whether this one does.
  bool take_out(uint32_t number) {
    const BvhNode& node = field_.nodes[number];
    Changed changed{number, true, {}};
    bool some = false;
    for (uint32_t s = 0; s < kBvhWidth && node.slots[s] != 0; ++s) {
      Item item = item_of(node, s);
      const uint32_t count = item.count;
      bool left = true;
      if (holes_ != nullptr || surface(item.box) >= least_) {
        if (count != 0) {
          left = without_large(item);
          some = some || holes_ != nullptr || item.count != count;
        } else if (take_out(item.node)) {
          some = true;
          left = !changed_.back().empty;
          item.box = changed_.back().box;
        }
      }
      if (!left) continue;
      changed.box = changed.empty ? item.box : around(changed.box, item.box);
      changed.empty = false;
    }
    if (some) changed_.push_back(changed);
    return some;
  }

  const TrianglesField& field_;
  const BlockingBoxes* holes_;  ///< null if there are none
  double least_ = 0;            ///< surface of a large triangle's box
  Large large_[kMostLarge];
  uint32_t large_count_ = 0;
  std::pmr::vector<Changed> changed_;
};

/// Puts the children of nodes in the place of these nodes, the largest first, while there is room.
void fill_up(const RestOfTree& tree, Items& all) {
  for (;;) {
    uint32_t largest = kBvhWidth;
    Items children;
    for (uint32_t i = 0; i < all.count; ++i) {
      const Item& item = all.items[i];
      if (item.count != 0 || (largest < kBvhWidth && surface(item.box) <= surface(all.items[largest].box)))
        continue;
      const Items inside = tree.items_of(item.node);
      if (all.count - 1 + inside.count > kBvhWidth) continue;
      largest = i;
      children = inside;
    }
    if (largest == kBvhWidth) return;
    Items filled;
    const auto add = [&](const Items& from, uint32_t first, uint32_t end) {
      for (uint32_t i = first; i < end; ++i) filled.items[filled.count++] = from.items[i];
    };
    add(all, 0, largest);
    add(children, 0, children.count);
    add(all, largest + 1, all.count);
    join_leaves(filled);
    all = filled;
  }
}

DecodedLeaf leaf_of(const TrianglesField& field, const Item& item) {
  DecodedLeaf leaf;
  for (uint32_t i = 0; i < kBvhLeafTriangles; ++i) {
    const uint32_t from = std::min(i, item.count - 1);
    leaf.triangles[i] = item.triangles[from];
    for (uint32_t corner = 0; corner < 3; ++corner) {
      const float* const vertex =
          field.vertices[size_t{item.first_vertex[from]} + field.triangles[item.triangles[from]][corner]];
      for (uint32_t a = 0; a < 3; ++a) leaf.corners[corner][a][i] = vertex[a];
    }
  }
  return leaf;
}

LargeTriangle large_triangle(const DecodedLeaf& leaf, uint32_t i) {
  LargeTriangle triangle{};
  double corners[3][3], normal[3], largest = 0;
  for (uint32_t k = 0; k < 3; ++k)
    for (uint32_t a = 0; a < 3; ++a) corners[k][a] = triangle.corners[k][a] = leaf.corners[k][a][i];
  for (uint32_t a = 0; a < 3; ++a) {
    const uint32_t b = (a + 1) % 3, c = (a + 2) % 3;
    const auto edge = [&](uint32_t k, uint32_t axis) { return corners[k][axis] - corners[0][axis]; };
    normal[a] = edge(1, b) * edge(2, c) - edge(1, c) * edge(2, b);
    largest = std::max(largest, std::abs(normal[a]));
  }
  triangle.steepness = kInfinity;
  if (!(largest > 0)) return triangle;
  for (uint32_t a = 0; a < 3; ++a) triangle.normal[a] = float(normal[a] / largest);
  // What matters is how far the corners are from the plane that results, wherever rounding has put it.
  double size = 0, flatness = 0;
  const auto along = [&](uint32_t k) {
    double sum = 0;
    for (uint32_t a = 0; a < 3; ++a) {
      sum += double{triangle.normal[a]} * corners[k][a];
      size = std::max(size, std::abs(corners[k][a]));
    }
    return sum;
  };
  triangle.offset = float(along(0));
  for (uint32_t k = 0; k < 3; ++k)
    flatness = std::max(flatness, std::abs(along(k) - double{triangle.offset}));
  triangle.flatness = float(flatness * (1 + 0x1p-20) + size * 0x1p-40);
  if (largest < 0x1p100) triangle.steepness = float(std::min(0x1p24 / largest, double{kInfinity}));
  return triangle;
}

/// The slots in the order in which a ray with these signs comes to the middles of their boxes, the last first.
uint32_t far_to_near(const Items& all, uint32_t signs) {
  uint32_t slots[kBvhWidth];
  double along[kBvhWidth] = {};
  for (uint32_t s = 0; s < kBvhWidth; ++s) {
    slots[s] = s;
    for (uint32_t a = 0; a < 3 && s < all.count; ++a) {
      const double middle = double{all.items[s].box.low[a]} + double{all.items[s].box.high[a]};
      along[s] += (signs >> a & 1) != 0 ? -middle : middle;
    }
  }
  // Not std::stable_sort, which allocates.
  std::sort(slots, slots + kBvhWidth,
            [&](uint32_t a, uint32_t b) { return along[a] > along[b] || (along[a] == along[b] && a < b); });
  uint32_t order = 0;
  for (uint32_t s = 0; s < kBvhWidth; ++s) order |= slots[s] << 3 * s;
  return order;
}

/// Builds the decoded nodes from the root on, each after its parent.
class Decoder {
 public:
  Decoder(const TrianglesField& field, const BlockingBoxes* holes, bool moves, size_t most_bytes,
          std::pmr::memory_resource* memory)
      : tree_(field, holes, moves, memory),
        most_bytes_(most_bytes),
        nodes_(memory),
        leaves_(memory),
        large_(memory) {}

  /// Empty if it takes too many bytes.
  DecodedTree run() {
    add_large();
    nodes_.emplace_back();
    if (!add_node(0, 0)) return {};
    nodes_.shrink_to_fit();
    leaves_.shrink_to_fit();
    large_.shrink_to_fit();
    const float reach = farthest();
    DecodedTree tree{std::move(nodes_), std::move(leaves_), std::move(large_), {}, reach};
    std::copy(std::begin(large_boxes_), std::end(large_boxes_), tree.large_boxes);
    return tree;
  }

 private:
  /// DecodedTree::reach.
  float farthest() const {
    float reach = 0;
    for (const DecodedNode& node : nodes_)
      for (uint32_t s = 0; s < kBvhWidth && node.low[0][s] <= node.high[0][s]; ++s)
        for (uint32_t a = 0; a < 3; ++a)
          reach = std::max(reach, std::max(std::abs(node.low[a][s]), std::abs(node.high[a][s])));
    for (const DecodedLeaf& leaf : leaves_)
      for (const auto& corner : leaf.corners)
        for (const auto& column : corner)
          for (const float at : column) reach = std::max(reach, std::abs(at));
    return reach;
  }

  void add_large() {
    for (uint32_t first = 0; first < tree_.large_count(); first += kBvhLeafTriangles) {
      Item item{};
      item.count = std::min(tree_.large_count() - first, kBvhLeafTriangles);
      for (uint32_t i = 0; i < item.count; ++i) {
        item.triangles[i] = tree_.large()[first + i].triangle;
        item.first_vertex[i] = tree_.large()[first + i].first_vertex;
      }
      const DecodedLeaf& leaf = leaves_.emplace_back(leaf_of(tree_.field(), item));
      for (uint32_t i = 0; i < item.count; ++i) large_.push_back(large_triangle(leaf, i));
    }
    group_large();
  }
  /// Finds the large triangles that share a box: with the largest that is left, what makes its box grow least.
  void group_large() {
    Box boxes[kMostLarge];
    uint32_t left = 0;  // bits
    for (uint32_t i = 0; i < tree_.large_count(); left |= 1u << i++)
      boxes[i] = box_of(tree_.field(), tree_.large()[i].first_vertex, tree_.large()[i].triangle);
    for (LargeBox& group : large_boxes_) {
      if (left == 0) break;
      Box box = boxes[std::countr_zero(left)];
      for (uint32_t k = 0; k < kLargeInBox && left != 0; ++k) {
        uint32_t chosen = uint32_t(std::countr_zero(left));
        for (uint32_t i = chosen + 1; i < tree_.large_count(); ++i)
          if ((left >> i & 1) != 0 && surface(around(box, boxes[i])) < surface(around(box, boxes[chosen])))
            chosen = i;
        box = around(box, boxes[chosen]);
        group.triangles |= 1u << chosen;
        left &= ~(1u << chosen);
      }
      std::copy_n(box.low, 3, group.low);
      std::copy_n(box.high, 3, group.high);
    }
  }

  /// Fills nodes_[to]. Recursion is at most kMaxBvhDepth deep.
  bool add_node(uint32_t from, size_t to) {
    Items all = tree_.items_of(from);
    fill_up(tree_, all);
    std::reverse(all.items, all.items + all.count);
    DecodedNode node;
    uint32_t inner = 0;
    for (uint32_t s = 0; s < kBvhWidth; ++s) {
      const bool used = s < all.count;
      const Item& item = all.items[s];
      for (uint32_t a = 0; a < 3; ++a) {
        node.low[a][s] = used ? item.box.low[a] : kInfinity;
        node.high[a][s] = used ? item.box.high[a] : -kInfinity;
      }
      node.children[s] = 0;
      if (!used) continue;
      if (item.count != 0) {
        node.children[s] = uint32_t(leaves_.size()) * kBvhLeafTriangles + item.count - 1;
        leaves_.push_back(leaf_of(tree_.field(), item));
      } else {
        inner |= 1u << s;
        node.children[s] = uint32_t(nodes_.size());
        nodes_.emplace_back();
      }
    }
    for (uint32_t signs = 0; signs < 8; ++signs) node.order[signs] = far_to_near(all, signs) | inner << 24;
    nodes_[to] = node;
    if (nodes_.size() * sizeof(DecodedNode) + leaves_.size() * sizeof(DecodedLeaf) +
            large_.size() * sizeof(LargeTriangle) >
        most_bytes_)
      return false;
    for (uint32_t s = kBvhWidth; s-- > 0;)
      if ((inner >> s & 1) != 0 && !add_node(all.items[s].node, node.children[s])) return false;
    return true;
  }

  const RestOfTree tree_;
  const size_t most_bytes_;
  std::pmr::vector<DecodedNode> nodes_;
  std::pmr::vector<DecodedLeaf> leaves_;
  std::pmr::vector<LargeTriangle> large_;
  LargeBox large_boxes_[kMostLarge / kLargeInBox] = {};
};

}  // namespace

double boxes_met(const DecodedTree& tree) {
  Box root{};
  double sum = 0;
  for (const DecodedNode& node : tree.nodes) {
    for (uint32_t s = 0; s < kBvhWidth && node.low[0][s] <= node.high[0][s]; ++s) {
      const Box box{{node.low[0][s], node.low[1][s], node.low[2][s]},
                    {node.high[0][s], node.high[1][s], node.high[2][s]}};
      sum += surface(box);
      if (&node == tree.nodes.data()) root = s == 0 ? box : around(root, box);
    }
  }
  return surface(root) > 0 ? sum / surface(root) : 0;
}

DecodedTree decode(const TrianglesField& field, size_t most_bytes, std::pmr::memory_resource* memory,
                   const BlockingBoxes* holes, bool moves) {
  // Numbers of nodes and of triangles in leaves take 32 bits.
  most_bytes = size_t(std::min<uint64_t>(most_bytes, uint64_t{1} << 32));
  // The size is not known before.
  if (least_decoded_bytes(field.triangle_count) > most_bytes) return {};
  return Decoder(field, holes, moves, most_bytes, memory).run();
}

}  // namespace nif::kernels::cpu
