// Ear clipping with exact signs. It is safe because the triangles, each counted with its orientation, always
// add up to the winding number of the outline around a point. If all face forwards, they cover the polygon
// and nothing else, even if a test of an ear was too permissive.
#include "formats/mesh/polygon.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "formats/base/vector.hpp"

namespace nif::mesh::detail {
namespace {

Double3 from_to(const Float3& a, const Float3& b) { return to_double(b) - to_double(a); }

int longest(const Double3& v) {
  const double x = std::abs(v[0]), y = std::abs(v[1]), z = std::abs(v[2]);
  return x > y ? (x > z ? 0 : 2) : (y > z ? 1 : 2);
}

Point2 along(const Float3& p, int axis) {
  return {double(p[size_t(axis + 1) % 3]), double(p[size_t(axis + 2) % 3])};
}

bool before(const Point2& a, const Point2& b) { return a.x != b.x ? a.x < b.x : a.y < b.y; }

/// If true, it is certain: all four corners turn the same way, seen along the normal. Most polygons are such
/// quads.
bool is_convex_quad(const Float3& p0, const Float3& p1, const Float3& p2, const Float3& p3) {
  const int axis = longest(cross(from_to(p0, p2), from_to(p1, p3)));
  const Point2 a = along(p0, axis), b = along(p1, axis), c = along(p2, axis), d = along(p3, axis);
  const Point2 u{b.x - a.x, b.y - a.y}, v{c.x - b.x, c.y - b.y}, w{d.x - c.x, d.y - c.y},
      z{a.x - d.x, a.y - d.y};
  int left = 0, right = 0;
  const auto turn = [&](const Point2& e, const Point2& f) {
    const double l = e.x * f.y, r = e.y * f.x;
    const double error = 4e-16 * (std::abs(l) + std::abs(r));
    left += l - r > error;
    right += r - l > error;
  };
  turn(u, v), turn(v, w), turn(w, z), turn(z, u);
  return left == 4 || right == 4;
}

/// The start of the smallest rotation of a ring.
template <class Less>
size_t least_rotation(size_t count, const Less& less) {
  size_t i = 0, j = 1, same = 0;
  while (i < count && j < count && same < count) {
    const size_t a = (i + same) % count, b = (j + same) % count;
    if (less(a, b)) {
      j += same + 1;
    } else if (less(b, a)) {
      i += same + 1;
    } else {
      ++same;
      continue;
    }
    if (i == j) ++j;
    same = 0;
  }
  return std::min(i, j);
}

}  // namespace

PolygonCutter::Found PolygonCutter::cut(std::span<const Float3> positions, std::span<Triangle> fan) {
  if (fan.size() == 2 &&
      is_convex_quad(positions[fan[0][0]], positions[fan[0][1]], positions[fan[0][2]], positions[fan[1][2]]))
    return {};
  vertices_.assign({fan[0][0], fan[0][1]});
  for (const Triangle& triangle : fan) vertices_.push_back(triangle[2]);
  for (const uint32_t v : vertices_)
    for (const float x : positions[v])
      if (!std::isfinite(x)) return {};

  Plane plane = plane_of(positions);
  Found found{.crosses = false, .bent = is_bent(positions, plane)};
  if (plane.certain_axis) {
    project(positions, plane.axis);
    if (is_convex()) return found;
  }
  if (vertices_.size() > kMostCorners) {
    found.crosses = true;
    return found;
  }
  // From here on, nothing depends on which corner comes first.
  start_at_least(positions);
  plane = plane_of(positions);
  project(positions, plane.axis);
  if (!plane.certain_axis && is_convex()) return found;
  if (plane.certain_sign ? plane.normal[size_t(plane.axis)] < 0 : is_clockwise())
    for (Point2& p : points_) std::swap(p.x, p.y);
  found.crosses = !clip(fan);
  return found;
}

/// Newell's normal, whose length is twice the area.
PolygonCutter::Plane PolygonCutter::plane_of(std::span<const Float3> positions) const {
  Plane plane;
  Double3 sizes{};
  const Float3& origin = positions[vertices_[0]];
  Double3 last = from_to(origin, positions[vertices_[1]]);
  for (size_t i = 2; i < vertices_.size(); ++i) {
    const Double3 next = from_to(origin, positions[vertices_[i]]);
    const Double3 area = cross(last, next);
    for (size_t a = 0; a < 3; ++a) {
      plane.normal[a] += area[a];
      sizes[a] +=
          std::abs(last[(a + 1) % 3] * next[(a + 2) % 3]) + std::abs(last[(a + 2) % 3] * next[(a + 1) % 3]);
    }
    last = next;
  }
  const double error = 3e-16 * double(vertices_.size()) * std::max({sizes[0], sizes[1], sizes[2]});
  plane.axis = longest(plane.normal);
  const double length = std::abs(plane.normal[size_t(plane.axis)]);
  plane.certain_sign = length > error;
  plane.certain_axis = true;
  for (int a = 0; a < 3; ++a)
    if (a != plane.axis && length - std::abs(plane.normal[size_t(a)]) <= 2 * error)
      plane.certain_axis = false;
  // A polygon without area in total is viewed from the side that shows most of it.
  if (!plane.certain_sign) plane.axis = longest(sizes);
  return plane;
}

void PolygonCutter::project(std::span<const Float3> positions, int axis) {
  points_.clear();
  for (const uint32_t v : vertices_) points_.push_back(along(positions[v], axis));
}

/// Whether no corner turns another way than the others, and the outline goes back and forth once ("Testing
/// the convexity of a polygon", Schorn and Fisher 1994). Also true for polygons on one line that do.
bool PolygonCutter::is_convex() {
  distinct_.clear();
  for (const Point2& p : points_)
    if (distinct_.empty() || !(p == distinct_.back())) distinct_.push_back(p);
  while (distinct_.size() > 1 && distinct_.front() == distinct_.back()) distinct_.pop_back();
  const size_t count = distinct_.size();
  if (count < 3) return true;
  double way = 0;
  int changes = 0;
  const Point2 *a = &distinct_[count - 2], *b = &distinct_[count - 1];
  bool forth = before(*a, *b);
  for (const Point2& c : distinct_) {
    const double turned = orientation(*a, *b, c);
    if (turned * way < 0) return false;
    if (way == 0) way = turned > 0 ? 1 : turned < 0 ? -1 : 0;
    changes += forth != before(*b, c);
    forth = before(*b, c);
    a = b, b = &c;
  }
  return changes <= 2;
}

/// Whether a corner is farther from the plane of best fit than a tenth of the diagonal of the polygon's box.
/// Quads never count as bent, because artists draw them so.
bool PolygonCutter::is_bent(std::span<const Float3> positions, const Plane& plane) const {
  if (vertices_.size() < 5 || !plane.certain_sign) return false;
  const Float3& origin = positions[vertices_[0]];
  const Double3& n = plane.normal;
  const double length = std::hypot(n[0], n[1], n[2]);
  Double3 least{}, most{};
  double sum = 0, lowest = 0, highest = 0;
  for (const uint32_t v : vertices_) {
    const Double3 p = from_to(origin, positions[v]);
    const double height = (p[0] * n[0] + p[1] * n[1] + p[2] * n[2]) / length;
    sum += height;
    lowest = std::min(lowest, height);
    highest = std::max(highest, height);
    for (size_t a = 0; a < 3; ++a) least[a] = std::min(least[a], p[a]), most[a] = std::max(most[a], p[a]);
  }
  const double mean = sum / double(vertices_.size());
  const double diagonal = std::hypot(most[0] - least[0], most[1] - least[1], most[2] - least[2]);
  return std::max(highest - mean, mean - lowest) > 0.1 * diagonal;
}

/// The sign of a small area, computed with twice the digits of double.
bool PolygonCutter::is_clockwise() const {
  double sum = 0, rest = 0;
  const auto add = [&](double x) {
    const double total = sum + x, part = total - sum;
    rest += (sum - (total - part)) + (x - part);
    sum = total;
  };
  for (size_t i = 0; i < points_.size(); ++i) {
    const Point2 &p = points_[i], &q = points_[(i + 1) % points_.size()];
    add(p.x * q.y);  // exact for floats
    add(-(p.y * q.x));
  }
  return sum + rest < 0;
}

/// Rotates the corners to the smallest order of their positions.
void PolygonCutter::start_at_least(std::span<const Float3> positions) {
  const size_t first = least_rotation(vertices_.size(), [&](size_t i, size_t j) {
    return positions[vertices_[i]] < positions[vertices_[j]];
  });
  std::rotate(vertices_.begin(), vertices_.begin() + std::ptrdiff_t(first), vertices_.end());
}

double PolygonCutter::turn(uint32_t b) const {
  return orientation(points_[corners_[b].before], points_[b], points_[corners_[b].after]);
}

/// For a corner that does not turn: whether the outline continues. Otherwise it turns back, or does not move
/// at all.
bool PolygonCutter::is_straight(uint32_t b) const {
  const Point2 &p = points_[corners_[b].before], &q = points_[b], &r = points_[corners_[b].after];
  return (before(p, q) && before(q, r)) || (before(r, q) && before(q, p));
}

/// Whether nothing is inside the triangle of a corner that turns left. Only corners that do not turn left can
/// be: where the outline enters a triangle at another corner, it leaves the triangle to its left.
bool PolygonCutter::is_ear(uint32_t b) {
  if (budget_ < 0) return false;
  if (budget_ < half_budget_ && straight_block_) forget_straight();
  const uint32_t a = corners_[b].before, c = corners_[b].after;
  const std::array<Point2, 3> t{points_[a], points_[b], points_[c]};
  const Point2 min{std::min({t[0].x, t[1].x, t[2].x}) - slack_, std::min({t[0].y, t[1].y, t[2].y}) - slack_};
  const Point2 max{std::max({t[0].x, t[1].x, t[2].x}) + slack_, std::max({t[0].y, t[1].y, t[2].y}) + slack_};
  return !blockers_.any_in(t, slack_, budget_, [&](uint32_t i) {
    const Point2& p = points_[i];
    return p.x >= min.x && p.x <= max.x && p.y >= min.y && p.y <= max.y && blocks(i, a, b, c);
  });
}

bool PolygonCutter::blocks(uint32_t i, uint32_t a, uint32_t b, uint32_t c) const {
  if (i == a || i == b || i == c) return false;
  const Point2 &p = points_[i], &pa = points_[a], &pb = points_[b], &pc = points_[c];
  const double ab = orientation(pa, pb, p), bc = orientation(pb, pc, p), ca = orientation(pc, pa, p);
  if (ab < 0 || bc < 0 || ca < 0) {
    // Rounding may have moved a corner that touches a side across it: its edges then cross the side.
    const auto through = [&](const Point2& s, const Point2& t, double side) {
      if (side >= 0 || side < -slack_ * (std::abs(t.x - s.x) + std::abs(t.y - s.y))) return false;
      for (const uint32_t next : {corners_[i].before, corners_[i].after}) {
        const Point2& q = points_[next];
        if (orientation(s, t, q) > 0 && orientation(p, q, s) * orientation(p, q, t) < 0) return true;
      }
      return false;
    };
    return through(pa, pb, ab) || through(pb, pc, bc);
  }
  if (ab > 0 && bc > 0 && ca > 0) return true;
  // On the boundary, a corner blocks if its own edges go into the triangle. From the ends of the third side,
  // no edge enters that does not end there, at a corner that blocks itself.
  if (p == pa || p == pc) return false;
  const auto enters = [&](auto inside) {
    return inside(points_[corners_[i].before]) || inside(points_[corners_[i].after]);
  };
  if (p == pb)
    return enters([&](const Point2& q) { return orientation(pa, pb, q) > 0 && orientation(pb, pc, q) > 0; });
  if (ca == 0)
    return rule_ == Rule::clear || enters([&](const Point2& q) { return orientation(pc, pa, q) > 0; });
  if (ab == 0) return enters([&](const Point2& q) { return orientation(pa, pb, q) > 0; });
  return enters([&](const Point2& q) { return orientation(pb, pc, q) > 0; });
}

/// From here on, third sides may run along corners on straight lines, which is correct, but leaves them in
/// the middle of a side. Long lines of such corners that are oblique to the boxes take most of the work.
void PolygonCutter::forget_straight() {
  straight_block_ = false;
  uint32_t at = any_;
  do {
    if (turn(at) == 0) blockers_.set(at, false);
    at = corners_[at].after;
  } while (at != any_);
}

/// To be called after the neighbours of a corner changed.
void PolygonCutter::look_at(uint32_t corner) {
  const double area = turn(corner);
  blockers_.set(corner, straight_block_ ? area <= 0 : area < 0);
  if (area == 0 && !is_straight(corner)) spikes_.push_back(corner);
  queue_.push_back({corner, corners_[corner].stamp});
  if (!has_heap_) return;
  heap_.push_back({std::abs(area), corner, corners_[corner].stamp});
  std::ranges::push_heap(heap_, kSooner);
}

/// Cuts off the triangle of a corner; `area` is twice its area.
void PolygonCutter::remove(uint32_t b, double area) {
  Corner& corner = corners_[b];
  const uint32_t a = corner.before, c = corner.after;
  out_[written_++] = {vertices_[a], vertices_[b], vertices_[c]};
  (area < 0 ? backwards_ : forwards_) += std::abs(area);
  corner.gone = true;
  blockers_.set(b, false);
  corners_[a].after = c;
  corners_[c].before = a;
  ++corners_[a].stamp;
  ++corners_[c].stamp;
  any_ = a;
  if (--left_ < 3) return;
  look_at(a);
  look_at(c);
}

/// Queues all corners again.
void PolygonCutter::refill() {
  queue_.clear();
  next_ = 0;
  uint32_t at = any_;
  do {
    queue_.push_back({at, corners_[at].stamp});
    at = corners_[at].after;
  } while (at != any_);
  budget_ -= int64_t(left_);
}

/// The corner whose triangle has the smallest area, because that covers little wrongly.
uint32_t PolygonCutter::least() {
  if (!has_heap_) {
    has_heap_ = true;
    heap_.clear();
    uint32_t at = any_;
    do {
      heap_.push_back({std::abs(turn(at)), at, corners_[at].stamp});
      at = corners_[at].after;
    } while (at != any_);
    std::ranges::make_heap(heap_, kSooner);
  }
  for (;;) {
    const Least least = heap_.front();
    std::ranges::pop_heap(heap_, kSooner);
    heap_.pop_back();
    if (!corners_[least.corner].gone && corners_[least.corner].stamp == least.stamp) return least.corner;
  }
}

/// Whether all triangles face forwards, apart from those that rounding of the coordinates may reverse.
bool PolygonCutter::clip(std::span<Triangle> out) {
  const auto count = uint32_t(points_.size());
  out_ = out;
  written_ = 0;
  left_ = count;
  any_ = 0;
  forwards_ = backwards_ = 0;
  straight_block_ = true;
  rule_ = Rule::clear;
  has_heap_ = false;
  spikes_.clear();
  queue_.clear();
  next_ = 0;
  blockers_.clear(count);
  budget_ = kFirstWork + kWorkPerCorner * int64_t(count);
  half_budget_ = budget_ / 2;
  corners_.resize(count);
  double length = 0, farthest = 0;
  for (uint32_t i = 0; i < count; ++i) {
    const uint32_t next = i + 1 < count ? i + 1 : 0;
    corners_[i] = {i > 0 ? i - 1 : count - 1, next, 0, false};
    length += std::abs(points_[next].x - points_[i].x) + std::abs(points_[next].y - points_[i].y);
    farthest = std::max({farthest, std::abs(points_[i].x), std::abs(points_[i].y)});
  }
  slack_ = 0x1p-22 * farthest;
  for (uint32_t i = 0; i < count; ++i) look_at(i);
  blockers_.sort(points_);
  bool forced = false;
  while (left_ >= 3) {
    if (!spikes_.empty()) {  // they have no area, and hide corners that have
      const uint32_t corner = spikes_.back();
      spikes_.pop_back();
      if (!corners_[corner].gone && turn(corner) == 0 && !is_straight(corner)) remove(corner, 0);
    } else if (next_ < queue_.size()) {
      const Waiting waiting = queue_[next_++];
      const uint32_t corner = waiting.corner;
      if (corners_[corner].gone || corners_[corner].stamp != waiting.stamp) continue;
      const double area = turn(corner);
      if (area > 0 ? is_ear(corner) : area == 0 && rule_ == Rule::straight) remove(corner, area);
    } else if (budget_ >= 0 && rule_ != Rule::straight) {
      rule_ = rule_ == Rule::clear ? Rule::touching : Rule::straight;
      refill();
    } else if (budget_ >= 0 && forced) {
      forced = false;
      refill();
    } else {
      const uint32_t corner = least();
      remove(corner, turn(corner));
      forced = true;
      budget_ = std::min(budget_, kFirstWork + kWorkAfterwards * int64_t(left_));
    }
  }
  // Half a unit in the last place of each coordinate, along the outline.
  const double rounding = 0x1p-23 * farthest * length;
  return backwards_ <= std::min(rounding, 1e-6 * forwards_);
}

}  // namespace nif::mesh::detail
