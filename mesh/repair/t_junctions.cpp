// A tree finds all vertices near open edges. Then the edges are split tentatively. Splits that close nothing
// or do harm are undone, which changes what others close, so this is repeated until none is left.
#include "mesh/repair/t_junctions.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <vector>

#include "formats/base/collinear.hpp"
#include "formats/base/vector.hpp"
#include "formats/mesh/sides.hpp"
#include "mesh/repair/box_tree.hpp"

namespace nif::repair {
namespace {

using mesh::Float3;
using mesh::Mesh;
using mesh::Side;
using mesh::Triangle;

uint64_t edge_of(uint32_t a, uint32_t b) { return a < b ? uint64_t{a} << 32 | b : uint64_t{b} << 32 | a; }

/// An edge with one triangle, from a to b in the triangle's direction.
struct OpenEdge {
  uint32_t a, b, triangle;
  uint16_t corner;
  double distance;            ///< within which vertices count as on the edge
  size_t begin = 0, end = 0;  ///< range of its hits
};

/// A vertex that lies on an open edge.
struct Hit {
  uint32_t edge, vertex;
  double along;   ///< 0 at a, 1 at b
  bool near_end;  ///< it could have been welded to a or b, but was not
  bool alive;     ///< whether the edge is split there
};

class Seams {
 public:
  Seams(Mesh& mesh, double distance) : mesh_(mesh), sides_(mesh::sorted_sides(mesh.triangles)) {
    find_open_edges(distance);
  }

  TJunctions close() {
    TJunctions done;
    if (!find_hits()) return {.gave_up = true};
    if (hits_.empty() || !keep_those_along_seams()) return {.gave_up = !hits_.empty()};
    constexpr int kRounds = 40, kGentle = 8;
    for (int round = 0; take_back(round >= kGentle); ++round)
      if (round == kRounds) return {.gave_up = true};
    for (const OpenEdge& edge : open_) {
      const auto alive =
          std::count_if(hits_.begin() + std::ptrdiff_t(edge.begin), hits_.begin() + std::ptrdiff_t(edge.end),
                        [](const Hit& hit) { return hit.alive; });
      done.edges += alive > 0;
      done.vertices += uint64_t(alive);
    }
    if (done.edges > 0) mesh_.triangles = all_parts();
    return done;
  }

 private:
  /// The split open edges of a triangle: index into open_ by corner, or kNone.
  static constexpr uint32_t kNone = UINT32_MAX;
  using Edges = std::array<uint32_t, 3>;

  Double3 at(uint32_t vertex) const { return to_double(mesh_.positions[vertex]); }

  void find_open_edges(double distance) {
    for (size_t begin = 0, end; begin < sides_.size(); begin = end) {
      end = mesh::end_of_edge(sides_, begin);
      if (end - begin != 1) continue;
      const Side& side = sides_[begin];
      const Triangle& t = mesh_.triangles[side.triangle];
      OpenEdge edge{t[side.corner], t[(side.corner + 1) % 3], side.triangle, side.corner, distance};
      for (const uint32_t v : {edge.a, edge.b})
        for (const float x : mesh_.positions[v])
          edge.distance = std::max(edge.distance, std::abs(double(x)) * kOnEdge);
      open_.push_back(edge);
      rim_.insert(rim_.end(), {edge.a, edge.b});
    }
    std::sort(rim_.begin(), rim_.end());
    rim_.erase(std::unique(rim_.begin(), rim_.end()), rim_.end());
    // The open edges at each vertex.
    for (uint32_t e = 0; e < open_.size(); ++e)
      for (const uint32_t v : {open_[e].a, open_[e].b}) at_vertex_.push_back(uint64_t{v} << 32 | e);
    std::sort(at_vertex_.begin(), at_vertex_.end());
    steps_left_ = 1'000'000 + 300 * uint64_t(open_.size());
    most_hits_ = 1'000'000 + 16 * uint64_t(open_.size());
  }

