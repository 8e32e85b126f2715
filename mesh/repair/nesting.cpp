// Shoots a ray along x from the vertex of each solid that is farthest along x. The first solid that the ray
// meets, if any, extends farther along x: it contains the solid, or lies beside it within the same ones. So
// solids are placed one after the other, the farthest first, with one ray each, however deeply they are
// nested. Which triangles the ray meets is decided exactly, as if the ray were moved by a little along y and
// by much less along z, so that it meets no edge.
#include "mesh/repair/nesting.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <vector>

#include "formats/base/collinear.hpp"
#include "formats/base/disjoint_sets.hpp"
#include "formats/base/vector.hpp"
#include "formats/mesh/sides.hpp"
#include "mesh/repair/box_tree.hpp"

namespace nif::repair {
namespace {

using mesh::Box;
using mesh::Float3;
using mesh::Mesh;
using mesh::Triangle;

constexpr uint32_t kNone = UINT32_MAX;

bool overlap(const Box& a, const Box& b) {
  for (size_t axis = 0; axis < 3; ++axis)
    if (a.max[axis] < b.min[axis] || b.max[axis] < a.min[axis]) return false;
  return true;
}

bool within(const Box& inner, const Box& outer) {
  for (size_t axis = 0; axis < 3; ++axis)
    if (inner.min[axis] < outer.min[axis] || inner.max[axis] > outer.max[axis]) return false;
  return true;
}

using Corners = std::array<Float3, 3>;

/// Returns true only if two triangles have no point in common: an axis separates them by more than rounding.
bool surely_apart(const Corners& p, const Corners& q) {
  std::array<Double3, 3> a, b, side_a, side_b;
  double size = 0;
  for (size_t i = 0; i < 3; ++i) {
    a[i] = to_double(p[i]) - to_double(p[0]), b[i] = to_double(q[i]) - to_double(p[0]);
    for (size_t axis = 0; axis < 3; ++axis)
      size = std::max({size, std::abs(a[i][axis]), std::abs(b[i][axis])});
  }
  const auto separates = [&](const Double3& axis) {
    std::array<double, 3> x, y;
    for (size_t i = 0; i < 3; ++i) x[i] = dot(a[i], axis), y[i] = dot(b[i], axis);
    const double rounding = 1e-14 * size * (std::abs(axis[0]) + std::abs(axis[1]) + std::abs(axis[2]));
    return std::ranges::max(x) + rounding < std::ranges::min(y) ||
           std::ranges::max(y) + rounding < std::ranges::min(x);
  };
  for (size_t i = 0; i < 3; ++i) side_a[i] = a[(i + 1) % 3] - a[i], side_b[i] = b[(i + 1) % 3] - b[i];
  const Double3 normal_a = cross(side_a[0], side_a[1]), normal_b = cross(side_b[0], side_b[1]);
  if (separates(normal_a) || separates(normal_b)) return true;
  for (size_t i = 0; i < 3; ++i) {
    // For triangles in the same plane, the axes are perpendicular to their sides.
    if (separates(cross(normal_a, side_a[i])) || separates(cross(normal_b, side_b[i]))) return true;
    for (size_t j = 0; j < 3; ++j)
      if (separates(cross(side_a[i], side_b[j]))) return true;
  }
  return false;
}

/// A closed component of a mesh whose edges have at most two triangles.
struct Solid {
  uint32_t first;  ///< its first triangle
  uint32_t top;    ///< its vertex that is farthest along x
  Box box;
  double volume = 0;
  size_t begin = 0, end = 0;    ///< its triangles, in Nest::triangles_
  bool nested = false;          ///< within the bounds of another solid
  uint32_t behind = kNone;      ///< the solid that the ray from its top meets first
  bool odd = false;             ///< contained in an odd number of others
  bool unclear = false;         ///< the ray does not tell
  std::optional<bool> apart{};  ///< neither crosses nor touches another solid; empty until it is computed
  std::optional<bool> sure{};   ///< `odd` is reliable; empty until it is computed
};

/// The interval of x in which the ray meets a triangle.
struct Meeting {
  double low, high;
  int facing;  ///< 1 if the triangle faces along x, -1 if against it
};

class Nest {
 public:
  explicit Nest(Mesh& mesh) : mesh_(mesh) { find_solids(); }

  Nesting turn(bool keep_nested) {
    find_nested();
    const bool place = !keep_nested && std::ranges::any_of(solids_, &Solid::nested);
    if (place) place_all();
    Nesting done;
    std::vector<bool> turned(solids_.size());
    for (uint32_t s = 0; s < solids_.size(); ++s) {
      const Solid& solid = solids_[s];
      if (solid.nested && !place) continue;
      if (solid.odd ? solid.volume <= 0 : solid.volume >= 0) continue;
      if (!is_sure(s)) {
        ++done.unclear;
        continue;
      }
      ++done.turned;
      turned[s] = true;
    }
    for (uint32_t s = 0; s < solids_.size(); ++s)
      for (size_t i = solids_[s].begin; turned[s] && i < solids_[s].end; ++i)
        std::swap(mesh_.triangles[triangles_[i]][1], mesh_.triangles[triangles_[i]][2]);
    return done;
  }

