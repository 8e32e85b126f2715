// A union-find structure that records relative orientations decides which triangles to turn. Fans are joined
// over edges of two triangles, other edges are stitched where that is unambiguous, and each fan gets its own
// vertex.
#include "mesh/repair/orient.hpp"

#include <algorithm>
#include <span>
#include <utility>

#include "formats/base/disjoint_sets.hpp"
#include "formats/mesh/sides.hpp"

namespace nif::repair {
namespace {

using mesh::Mesh;
using mesh::Side;
using mesh::Triangle;

/// Sets of connected triangles, with which of them face the other way than the first one of their set.
class Facings {
 public:
  explicit Facings(size_t count) : parent_(count), other_way_(count) {
    for (uint32_t i = 0; i < count; ++i) parent_[i] = i;
  }
  /// Returns the set's first triangle, and whether i faces the other way than that.
  std::pair<uint32_t, bool> find(uint32_t i) {
    bool other = false;
    while (parent_[i] != i) {
      const uint32_t up = parent_[i];
      other_way_[i] = other_way_[i] != other_way_[up];  // the first triangle of a set never does
      parent_[i] = parent_[up];
      other = other != other_way_[i];
      i = parent_[i];
    }
    return {i, other};
  }
  /// Does nothing if they are already connected.
  void unite(uint32_t a, uint32_t b, bool opposite) {
    const auto [first, turned_a] = find(a);
    const auto [second, turned_b] = find(b);
    if (first == second) return;
    const uint32_t top = std::min(first, second), below = std::max(first, second);
    parent_[below] = top;
    other_way_[below] = (turned_a != turned_b) != opposite;
  }

 private:
  std::vector<uint32_t> parent_;
  std::vector<bool> other_way_;
};

uint64_t turn_triangles(Mesh& mesh, std::vector<Side>& sides) {
  const size_t count = mesh.triangles.size();
  Facings facings(count);
  for (size_t begin = 0, end; begin < sides.size(); begin = end) {
    end = mesh::end_of_edge(sides, begin);
    if (end - begin != 2) continue;
    const Side &a = sides[begin], &b = sides[begin + 1];
    facings.unite(a.triangle, b.triangle, a.sign == b.sign);
  }
  std::vector<int64_t> balance(count);
  for (uint32_t t = 0; t < count; ++t) {
    const auto [first, other] = facings.find(t);
    balance[first] += other ? 1 : -1;
  }
  std::vector<bool> turned(count);
  uint64_t turns = 0;
  for (uint32_t t = 0; t < count; ++t) {
    const auto [first, other] = facings.find(t);
    turned[t] = other != (balance[first] > 0);
    if (!turned[t]) continue;
    ++turns;
    std::swap(mesh.triangles[t][1], mesh.triangles[t][2]);
  }
  for (Side& side : sides) {
    if (!turned[side.triangle]) continue;
    side.corner = uint16_t(2 - side.corner);  // corners 0 1 2 are now 0 2 1
    side.sign = int16_t(-side.sign);
  }
  return turns;
}

/// Fans of triangles around vertices. Corners have consecutive numbers, three per triangle.
class Fans {
 public:
  explicit Fans(Mesh& mesh) : mesh_(mesh), fans_(mesh.triangles.size() * 3) {}

  /// Two triangles at an edge that face the same way belong to one fan around each of the edge's ends.
  void join(const Side& a, const Side& b) {
    fans_.unite(from(a), to(b));
    fans_.unite(to(a), from(b));
  }