  bool find_hits() {
    std::vector<mesh::Box> points;
    for (const uint32_t v : rim_) points.push_back({mesh_.positions[v], mesh_.positions[v]});
    const BoxTree tree(std::move(points));
    for (uint32_t e = 0; e < open_.size(); ++e) {
      OpenEdge& edge = open_[e];
      edge.begin = hits_.size();
      const uint32_t opposite = mesh_.triangles[edge.triangle][(edge.corner + 2) % 3];
      const Double3 a = at(edge.a), along = at(edge.b) - a;
      const double squared = dot(along, along), limit = edge.distance * edge.distance;
      tree.visit([&](const mesh::Box& box) { return step() && may_meet(edge, a, along, box); },
                 [&](uint32_t i) {
                   const uint32_t v = rim_[i];
                   if (v == edge.a || v == edge.b || v == opposite) return true;
                   const Double3 from_a = at(v) - a, from_b = from_a - along;
                   const double part = dot(from_a, along) / squared;
                   const Double3 off = from_a - along * part;
                   if (!(part > 0 && part < 1 && dot(off, off) <= limit)) return true;
                   const bool near_end = dot(from_a, from_a) <= limit || dot(from_b, from_b) <= limit;
                   hits_.push_back({e, v, part, near_end, true});
                   return hits_.size() <= most_hits_;
                 });
      if (steps_left_ == 0 || hits_.size() > most_hits_) return false;
      const auto first = hits_.begin() + std::ptrdiff_t(edge.begin);
      for (auto hit = first; hit != hits_.end(); ++hit) on_edge_.push_back(uint64_t{e} << 32 | hit->vertex);
      std::sort(on_edge_.begin() + std::ptrdiff_t(edge.begin), on_edge_.end());
      std::sort(first, hits_.end(), [](const Hit& x, const Hit& y) {
        return x.along != y.along ? x.along < y.along : x.vertex < y.vertex;
      });
      edge.end = hits_.size();
    }
    return true;
  }

  /// Returns false only if no point of the box is within the distance of the edge: an axis separates them.
  static bool may_meet(const OpenEdge& edge, const Double3& a, const Double3& along, const mesh::Box& box) {
    Double3 half, from;  // half the box's size, and its centre relative to the centre of the edge
    for (size_t i = 0; i < 3; ++i) {
      half[i] = (double(box.max[i]) - double(box.min[i])) / 2 + edge.distance * 1.001;
      from[i] = (double(box.max[i]) + double(box.min[i])) / 2 - (a[i] + along[i] / 2);
      if (std::abs(from[i]) > half[i] + std::abs(along[i]) / 2) return false;
    }
    for (size_t i = 0; i < 3; ++i) {
      const size_t j = (i + 1) % 3, k = (i + 2) % 3;
      const double reach = half[j] * std::abs(along[k]) + half[k] * std::abs(along[j]);
      if (std::abs(from[j] * along[k] - from[k] * along[j]) > reach * 1.001) return false;
    }
    return true;
  }

  bool step() {
    if (steps_left_ > 0) --steps_left_;
    return steps_left_ > 0;
  }

  /// Keeps a vertex on an edge only if an open edge at that vertex runs along the edge: its other end is also
  /// on the edge, or an end of the edge is on it.
  bool keep_those_along_seams() {
    const auto lies_on = [&](uint32_t vertex, uint32_t edge) {
      return std::binary_search(on_edge_.begin(), on_edge_.end(), uint64_t{edge} << 32 | vertex);
    };
    for (Hit& hit : hits_) {
      const OpenEdge& edge = open_[hit.edge];
      hit.alive = false;
      auto other = std::lower_bound(at_vertex_.begin(), at_vertex_.end(), uint64_t{hit.vertex} << 32);
      for (; !hit.alive && other != at_vertex_.end() && *other >> 32 == hit.vertex; ++other) {
        if (!step()) return false;
        const auto e = uint32_t(*other);
        const uint32_t end = open_[e].a == hit.vertex ? open_[e].b : open_[e].a;
        hit.alive = end == edge.a || end == edge.b || lies_on(end, hit.edge) || lies_on(edge.a, e) ||
                    lies_on(edge.b, e);
      }
    }
    return true;
  }

