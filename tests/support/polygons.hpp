// Makes random polygons whose outlines do not cross themselves, on a grid of integers, so that tests can
// decide everything about them exactly, and independently of the tested code.
#pragma once

#include <algorithm>
#include <compare>
#include <cstdint>
#include <random>
#include <vector>

namespace nif::test {

struct GridPoint {
  int64_t x = 0, y = 0;
  auto operator<=>(const GridPoint&) const = default;
};
using GridPolygon = std::vector<GridPoint>;

/// Twice the signed area of a triangle; above 0 where c lies to the left of the line from a to b.
inline int64_t area_of(const GridPoint& a, const GridPoint& b, const GridPoint& c) {
  return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

inline int64_t area_of(const GridPolygon& polygon) {
  int64_t sum = 0;
  for (size_t i = 0; i < polygon.size(); ++i) {
    const GridPoint &p = polygon[i], &q = polygon[(i + 1) % polygon.size()];
    sum += p.x * q.y - p.y * q.x;
  }
  return sum;
}

inline int sign_of(int64_t x) { return (x > 0) - (x < 0); }

/// Do the interiors of two segments meet in one point?
inline bool cross(const GridPoint& a, const GridPoint& b, const GridPoint& c, const GridPoint& d) {
  return sign_of(area_of(a, b, c)) * sign_of(area_of(a, b, d)) < 0 &&
         sign_of(area_of(c, d, a)) * sign_of(area_of(c, d, b)) < 0;
}

inline bool on_segment(const GridPoint& a, const GridPoint& b, const GridPoint& p) {
  return area_of(a, b, p) == 0 && std::min(a.x, b.x) <= p.x && p.x <= std::max(a.x, b.x) &&
         std::min(a.y, b.y) <= p.y && p.y <= std::max(a.y, b.y);
}

/// Do two segments have a common point that is not an end of the second?
inline bool touch(const GridPoint& a, const GridPoint& b, const GridPoint& c, const GridPoint& d) {
  return cross(a, b, c, d) || on_segment(a, b, c) || on_segment(a, b, d) ||
         (on_segment(c, d, a) && a != c && a != d) || (on_segment(c, d, b) && b != c && b != d);
}

/// How often the outline winds around the middle of a triangle, which lies on no edge.
inline int winding_around_middle(const GridPolygon& polygon, const GridPoint& a, const GridPoint& b,
                                 const GridPoint& c) {
  const GridPoint middle{a.x + b.x + c.x, a.y + b.y + c.y};
  int winding = 0;
  for (size_t i = 0; i < polygon.size(); ++i) {
    const GridPoint p{3 * polygon[i].x, 3 * polygon[i].y};
    const GridPoint& next = polygon[(i + 1) % polygon.size()];
    const GridPoint q{3 * next.x, 3 * next.y};
    if (p.y <= middle.y && q.y > middle.y && area_of(p, q, middle) > 0) ++winding;
    if (p.y > middle.y && q.y <= middle.y && area_of(p, q, middle) < 0) --winding;
  }
  return winding;
}

class RandomPolygons {
 public:
  explicit RandomPolygons(uint64_t seed) : random_(seed) {}

  /// Makes a polygon with about this many corners: grown corner by corner, star-shaped around a point inside,
  /// or with right angles; possibly with holes; counterclockwise or clockwise.
  GridPolygon next(size_t corners) {
    GridPolygon polygon;
    switch (below(4)) {
      case 0:
        polygon = star(corners);
        break;
      case 1:
        polygon = steps(corners);
        break;
      default:
        polygon = grown(corners);
    }
    for (uint64_t holes = below(2) * below(5); holes > 0; --holes) bore(polygon);
    if (below(2) == 1) std::reverse(polygon.begin(), polygon.end());
    return polygon;
  }

  uint64_t below(uint64_t end) { return random_() % end; }

  static constexpr int64_t kSide = 1 << 16;

 private:
  GridPoint point() { return {int64_t(below(kSide)), int64_t(below(kSide))}; }

  GridPolygon star(size_t corners) {
    GridPolygon points;
    for (size_t i = 0; i < corners; ++i) points.push_back(point());
    const GridPoint middle{kSide / 2, kSide / 2};
    const auto upper = [&](const GridPoint& p) {
      return p.y > middle.y || (p.y == middle.y && p.x >= middle.x);
    };
    const auto same = [&](const GridPoint& p, const GridPoint& q) {
      return upper(p) == upper(q) && area_of(middle, p, q) == 0;
    };
    std::sort(points.begin(), points.end(), [&](const GridPoint& p, const GridPoint& q) {
      return upper(p) != upper(q) ? upper(p) : area_of(middle, p, q) > 0;
    });
    points.erase(std::unique(points.begin(), points.end(), same), points.end());
    for (size_t i = 0; i < points.size(); ++i)  // the middle has to lie inside
      if (area_of(middle, points[i], points[(i + 1) % points.size()]) <= 0) return grown(corners);
    return points;
  }

  /// A skyline: many corners on lines.
  GridPolygon steps(size_t corners) {
    GridPolygon polygon{{kSide - 1, 0}};
    const int64_t count = std::max<int64_t>(1, int64_t(corners) / 2 - 1), width = kSide / (count + 1);
    for (int64_t i = count; i-- > 0;) {
      const int64_t height = 1 + int64_t(below(7)) * (kSide / 8);
      polygon.push_back({(i + 1) * width, height});
      polygon.push_back({i * width, height});
    }
    polygon.push_back({0, 0});
    polygon.front().x = count * width;
    return polygon;
  }

  GridPolygon grown(size_t corners) {
    GridPolygon polygon;
    do {
      polygon = {point(), point(), point()};
    } while (area_of(polygon) <= 0);
    for (size_t tries = 0; polygon.size() < corners && tries < 4 * corners; ++tries) {
      const GridPoint p = point();
      const size_t at = below(polygon.size());
      const GridPoint &a = polygon[at], &b = polygon[(at + 1) % polygon.size()];
      if (area_of(a, b, p) == 0) continue;
      bool free = true;
      for (size_t i = 0; i < polygon.size() && free; ++i) {
        const GridPoint &c = polygon[i], &d = polygon[(i + 1) % polygon.size()];
        if (i == at) continue;
        free = !meet(a, p, c, d) && !meet(p, b, c, d);
      }
      if (free) polygon.insert(polygon.begin() + std::ptrdiff_t(at) + 1, p);
    }
    return polygon;
  }

  /// Do two segments meet other than in a common end?
  static bool meet(const GridPoint& a, const GridPoint& b, const GridPoint& c, const GridPoint& d) {
    if (cross(a, b, c, d)) return true;
    const auto lies = [](const GridPoint& p, const GridPoint& q, const GridPoint& r) {
      return r != p && r != q && on_segment(p, q, r);
    };
    return lies(a, b, c) || lies(a, b, d) || lies(c, d, a) || lies(c, d, b);
  }

  /// Cuts a hole, and a slit from the outline to it, if it finds room.
  void bore(GridPolygon& polygon) {
    for (int tries = 0; tries < 20; ++tries) {
      const GridPoint at = point();
      const int64_t size = 1 + int64_t(below(kSide / 16));
      // Clockwise; sometimes a slit of no width, or a single point.
      GridPolygon hole{
          at, {at.x, at.y + size}, {at.x + size, at.y + size}, {at.x + size / 2, at.y + size / 3}};
      const uint64_t kind = below(8);
      if (kind == 0) hole.resize(2);
      if (kind == 1) hole.resize(1);
      if (kind == 2) hole.resize(3);
      if (!is_free(polygon, hole) || winding_around_middle(polygon, at, at, at) != 1) continue;
      for (int slits = 0; slits < 20; ++slits) {
        const size_t from = below(polygon.size()), to = below(hole.size());
        if (!is_slit(polygon, from, hole, to)) continue;
        GridPolygon joined(polygon.begin(), polygon.begin() + std::ptrdiff_t(from) + 1);
        for (size_t i = 0; i <= hole.size(); ++i) joined.push_back(hole[(to + i) % hole.size()]);
        joined.insert(joined.end(), polygon.begin() + std::ptrdiff_t(from), polygon.end());
        polygon = std::move(joined);
        return;
      }
    }
  }

  static bool is_free(const GridPolygon& polygon, const GridPolygon& hole) {
    for (size_t i = 0; i < polygon.size(); ++i)
      for (size_t j = 0; j < hole.size(); ++j) {
        const GridPoint &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
        if (cross(a, b, hole[j], hole[(j + 1) % hole.size()]) || on_segment(a, b, hole[j]) ||
            on_segment(hole[j], hole[(j + 1) % hole.size()], a))
          return false;
      }
    return true;
  }

  /// Does a slit meet only its ends, and leave its corner to the inside?
  static bool is_slit(const GridPolygon& polygon, size_t from, const GridPolygon& hole, size_t to) {
    const GridPoint &p = polygon[from], &q = hole[to];
    const GridPoint &before = polygon[(from + polygon.size() - 1) % polygon.size()],
                    &after = polygon[(from + 1) % polygon.size()];
    if (before == p || after == p) return false;
    const bool left_of_in = area_of(before, p, q) > 0, left_of_out = area_of(p, after, q) > 0;
    if (area_of(before, p, after) > 0 ? !(left_of_in && left_of_out) : !(left_of_in || left_of_out))
      return false;
    for (size_t i = 0; i < polygon.size(); ++i)
      if (meet(p, q, polygon[i], polygon[(i + 1) % polygon.size()])) return false;
    for (size_t i = 0; i < hole.size(); ++i)
      if (meet(p, q, hole[i], hole[(i + 1) % hole.size()])) return false;
    return true;
  }

  std::mt19937_64 random_;
};

}  // namespace nif::test
