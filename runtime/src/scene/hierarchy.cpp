// Builds the hierarchy top-down by the surface area heuristic over bins (Wald 2007), and refits it.
#include "scene/hierarchy.hpp"

#include <algorithm>
#include <bit>
#include <limits>

#include "query/float_environment.hpp"

namespace nif::runtime {
namespace {

using kernels::WorldBox;

constexpr uint32_t kBins = 16;
/// The hierarchy is rebuilt once refitted boxes cost this many times as much as when they were built.
constexpr double kWorthRebuilding = 2;

/// Half the surface area; 0 for the empty box.
double area(const WorldBox& box) {
  if (!(box.min[0] <= box.max[0])) return 0;
  const double x = double(box.max[0]) - double(box.min[0]), y = double(box.max[1]) - double(box.min[1]),
               z = double(box.max[2]) - double(box.min[2]);
  return x * y + y * z + z * x;
}

/// 4^levels, saturated.
uint64_t capacity(uint32_t levels) { return uint64_t{1} << std::min(2 * levels, 62u); }

class Builder {
 public:
  Builder(std::span<const WorldBox> boxes, std::pmr::vector<Node>& nodes, std::span<uint32_t> places)
      : boxes_(boxes), order_(nodes.get_allocator()), nodes_(nodes), places_(places) {
    order_.reserve(boxes.size());
    for (uint32_t i = 0; i < boxes.size(); ++i)
      if (is_empty(boxes[i]))
        places[i] = kNoBox;
      else
        order_.push_back(i);
  }

  void build() {
    if (order_.empty()) return;
    nodes_.reserve(order_.size() / 2 + 1);
    WorldBox all;
    build_node({0, uint32_t(order_.size())}, kNoBox, 0, all);
  }

 private:
  struct Range {
    uint32_t begin, end;
    uint32_t size() const { return end - begin; }
  };

  /// Twice the centre; finite even if the box is not, or empty.
  static double twice_centre(float low, float high) {
    constexpr float kMost = std::numeric_limits<float>::max();
    return double(std::clamp(low, -kMost, kMost)) + double(std::clamp(high, -kMost, kMost));
  }
  double centre(uint32_t i, int axis) const { return twice_centre(boxes_[i].min[axis], boxes_[i].max[axis]); }

  /// Appends the node for some instances, and all nodes below it. Recursion is at most kMaxLevels deep.
  void build_node(Range range, uint32_t parent, uint32_t level, WorldBox& box) {
    const auto self = uint32_t(nodes_.size());
    nodes_.emplace_back();
    Range parts[kWidth] = {range};
    uint32_t count = 1;
    if (range.size() <= kWidth) {
      count = range.size();
      for (uint32_t i = 0; i < count; ++i) parts[i] = {range.begin + i, range.begin + i + 1};
    }
    // Deep in the tree, sizes must be halved strictly to stay within kMaxLevels.
    const bool by_cost = level + 1 < kMaxLevels && range.size() <= capacity(kMaxLevels - 1 - level);
    while (count < kWidth) {
      Range* widest = std::max_element(parts, parts + count,
                                       [&](const Range& a, const Range& b) { return a.size() < b.size(); });
      if (widest->size() <= kWidth) break;
      const uint32_t middle = by_cost ? split_by_cost(*widest) : split_by_count(*widest);
      parts[count++] = {middle, widest->end};
      widest->end = middle;
    }

    put_largest_first(parts, count);

    box = empty_box();
    uint32_t children[kWidth] = {};
    WorldBox inner[kWidth] = {empty_box(), empty_box(), empty_box(), empty_box()};
    for (uint32_t lane = 0; lane < count; ++lane) {
      if (parts[lane].size() == 1) {
        const uint32_t instance = order_[parts[lane].begin];
        children[lane] = kLeaf | instance;
        inner[lane] = boxes_[instance];
        places_[instance] = kWidth * self + lane;
      } else {
        children[lane] = uint32_t(nodes_.size());
        build_node(parts[lane], kWidth * self + lane, level + 1, inner[lane]);
      }
      grow(box, inner[lane]);
    }
    Node& node = nodes_[self];
    node.lanes = (1u << count) - 1;
    node.parent = parent;
    for (uint32_t lane = 0; lane < kWidth; ++lane) {
      node.child[lane] = children[lane];
      for (int a = 0; a < 3; ++a) {
        node.min[a][lane] = inner[lane].min[a];
        node.max[a][lane] = inner[lane].max[a];
      }
    }
    if (kNearFirst) put_near_first(node);
  }

  /// Rays visit children in order, and stop at the first that blocks them: large children block the most
  /// rays.
  void put_largest_first(Range (&parts)[kWidth], uint32_t count) const {
    std::pair<double, Range> sized[kWidth];
    for (uint32_t lane = 0; lane < count; ++lane) {
      WorldBox around = empty_box();
      for (uint32_t i = parts[lane].begin; i < parts[lane].end; ++i) grow(around, boxes_[order_[i]]);
      sized[lane] = {area(around), parts[lane]};
    }
    std::stable_sort(sized, sized + count, [](const auto& a, const auto& b) { return a.first > b.first; });
    for (uint32_t lane = 0; lane < count; ++lane) parts[lane] = sized[lane].second;
  }

  /// Children that rays of any signs meet one after the other, by the centres of their boxes.
  static void put_near_first(Node& node) {
    for (uint32_t signs = 0; signs < 8; ++signs) {
      double along[kWidth] = {};
      for (uint32_t lane = 0; lane < kWidth; ++lane)
        for (int a = 0; a < 3; ++a) {
          const double centre = twice_centre(node.min[a][lane], node.max[a][lane]);
          along[lane] += signs >> a & 1 ? -centre : centre;
        }
      for (uint32_t lane = 0; lane < kWidth; ++lane) {
        uint32_t place = 0;
        for (uint32_t i = 0; i < kWidth; ++i)
          place += i < lane ? along[i] <= along[lane] : along[i] < along[lane];
        node.near_first[signs] |= uint8_t(lane << 2 * place);
      }
    }
  }