  /// The edge's vertices, from a to b.
  void chain_of(const OpenEdge& edge, std::vector<uint32_t>& chain) const {
    chain.assign(1, edge.a);
    for (size_t i = edge.begin; i < edge.end; ++i)
      if (hits_[i].alive) chain.push_back(hits_[i].vertex);
    chain.push_back(edge.b);
  }
  bool is_split(uint32_t edge) const {
    return edge != kNone && std::any_of(hits_.begin() + std::ptrdiff_t(open_[edge].begin),
                                        hits_.begin() + std::ptrdiff_t(open_[edge].end),
                                        [](const Hit& hit) { return hit.alive; });
  }

  /// The split triangles, ascending, with their split edges.
  std::vector<std::pair<uint32_t, Edges>> split_triangles() const {
    std::vector<std::pair<uint32_t, Edges>> found;
    std::vector<std::pair<uint32_t, uint32_t>> order;
    for (uint32_t e = 0; e < open_.size(); ++e)
      if (is_split(e)) order.emplace_back(open_[e].triangle, e);
    std::sort(order.begin(), order.end());
    for (const auto& [triangle, edge] : order) {
      if (found.empty() || found.back().first != triangle) found.push_back({triangle, {kNone, kNone, kNone}});
      found.back().second[open_[edge].corner] = edge;
    }
    return found;
  }

  /// The parts of a triangle: those at a split edge form a fan around the opposite corner.
  void parts_of(uint32_t triangle, const Edges& edges, std::vector<Triangle>& parts) const {
    const size_t first = parts.size();
    parts.push_back(mesh_.triangles[triangle]);
    std::array<size_t, 3> with{first, first, first};  // the part that contains a whole edge
    std::vector<uint32_t> chain;
    for (size_t k = 0; k < 3; ++k) {
      if (edges[k] == kNone) continue;
      chain_of(open_[edges[k]], chain);
      const size_t at = with[k];
      const Triangle part = parts[at];
      const uint32_t tip =
          part[size_t(std::find(part.begin(), part.end(), chain.front()) - part.begin() + 2) % 3];
      parts[at] = {chain[0], chain[1], tip};
      for (size_t i = 1; i + 1 < chain.size(); ++i) parts.push_back({chain[i], chain[i + 1], tip});
      // The next edge begins where this one ends.
      if (with[(k + 1) % 3] == at) with[(k + 1) % 3] = parts.size() - 1;
    }
  }

  bool is_sound(const Triangle& source, std::span<const Triangle> parts) const {
    const auto normal = [&](const Triangle& t) { return cross(at(t[1]) - at(t[0]), at(t[2]) - at(t[0])); };
    const Double3 whole = normal(source);
    return std::all_of(parts.begin(), parts.end(), [&](const Triangle& t) {
      return dot(whole, normal(t)) > 0 &&
             !collinear(mesh_.positions[t[0]], mesh_.positions[t[1]], mesh_.positions[t[2]]);
    });
  }

  /// Number of sides at an edge after the splits.
  struct Count {
    uint64_t edge;
    size_t sides;
    bool too_many;  ///< three or more, and more than before
  };

  std::vector<Count> count_sides(const std::vector<std::pair<uint32_t, Edges>>& split,
                                 std::span<const Triangle> parts) const {
    std::vector<uint64_t> edges;
    for (const Triangle& t : parts)
      for (size_t c = 0; c < 3; ++c) edges.push_back(edge_of(t[c], t[(c + 1) % 3]));
    std::sort(edges.begin(), edges.end());
    std::vector<Count> counts;
    for (size_t i = 0, end; i < edges.size(); i = end) {
      for (end = i + 1; end < edges.size() && edges[end] == edges[i];) ++end;
      size_t before = 0, stay = 0;
      auto side = std::lower_bound(sides_.begin(), sides_.end(), edges[i],
                                   [](const Side& s, uint64_t edge) { return s.edge < edge; });
      for (; side != sides_.end() && side->edge == edges[i]; ++side, ++before)
        stay += !std::binary_search(split.begin(), split.end(), std::pair(side->triangle, Edges{}),
                                    [](const auto& x, const auto& y) { return x.first < y.first; });
      const size_t sides = stay + (end - i);
      counts.push_back({edges[i], sides, sides > 2 && sides > before});
    }
    return counts;
  }