 private:
  Corners corners(uint32_t triangle) const {
    const Triangle& t = mesh_.triangles[triangle];
    return {mesh_.positions[t[0]], mesh_.positions[t[1]], mesh_.positions[t[2]]};
  }

  void find_solids() {
    const std::vector<Triangle>& all = mesh_.triangles;
    DisjointSets pieces(all.size());
    std::vector<uint32_t> open;
    mesh::for_each_edge(all, {}, [&](std::span<const mesh::Side> sides) {
      for (const mesh::Side& side : sides) pieces.unite(side.triangle, sides[0].triangle);
      if (sides.size() != 2) open.push_back(sides[0].triangle);
    });
    std::vector<uint32_t> solid_of(all.size());
    for (const uint32_t t : open) solid_of[pieces.find(t)] = kNone;
    for (uint32_t t = 0; t < all.size(); ++t) {
      const uint32_t first = pieces.find(t);
      if (first == t && solid_of[t] != kNone) {
        solid_of[t] = uint32_t(solids_.size());
        const Float3& p = mesh_.positions[all[t][0]];
        solids_.push_back({.first = t, .top = all[t][0], .box = {p, p}});
      }
      if (solid_of[first] == kNone) {
        solid_of[t] = kNone;
        continue;
      }
      solid_of[t] = solid_of[first];
      add(solids_[solid_of[t]], t);
    }
    size_t end = 0;
    for (Solid& solid : solids_) solid.begin = end, end += solid.end, solid.end = solid.begin;
    triangles_.resize(end);
    for (uint32_t t = 0; t < all.size(); ++t)
      if (solid_of[t] != kNone) triangles_[solids_[solid_of[t]].end++] = t;
  }

  /// `end` counts the triangles until all solids are found.
  void add(Solid& solid, uint32_t t) {
    ++solid.end;
    solid.box.add(mesh_.positions, mesh_.triangles[t]);
    for (const uint32_t v : mesh_.triangles[t])
      if (mesh_.positions[v][0] > mesh_.positions[solid.top][0]) solid.top = v;
    // Relative to a vertex of the solid, to keep precision far from the origin.
    const Double3 origin = to_double(mesh_.positions[mesh_.triangles[solid.first][0]]);
    const Corners p = corners(t);
    solid.volume +=
        dot(to_double(p[0]) - origin, cross(to_double(p[1]) - origin, to_double(p[2]) - origin)) / 6;
  }

  void find_nested() {
    std::vector<Box> boxes;
    for (const Solid& solid : solids_) boxes.push_back(solid.box);
    const BoxTree tree(std::move(boxes));
    for (uint32_t s = 0; s < solids_.size(); ++s) {
      Solid& solid = solids_[s];
      int steps = 2000;  // beyond this it counts as nested, and the ray decides
      tree.visit(
          [&](const Box& box) {
            solid.nested = solid.nested || --steps == 0;
            return !solid.nested && within(solid.box, box);
          },
          [&](uint32_t other) {
            solid.nested = tree.box(other).min != solid.box.min || tree.box(other).max != solid.box.max;
            return !solid.nested;
          });
    }
  }

  void place_all() {
    std::vector<Box> boxes;
    for (const uint32_t t : triangles_) {
      boxes.push_back({mesh_.positions[mesh_.triangles[t][0]], mesh_.positions[mesh_.triangles[t][0]]});
      boxes.back().add(mesh_.positions, mesh_.triangles[t]);
    }
    tree_.emplace(std::move(boxes));
    for (uint32_t s = 0; s < solids_.size(); ++s)
      for (size_t i = solids_[s].begin; i < solids_[s].end; ++i) owner_.push_back(s);
    steps_left_ = 1'000'000 + 1000 * uint64_t(triangles_.size());
    std::vector<uint32_t> order(solids_.size());
    std::iota(order.begin(), order.end(), 0u);
    std::ranges::stable_sort(
        order, [&](uint32_t a, uint32_t b) { return solids_[a].box.max[0] > solids_[b].box.max[0]; });
    for (const uint32_t s : order)
      if (solids_[s].nested) shoot(solids_[s]);
  }

  bool step() {
    if (steps_left_ > 0) --steps_left_;
    return steps_left_ > 0;
  }