  /// Joins sides of edges that were taken apart, if it is unambiguous which of them belong together: the two
  /// sides of a fan that begins and ends at the edge, and then two sides that are the only ones left there,
  /// if they fit. `apart` has the sides, in the order of their edges. Returns the number of joined edges.
  uint64_t stitch(std::span<const Side> apart) {
    if (apart.empty()) return 0;
    apart_ = apart;
    joined_.assign(apart.size(), false);
    in_.assign(mesh_.triangles.size() * 3, kNone), out_ = in_;
    for (uint32_t s = 0; s < apart.size(); ++s) {
      out_[fans_.find(from(apart[s]))] = s;
      in_[fans_.find(to(apart[s]))] = s;
    }
    uint64_t stitched = 0;
    for (const Side& side : apart) stitched += zip(fans_.find(to(side)));
    // Joining may leave two sides at an edge that was visited before; few meshes need a third pass.
    uint64_t before = UINT64_MAX;
    for (int pass = 0; pass < 16 && stitched != before; ++pass) {
      before = stitched;
      stitched += join_last_two();
    }
    return stitched;
  }
  /// Gives each fan its own vertex.
  void split(Orienting& done) {
    const auto vertices = uint32_t(mesh_.positions.size());
    done.origin.resize(vertices);
    for (uint32_t v = 0; v < vertices; ++v) done.origin[v] = v;
    std::vector<uint32_t> vertex_of(mesh_.triangles.size() * 3);  // by the corner that represents a fan
    std::vector<bool> taken(vertices);
    for (uint32_t t = 0; t < mesh_.triangles.size(); ++t)
      for (uint32_t c = 0; c < 3; ++c) {
        uint32_t& v = mesh_.triangles[t][c];
        const uint32_t corner = t * 3 + c, fan = fans_.find(corner);
        if (fan == corner && !taken[v]) {
          taken[v] = true;
          vertex_of[fan] = v;
        } else if (fan == corner) {
          vertex_of[fan] = uint32_t(mesh_.positions.size());
          const mesh::Float3 p = mesh_.positions[v];
          mesh_.positions.push_back(p);
          done.origin.push_back(v);
        }
        v = vertex_of[fan];
      }
    done.split_vertices = mesh_.positions.size() - vertices;
  }

 private:
  /// The corners where a side begins and ends, in its triangle's direction.
  static uint32_t from(const Side& side) { return side.triangle * 3 + side.corner; }
  static uint32_t to(const Side& side) { return side.triangle * 3 + (side.corner + 1) % 3; }

  static constexpr uint32_t kNone = UINT32_MAX;

  uint64_t join_last_two() {
    uint64_t count = 0;
    std::vector<uint32_t> left;
    for (size_t begin = 0, end; begin < apart_.size(); begin = end) {
      end = mesh::end_of_edge(apart_, begin);
      left.clear();
      for (size_t s = begin; s < end; ++s)
        if (!joined_[s]) left.push_back(uint32_t(s));
      if (left.size() != 2 || apart_[left[0]].sign == apart_[left[1]].sign) continue;
      joined_[left[0]] = joined_[left[1]] = true;
      const uint32_t one = close(left[0], left[1]), other = close(left[1], left[0]);
      count += 1 + zip(one) + zip(fans_.find(other));
    }
    return count;
  }

  /// Unites the fan that side a leaves with the fan that side b enters, at one end of their edge, and returns
  /// the result.
  uint32_t close(uint32_t a, uint32_t b) {
    const uint32_t first = fans_.find(from(apart_[a])), second = fans_.find(to(apart_[b]));
    const bool whole = first == second;
    const uint32_t in = whole ? kNone : in_[first], out = whole ? kNone : out_[second];
    fans_.unite(first, second);
    const uint32_t fan = fans_.find(first);
    in_[fan] = in, out_[fan] = out;
    return fan;
  }

  /// If a fan begins and ends at the same edge, joins the edge, and continues at its other end.
  uint64_t zip(uint32_t fan) {
    uint64_t count = 0;
    for (;;) {
      const uint32_t in = in_[fan], out = out_[fan];
      if (in == kNone || out == kNone || apart_[in].edge != apart_[out].edge || joined_[in] || joined_[out])
        return count;
      joined_[in] = joined_[out] = true;
      in_[fan] = out_[fan] = kNone;
      // If it is also one fan at the other end, nothing was apart.
      count += fans_.find(from(apart_[in])) != fans_.find(to(apart_[out]));
      fan = close(in, out);
    }
  }

  Mesh& mesh_;
  DisjointSets fans_;
  std::span<const Side> apart_;
  std::vector<bool> joined_;  ///< whether each of these sides was joined
  std::vector<uint32_t> in_,
      out_;  ///< by the corner that represents a fan: the sides at which it begins and ends
};

}  // namespace

Orienting orient(Mesh& mesh) {
  Orienting done;
  std::vector<Side> sides = mesh::sorted_sides(mesh.triangles);
  done.turned = turn_triangles(mesh, sides);
  Fans fans(mesh);
  std::vector<Side> apart;
  for (size_t begin = 0, end; begin < sides.size(); begin = end) {
    end = mesh::end_of_edge(sides, begin);
    if (end - begin == 2 && sides[begin].sign != sides[begin + 1].sign)
      fans.join(sides[begin], sides[begin + 1]);
    else if (end - begin > 2)
      apart.insert(apart.end(), sides.begin() + std::ptrdiff_t(begin), sides.begin() + std::ptrdiff_t(end));
  }
  done.stitched_edges = fans.stitch(apart);
  fans.split(done);
  return done;
}

}  // namespace nif::repair