  void take_back_edge(uint32_t edge) {
    for (size_t i = open_[edge].begin; i < open_[edge].end; ++i) hits_[i].alive = false;
  }

  /// Undoes splits that close nothing or do harm; returns whether there were any. With `whole`, undoes all
  /// splits of an edge together.
  bool take_back(bool whole) {
    const std::vector<std::pair<uint32_t, Edges>> split = split_triangles();
    std::vector<Triangle> parts;
    std::vector<size_t> ends;
    for (const auto& [triangle, edges] : split) {
      parts_of(triangle, edges, parts);
      ends.push_back(parts.size());
    }
    const std::vector<Count> counts = count_sides(split, parts);
    const auto count_at = [&](uint32_t a, uint32_t b) -> const Count& {
      return *std::lower_bound(counts.begin(), counts.end(), edge_of(a, b),
                               [](const Count& count, uint64_t edge) { return count.edge < edge; });
    };
    bool any = false;
    std::vector<uint32_t> chain;
    for (size_t s = 0, begin = 0; s < split.size(); begin = ends[s++]) {
      const auto& [triangle, edges] = split[s];
      const std::span<const Triangle> made = std::span<const Triangle>(parts).subspan(begin, ends[s] - begin);
      const bool harmful = !is_sound(mesh_.triangles[triangle], made) ||
                           std::any_of(made.begin(), made.end(), [&](const Triangle& t) {
                             return count_at(t[0], t[1]).too_many || count_at(t[1], t[2]).too_many ||
                                    count_at(t[2], t[0]).too_many;
                           });
      for (const uint32_t e : edges) {
        if (e == kNone) continue;
        bool bad = harmful;
        chain_of(open_[e], chain);
        size_t at = 0;
        for (size_t i = open_[e].begin; i < open_[e].end && !harmful; ++i) {
          Hit& hit = hits_[i];
          if (!hit.alive) continue;
          ++at;
          const bool before = count_at(chain[at - 1], chain[at]).sides == 2,
                     after = count_at(chain[at], chain[at + 1]).sides == 2;
          // A vertex near an end must not leave a gap there.
          if (hit.near_end ? before && after : before || after) continue;
          hit.alive = false;
          any = bad = true;
        }
        if (bad && (harmful || whole)) take_back_edge(e), any = true;
      }
    }
    return any;
  }

  std::vector<Triangle> all_parts() const {
    const std::vector<std::pair<uint32_t, Edges>> split = split_triangles();
    std::vector<Triangle> triangles;
    triangles.reserve(mesh_.triangles.size() + hits_.size());
    auto next = split.begin();
    for (uint32_t t = 0; t < mesh_.triangles.size(); ++t) {
      if (next != split.end() && next->first == t)
        parts_of(t, (next++)->second, triangles);
      else
        triangles.push_back(mesh_.triangles[t]);
    }
    return triangles;
  }

  Mesh& mesh_;
  std::vector<Side> sides_;
  std::vector<OpenEdge> open_;
  std::vector<uint32_t> rim_;                  ///< vertices of open edges, ascending
  std::vector<uint64_t> at_vertex_, on_edge_;  ///< sorted pairs (vertex, edge) and (edge, vertex)
  std::vector<Hit> hits_;                      ///< by edge, then along it
  uint64_t steps_left_ = 0, most_hits_ = 0;    ///< limits; most meshes need a tenth of them
};

}  // namespace

TJunctions close_t_junctions(Mesh& mesh, double distance) { return Seams(mesh, distance).close(); }

}  // namespace nif::repair