  /// Finds the solid behind a solid.
  void shoot(Solid& solid) {
    const Float3 p = mesh_.positions[solid.top];
    std::optional<Meeting> nearest;
    uint32_t behind = kNone;
    bool mixed = false;  // another solid may be the nearest
    tree_->visit(
        [&](const Box& box) {
          return step() && box.max[0] > p[0] && box.min[1] <= p[1] && box.max[1] >= p[1] &&
                 box.min[2] <= p[2] && box.max[2] >= p[2] &&
                 (!nearest || double(box.min[0]) <= nearest->high);
        },
        [&](uint32_t i) {
          const std::optional<Meeting> met = meet(p, corners(triangles_[i]));
          if (!met || met->high < p[0]) return true;
          if (met->low <= p[0]) solid.unclear = true;
          if (!nearest || met->high < nearest->low) {
            nearest = met, behind = owner_[i], mixed = false;
          } else if (met->low <= nearest->high) {
            mixed = mixed || owner_[i] != behind || met->facing != nearest->facing;
            nearest->low = std::min(nearest->low, met->low),
            nearest->high = std::max(nearest->high, met->high);
          }
          return true;
        },
        [](const Box& a, const Box& b) { return a.min[0] < b.min[0]; });
    solid.unclear = solid.unclear || mixed || steps_left_ == 0;
    if (!nearest || solid.unclear) return;
    const Solid& other = solids_[behind];
    solid.behind = behind;
    solid.unclear = other.volume == 0;
    // The ray leaves a solid where its surface faces along the ray.
    const bool inside = (nearest->facing > 0) == (other.volume > 0);
    solid.odd = other.odd != inside;
  }

  /// The side of the line from a to b, seen along x, on which the ray from p is; never on the line, unless a
  /// and b are equal.
  static int side(const Float3& a, const Float3& b, const Float3& p) {
    if (const int exact = nif::turn(a, b, p, 1, 2); exact != 0) return exact;
    if (a[2] != b[2]) return a[2] > b[2] ? 1 : -1;
    return b[1] > a[1] ? 1 : b[1] < a[1] ? -1 : 0;
  }

  static std::optional<Meeting> meet(const Float3& p, const Corners& t) {
    const int facing = side(t[0], t[1], p);
    if (facing == 0 || side(t[1], t[2], p) != facing || side(t[2], t[0], p) != facing) return std::nullopt;
    // The corners' weights in the point, and how much rounding may change them.
    double sum = 0, error = 0, x = 0, low = t[0][0], high = low;
    for (size_t i = 0; i < 3; ++i) {
      const Double3 a = to_double(t[(i + 1) % 3]) - to_double(p),
                    b = to_double(t[(i + 2) % 3]) - to_double(p);
      const double share = a[1] * b[2] - a[2] * b[1];
      sum += share, x += share * t[i][0];
      error += 1e-15 * (std::abs(a[1] * b[2]) + std::abs(a[2] * b[1]));
      low = std::min(low, double(t[i][0])), high = std::max(high, double(t[i][0]));
    }
    if (std::abs(sum) <= 4 * error) return Meeting{low, high, facing};
    x /= sum;
    const double off =
        4 * error / std::abs(sum) * (high - low) + 1e-15 * std::max(std::abs(low), std::abs(high));
    return Meeting{std::max(low, x - off), std::min(high, x + off), facing};
  }

  bool is_apart(uint32_t s) {
    Solid& solid = solids_[s];
    if (solid.apart) return *solid.apart;
    solid.apart = true;
    for (size_t i = solid.begin; i < solid.end && *solid.apart; ++i) {
      const Corners own = corners(triangles_[i]);
      const Box& box = tree_->box(uint32_t(i));
      tree_->visit([&](const Box& other) { return step() && overlap(other, box); },
                   [&](uint32_t other) {
                     if (owner_[other] != s && !surely_apart(own, corners(triangles_[other])))
                       solid.apart = false;
                     return *solid.apart;
                   });
      if (steps_left_ == 0) solid.apart = false;
    }
    return *solid.apart;
  }

  /// This depends on all solids along the chain of rays.
  bool is_sure(uint32_t s) {
    std::vector<uint32_t> path;
    bool sure = true;
    for (uint32_t at = s; at != kNone; at = solids_[at].behind) {
      const Solid& solid = solids_[at];
      if (solid.sure) {
        sure = *solid.sure && (at == s || is_apart(at));
        break;
      }
      path.push_back(at);
      if (!solid.nested) break;
    }
    for (; !path.empty(); path.pop_back()) {
      Solid& solid = solids_[path.back()];
      const bool below = path.size() > 1;  // another one depends on it
      solid.sure = !solid.nested || (sure && !solid.unclear && is_apart(path.back()));
      sure = *solid.sure && (!below || is_apart(path.back()));
    }
    return sure;
  }

  Mesh& mesh_;
  std::vector<Solid> solids_;
  std::vector<uint32_t> triangles_;  ///< triangles of all solids, one solid after the other
  std::vector<uint32_t> owner_;      ///< the solid of each of them
  std::optional<BoxTree> tree_;      ///< over these triangles
  uint64_t steps_left_ = 0;
};

}  // namespace

Nesting turn_solids(Mesh& mesh, bool keep_nested) { return Nest(mesh).turn(keep_nested); }

}  // namespace nif::repair
