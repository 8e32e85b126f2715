// Decodes the tree and the triangles of an object.
#include "kernels/cpu/triangles/decoded_tree.hpp"

#include <algorithm>
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

Items items_of(const BvhNode& node) {
  Items all;
  for (uint32_t s = 0; s < kBvhWidth && node.slots[s] != 0; ++s) all.items[all.count++] = item_of(node, s);
  join_leaves(all);
  return all;
}

/// Puts the children of nodes in the place of these nodes, the largest first, while there is room.
void fill_up(const TrianglesField& field, Items& all) {
  for (;;) {
    uint32_t largest = kBvhWidth;
    Items children;
    for (uint32_t i = 0; i < all.count; ++i) {
      const Item& item = all.items[i];
      if (item.count != 0 || (largest < kBvhWidth && surface(item.box) <= surface(all.items[largest].box)))
        continue;
      const Items inside = items_of(field.nodes[item.node]);
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
  Decoder(const TrianglesField& field, size_t most_bytes, std::pmr::memory_resource* memory)
      : field_(field), most_bytes_(most_bytes), nodes_(memory), leaves_(memory) {}

  /// Empty if it takes too many bytes.
  DecodedTree run() {
    nodes_.emplace_back();
    if (!add_node(0, 0)) return {};
    nodes_.shrink_to_fit();
    leaves_.shrink_to_fit();
    return {std::move(nodes_), std::move(leaves_)};
  }

 private:
  /// Fills nodes_[to]. Recursion is at most kMaxBvhDepth deep.
  bool add_node(uint32_t from, size_t to) {
    Items all = items_of(field_.nodes[from]);
    fill_up(field_, all);
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
        leaves_.push_back(leaf_of(field_, item));
      } else {
        inner |= 1u << s;
        node.children[s] = uint32_t(nodes_.size());
        nodes_.emplace_back();
      }
    }
    for (uint32_t signs = 0; signs < 8; ++signs) node.order[signs] = far_to_near(all, signs) | inner << 24;
    nodes_[to] = node;
    if (nodes_.size() * sizeof(DecodedNode) + leaves_.size() * sizeof(DecodedLeaf) > most_bytes_)
      return false;
    for (uint32_t s = kBvhWidth; s-- > 0;)
      if ((inner >> s & 1) != 0 && !add_node(all.items[s].node, node.children[s])) return false;
    return true;
  }

  const TrianglesField& field_;
  const size_t most_bytes_;
  std::pmr::vector<DecodedNode> nodes_;
  std::pmr::vector<DecodedLeaf> leaves_;
};

}  // namespace

DecodedTree decode(const TrianglesField& field, size_t most_bytes, std::pmr::memory_resource* memory) {
  // Numbers of nodes and of triangles in leaves take 32 bits.
  most_bytes = size_t(std::min<uint64_t>(most_bytes, uint64_t{1} << 32));
  // The size is not known before; but each triangle is stored, at best with three others.
  if (size_t{field.triangle_count} * sizeof(DecodedLeaf) / kBvhLeafTriangles > most_bytes) return {};
  return Decoder(field, most_bytes, memory).run();
}

}  // namespace nif::kernels::cpu