  /// Moves the `left` instances with the lowest centres to the front. Ties are broken by number, so that the
  /// result does not depend on the standard library.
  uint32_t partition(Range range, uint32_t left, int axis) {
    const auto at = order_.begin();
    std::nth_element(at + range.begin, at + range.begin + left, at + range.end, [&](uint32_t a, uint32_t b) {
      const double x = centre(a, axis), y = centre(b, axis);
      return x != y ? x < y : a < b;
    });
    return range.begin + left;
  }

  /// Keeps sizes multiples of 4, so that the lowest nodes are full.
  static uint32_t rounded(uint32_t left, uint32_t size) {
    const uint32_t most = (size - 1) / kWidth * kWidth;
    return std::clamp((left + kWidth / 2) / kWidth * kWidth, kWidth, most);
  }

  uint32_t split_by_count(Range range) {
    double extent[3];
    for (int a = 0; a < 3; ++a) {
      const auto [low, high] = centres(range, a);
      extent[a] = high - low;
    }
    const auto widest = int(std::max_element(extent, extent + 3) - extent);
    const uint32_t half = (range.size() / 2 + kWidth - 1) / kWidth * kWidth;
    return partition(range, rounded(half, range.size()), widest);
  }

  std::pair<double, double> centres(Range range, int axis) const {
    double low = centre(order_[range.begin], axis), high = low;
    for (uint32_t i = range.begin + 1; i < range.end; ++i) {
      low = std::min(low, centre(order_[i], axis));
      high = std::max(high, centre(order_[i], axis));
    }
    return {low, high};
  }

  uint32_t split_by_cost(Range range) {
    double best = 0;
    uint32_t best_left = 0;
    int best_axis = -1;
    for (int axis = 0; axis < 3; ++axis) {
      const auto [low, high] = centres(range, axis);
      const double scale = kBins / (high - low);
      if (!(scale > 0) || !(scale * (high - low) > 0)) continue;  // a point, or too wide for numbers
      WorldBox bins[kBins];
      uint32_t counts[kBins] = {};
      std::fill_n(bins, kBins, empty_box());
      for (uint32_t i = range.begin; i < range.end; ++i) {
        const auto bin = std::min(uint32_t((centre(order_[i], axis) - low) * scale), kBins - 1);
        grow(bins[bin], boxes_[order_[i]]);
        ++counts[bin];
      }
      double right_cost[kBins];
      WorldBox right = empty_box();
      for (uint32_t b = kBins, count = 0; b-- > 1;) {
        grow(right, bins[b]);
        count += counts[b];
        right_cost[b] = area(right) * count;
      }
      WorldBox left = empty_box();
      for (uint32_t b = 1, count = 0; b < kBins; ++b) {
        grow(left, bins[b - 1]);
        count += counts[b - 1];
        if (count == 0 || count == range.size()) continue;
        const double cost = area(left) * count + right_cost[b];
        if (best_axis < 0 || cost < best) best = cost, best_left = count, best_axis = axis;
      }
    }
    if (best_axis < 0) return split_by_count(range);
    return partition(range, rounded(best_left, range.size()), best_axis);
  }

  std::span<const WorldBox> boxes_;
  std::pmr::vector<uint32_t> order_;
  std::pmr::vector<Node>& nodes_;
  std::span<uint32_t> places_;
};

}  // namespace

NIF_COMPUTES void Hierarchy::build(std::span<const WorldBox> boxes, std::span<uint32_t> places) {
  std::pmr::vector<Node> built(nodes_.get_allocator());
  Builder(boxes, built, places).build();
  built.shrink_to_fit();
  nodes_ = std::move(built);
  built_cost_ = cost();
}

WorldBox Hierarchy::box(uint32_t place) const {
  const Node& node = nodes_[place / kWidth];
  WorldBox box;
  for (int a = 0; a < 3; ++a) {
    box.min[a] = node.min[a][place % kWidth];
    box.max[a] = node.max[a][place % kWidth];
  }
  return box;
}

void Hierarchy::set_box(uint32_t place, const WorldBox& box) {
  Node& node = nodes_[place / kWidth];
  for (int a = 0; a < 3; ++a) {
    node.min[a][place % kWidth] = box.min[a];
    node.max[a][place % kWidth] = box.max[a];
  }
  // The box test does not notice that min > max: an empty box must be masked out, or rays would meet it.
  const uint32_t lane = 1u << place % kWidth;
  node.lanes = is_empty(box) ? node.lanes & ~lane : node.lanes | lane;
}

NIF_COMPUTES bool Hierarchy::refit() {
  for (auto i = uint32_t(nodes_.size()); i-- > 1;) {
    WorldBox around = empty_box();
    for (uint32_t lane = 0; lane < kWidth; ++lane) grow(around, box(kWidth * i + lane));
    set_box(nodes_[i].parent, around);
  }
  return cost() <= kWorthRebuilding * built_cost_;
}

WorldBox Hierarchy::bounds() const {
  WorldBox around = empty_box();
  if (!nodes_.empty())
    for (uint32_t lane = 0; lane < kWidth; ++lane) grow(around, box(lane));
  return around;
}

/// How many boxes a random line through the scene meets on average (the cost of a node's test is left out).
double Hierarchy::cost() const {
  double sum = 0;
  for (size_t i = 1; i < nodes_.size(); ++i) sum += area(box(nodes_[i].parent));
  const double all = area(bounds());
  return all > 0 ? sum / all : 0;
}

}  // namespace nif::runtime
