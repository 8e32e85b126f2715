// Sorts and searches the corners that can block an ear.
#include "formats/mesh/blockers.hpp"

#include <algorithm>
#include <numeric>

namespace nif::mesh::detail {

void Blockers::clear(size_t corners) {
  list_.clear();
  place_.assign(corners, kNone);
  boxes_.clear();
}

void Blockers::set(uint32_t corner, bool blocks) {
  uint32_t& place = place_[corner];
  if (blocks == (place != kNone)) return;
  if (blocks) {
    place = uint32_t(list_.size());
    list_.push_back(corner);
  } else {
    place_[list_.back()] = place;
    list_[place] = list_.back();
    list_.pop_back();
    place = kNone;
  }
  if (boxes_.empty()) return;
  for (uint32_t box = leaf_of_[corner]; box != 0; box /= 2) blocks ? ++boxes_[box].live : --boxes_[box].live;
}

void Blockers::sort(std::span<const Point2> points) {
  if (list_.size() < kFewest) return;
  items_.resize(points.size());
  std::iota(items_.begin(), items_.end(), 0);
  leaf_of_.resize(points.size());
  size_t leaves = 1;
  while (leaves * kLeaf < items_.size()) leaves *= 2;
  boxes_.resize(2 * leaves);
  build(points, 1, 0, uint32_t(items_.size()));
}

void Blockers::build(std::span<const Point2> points, size_t at, uint32_t first, uint32_t last) {
  Box& box = boxes_[at];
  box = {points[items_[first]], points[items_[first]], first, last, 0, true};
  for (uint32_t i = first; i < last; ++i) {
    const Point2& p = points[items_[i]];
    box.min = {std::min(box.min.x, p.x), std::min(box.min.y, p.y)};
    box.max = {std::max(box.max.x, p.x), std::max(box.max.y, p.y)};
  }
  if (2 * at >= boxes_.size()) {
    for (uint32_t i = first; i < last; ++i) {
      leaf_of_[items_[i]] = uint32_t(at);
      box.live += place_[items_[i]] != kNone;
    }
    return;
  }
  box.leaf = false;
  const bool by_x = box.max.x - box.min.x > box.max.y - box.min.y;
  const auto begin = items_.begin();
  const uint32_t middle = first + (last - first) / 2;
  std::nth_element(begin + first, begin + middle, begin + last, [&](uint32_t i, uint32_t j) {
    return by_x ? points[i].x < points[j].x : points[i].y < points[j].y;
  });
  build(points, 2 * at, first, middle);
  build(points, 2 * at + 1, middle, last);
  box.live = boxes_[2 * at].live + boxes_[2 * at + 1].live;
}

bool Blockers::apart(const Box& box, const std::array<Point2, 3>& triangle, double slack) {
  const auto& [a, b, c] = triangle;
  if (box.max.x < std::min({a.x, b.x, c.x}) - slack || box.min.x > std::max({a.x, b.x, c.x}) + slack ||
      box.max.y < std::min({a.y, b.y, c.y}) - slack || box.min.y > std::max({a.y, b.y, c.y}) + slack)
    return true;
  // Several corners at one point, as at the centre of a star: at the ends of the third side they never block.
  if (box.min == box.max && (box.min == a || box.min == c)) return true;
  for (size_t i = 0; i < 3; ++i) {
    const Point2 &from = triangle[i], &to = triangle[(i + 1) % 3];
    // The box's corner that is farthest to the left.
    const Point2 inmost{to.y > from.y ? box.min.x : box.max.x, to.x > from.x ? box.max.y : box.min.y};
    if (orientation(from, to, inmost) < -slack * (std::abs(to.x - from.x) + std::abs(to.y - from.y)))
      return true;
  }
  return false;
}

}  // namespace nif::mesh::detail
