#include "mesh/repair/orient.hpp"

#include <algorithm>
#include <span>
#include <tuple>
#include <utility>

#include "formats/base/disjoint_sets.hpp"
#include "formats/mesh/sides.hpp"

namespace nif::repair {
namespace {

using mesh::Mesh;
using mesh::Side;
using mesh::Triangle;

/// Triangles that are connected, and which of them face the other way than the first one of their set.
class Facings {
 public:
  explicit Facings(size_t count) : parent_(count), other_way_(count) {
    for (uint32_t i = 0; i < count; ++i) parent_[i] = i;
  }
  /// The set's first triangle, and whether i faces the other way.
  std::pair<uint32_t, bool> find(uint32_t i) {
    bool other = false;
    while (parent_[i] != i) {
      const uint32_t up = parent_[i];
      other_way_[i] = other_way_[i] != other_way_[up];  // the first of a set never does
      parent_[i] = parent_[up];
      other = other != other_way_[i];
      i = parent_[i];
    }
    return {i, other};
  }
  /// Nothing changes where they are connected already.
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

/// Fans of triangles around vertices. Corners are numbered through, three to a triangle.
class Fans {
 public:
  explicit Fans(Mesh& mesh) : mesh_(mesh), fans_(mesh.triangles.size() * 3) {}

  /// Two triangles at an edge that face the same way are one fan around each of its ends.
  void join(const Side& a, const Side& b) {
    fans_.unite(from(a), to(b));
    fans_.unite(to(a), from(b));
  }
  /// The sides at an edge that was taken apart, without those that fans go over nevertheless, since they run
  /// all around its ends. A fan ends at an edge twice at most, so that such sides are pairs.
  std::vector<Side> loose(std::span<const Side> sides) {
    using Place = std::tuple<uint32_t, uint32_t, size_t>;
    std::vector<Place> places;
    for (size_t i = 0; i < sides.size(); ++i) {
      const Side& side = sides[i];
      const uint32_t a = fans_.find(from(side)), b = fans_.find(to(side));
      places.emplace_back(side.sign > 0 ? a : b, side.sign > 0 ? b : a, i);
    }
    std::sort(places.begin(), places.end());
    const auto same = [](const Place& a, const Place& b) {
      return std::get<0>(a) == std::get<0>(b) && std::get<1>(a) == std::get<1>(b);
    };
    std::vector<Side> loose;
    for (size_t i = 0; i < places.size(); ++i) {
      if (i + 1 < places.size() && same(places[i], places[i + 1]))
        ++i;
      else
        loose.push_back(sides[std::get<2>(places[i])]);
    }
    return loose;
  }
  /// Gives each fan a vertex of its own.
  void split(Orienting& done) {
    const auto vertices = uint32_t(mesh_.positions.size());
    done.origin.resize(vertices);
    for (uint32_t v = 0; v < vertices; ++v) done.origin[v] = v;
    std::vector<uint32_t> vertex_of(mesh_.triangles.size() * 3);  // of corners that represent fans
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
  /// Where a side begins and ends, as its triangle goes.
  static uint32_t from(const Side& side) { return side.triangle * 3 + side.corner; }
  static uint32_t to(const Side& side) { return side.triangle * 3 + (side.corner + 1) % 3; }

  Mesh& mesh_;
  DisjointSets fans_;
};

}  // namespace

Orienting orient(Mesh& mesh) {
  Orienting done;
  std::vector<Side> sides = mesh::sorted_sides(mesh.triangles);
  done.turned = turn_triangles(mesh, sides);
  Fans fans(mesh);
  std::vector<std::span<const Side>> apart;
  for (size_t begin = 0, end; begin < sides.size(); begin = end) {
    end = mesh::end_of_edge(sides, begin);
    if (end - begin == 2 && sides[begin].sign != sides[begin + 1].sign)
      fans.join(sides[begin], sides[begin + 1]);
    else if (end - begin > 2)
      apart.push_back(std::span<const Side>(sides).subspan(begin, end - begin));
  }
  for (const std::span<const Side> edge : apart) {
    const std::vector<Side> loose = fans.loose(edge);
    if (loose.size() != 2 || loose[0].sign == loose[1].sign) continue;
    fans.join(loose[0], loose[1]);
    ++done.stitched_edges;
  }
  fans.split(done);
  return done;
}

}  // namespace nif::repair
