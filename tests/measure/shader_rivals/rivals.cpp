#include "tests/measure/shader_rivals/rivals.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <span>

namespace nif::test {
namespace {

using kernels::TrianglesField;
using Point = std::array<float, 3>;
using Triangle = std::array<Point, 3>;

struct Box {
  Point low{INFINITY, INFINITY, INFINITY}, high{-INFINITY, -INFINITY, -INFINITY};
  void add(const Box& box) {
    for (size_t a = 0; a < 3; ++a) {
      low[a] = std::min(low[a], box.low[a]);
      high[a] = std::max(high[a], box.high[a]);
    }
  }
  void add(const Point& point) { add({point, point}); }
  float half_area() const {
    const float x = high[0] - low[0], y = high[1] - low[1], z = high[2] - low[2];
    return x < 0 ? 0 : x * y + y * z + z * x;
  }
};

std::vector<Triangle> triangles_of(const TrianglesField& field) {
  std::vector<Triangle> triangles(field.triangle_count);
  for (const kernels::BvhNode& node : std::span(field.nodes, field.node_count))
    for (const uint8_t slot : node.slots) {
      if (slot == 0 || kernels::slot_kind(slot) == kernels::kInnerSlot) continue;
      for (uint32_t k = 0; k < kernels::slot_kind(slot); ++k) {
        const uint32_t number = node.first_triangle + kernels::slot_rank(slot) + k;
        for (size_t c = 0; c < 3; ++c) {
          const float* const vertex = field.vertices[node.first_vertex + field.triangles[number][c]];
          triangles[number][c] = {vertex[0], vertex[1], vertex[2]};
        }
      }
    }
  return triangles;
}

void append(std::vector<uint32_t>& words, const Point& point, uint32_t last = 0) {
  for (const float x : point) words.push_back(std::bit_cast<uint32_t>(x));
  words.push_back(last);
}

void append(std::vector<uint32_t>& words, const Triangle& triangle) {
  const auto edge = [&](size_t to) {
    Point point;
    for (size_t a = 0; a < 3; ++a) point[a] = triangle[to][a] - triangle[0][a];
    return point;
  };
  append(words, triangle[0]);
  append(words, edge(1));
  append(words, edge(2));
}

constexpr uint32_t kLeafBit = 0x80000000u;
constexpr size_t kBins = 16, kMostOfLeaf = 4, kDeepest = 40;

class BinaryBuilder {
 public:
  explicit BinaryBuilder(std::vector<Triangle> triangles) : triangles_(std::move(triangles)) {
    for (const Triangle& triangle : triangles_) {
      Item item{{}, {}, uint32_t(items_.size())};
      for (const Point& corner : triangle) item.box.add(corner);
      for (size_t a = 0; a < 3; ++a) item.middle[a] = 0.5f * (item.box.low[a] + item.box.high[a]);
      items_.push_back(item);
    }
  }
  std::vector<uint32_t> build() {
    words_ = {1, 0, 0, 0};
    nodes_.resize(16);
    // A root of two children always, even if the mesh would fit a leaf.
    const size_t middle = std::max<size_t>(1, split(0, items_.size(), 0));
    put(0, 0, 0, middle, 0);
    put(0, 1, middle, items_.size(), 0);
    words_[1] = uint32_t(1 + nodes_.size() / 4);
    words_.insert(words_.end(), nodes_.begin(), nodes_.end());
    for (const Item& item : items_) append(words_, triangles_[item.triangle]);
    return words_;
  }

 private:
  struct Item {
    Box box;
    Point middle;
    uint32_t triangle;
  };

  /// Writes a child of a node, and all below it.
  void put(size_t node, size_t side, size_t begin, size_t end, size_t depth) {
    Box box;
    for (size_t i = begin; i < end; ++i) box.add(items_[i].box);
    const size_t middle = split(begin, end, depth);
    uint32_t child = kLeafBit | uint32_t(end - begin - 1) << 28 | uint32_t(begin);
    if (middle != begin) {
      child = uint32_t(nodes_.size() / 16);
      nodes_.resize(nodes_.size() + 16);
      put(child, 0, begin, middle, depth + 1);
      put(child, 1, middle, end, depth + 1);
    }
    for (size_t a = 0; a < 3; ++a) {
      nodes_[16 * node + 8 * side + a] = std::bit_cast<uint32_t>(box.low[a]);
      nodes_[16 * node + 8 * side + 4 + a] = std::bit_cast<uint32_t>(box.high[a]);
    }
    nodes_[16 * node + 4 * side + 3] = child;
  }

  /// Sorts triangles into two parts; returns where the second begins, or `begin` for a leaf.
  size_t split(size_t begin, size_t end, size_t depth) {
    const size_t count = end - begin;
    if (count < 2) return begin;
    Box whole, middles;
    for (size_t i = begin; i < end; ++i) whole.add(items_[i].box), middles.add(items_[i].middle);
    float least = count <= kMostOfLeaf ? whole.half_area() * float(count) : INFINITY;
    size_t best_axis = 3, best_bin = 0;
    const auto bin_of = [&](const Item& item, size_t axis) {
      const float size = middles.high[axis] - middles.low[axis];
      return std::min(kBins - 1, size_t(float(kBins) * (item.middle[axis] - middles.low[axis]) / size));
    };
    for (size_t axis = 0; axis < 3 && depth < kDeepest; ++axis) {
      if (!(middles.high[axis] > middles.low[axis])) continue;
      std::array<Box, kBins> boxes;
      std::array<size_t, kBins> counts{};
      for (size_t i = begin; i < end; ++i) {
        const size_t bin = bin_of(items_[i], axis);
        boxes[bin].add(items_[i].box);
        ++counts[bin];
      }
      std::array<float, kBins> behind{};
      Box right;
      size_t of_right = 0;
      for (size_t bin = kBins - 1; bin > 0; --bin) {
        right.add(boxes[bin]);
        of_right += counts[bin];
        behind[bin] = right.half_area() * float(of_right);
      }
      Box left;
      size_t of_left = 0;
      for (size_t bin = 0; bin + 1 < kBins; ++bin) {
        left.add(boxes[bin]);
        of_left += counts[bin];
        if (of_left == 0 || of_left == count) continue;
        // A step down costs about as much as a triangle.
        const float cost = left.half_area() * float(of_left) + behind[bin + 1] + whole.half_area();
        if (cost < least) least = cost, best_axis = axis, best_bin = bin;
      }
    }
    if (best_axis == 3) return count <= kMostOfLeaf ? begin : begin + count / 2;
    const auto in_left = [&](const Item& item) { return bin_of(item, best_axis) <= best_bin; };
    return size_t(
        std::partition(items_.begin() + ptrdiff_t(begin), items_.begin() + ptrdiff_t(end), in_left) -
        items_.begin());
  }

  std::vector<Triangle> triangles_;
  std::vector<Item> items_;
  std::vector<uint32_t> words_, nodes_;
};

}  // namespace

std::vector<uint32_t> wide_rival(const TrianglesField& field) {
  std::vector<uint32_t> words = {1, 1 + 5 * field.node_count, 0, 0};
  for (const kernels::BvhNode& node : std::span(field.nodes, field.node_count)) {
    const auto of_node = std::bit_cast<std::array<uint32_t, 20>>(node);
    words.insert(words.end(), of_node.begin(), of_node.end());
  }
  for (const Triangle& triangle : triangles_of(field)) append(words, triangle);
  return words;
}

std::vector<uint32_t> binary_rival(const TrianglesField& field) {
  return BinaryBuilder(triangles_of(field)).build();
}

}  // namespace nif::test
