#include "mesh/repair/repair.hpp"

#include <algorithm>
#include <array>
#include <limits>

#include "formats/base/disjoint_sets.hpp"
#include "formats/base/vector.hpp"
#include "formats/mesh/clean.hpp"
#include "formats/mesh/sides.hpp"
#include "mesh/repair/weld.hpp"

namespace nif::repair {
namespace {

using mesh::Float3;
using mesh::Mesh;
using mesh::Triangle;

/// Leaves out every triangle that has the corners of an earlier one.
uint64_t drop_opposite(std::vector<Triangle>& triangles) {
  struct Key {
    Triangle corners;
    uint32_t index;
    auto operator<=>(const Key&) const = default;
  };
  std::vector<Key> keys(triangles.size());
  for (uint32_t t = 0; t < keys.size(); ++t) {
    keys[t] = {triangles[t], t};
    std::sort(keys[t].corners.begin(), keys[t].corners.end());
  }
  std::sort(keys.begin(), keys.end());
  std::vector<bool> dropped(triangles.size());
  for (size_t i = 1; i < keys.size(); ++i) dropped[keys[i].index] = keys[i].corners == keys[i - 1].corners;
  size_t kept = 0;
  for (size_t t = 0; t < triangles.size(); ++t)
    if (!dropped[t]) triangles[kept++] = triangles[t];
  const size_t count = triangles.size() - kept;
  triangles.resize(kept);
  return count;
}

/// A closed component of a mesh whose edges have two triangles at most.
struct Solid {
  uint32_t piece;
  Float3 low, high;
  double volume = 0;

  bool within(const Solid& other) const {
    for (size_t axis = 0; axis < 3; ++axis)
      if (low[axis] < other.low[axis] || high[axis] > other.high[axis]) return false;
    return low != other.low || high != other.high;
  }
};

/// Turns the outermost of closed components to face outwards. The mesh is manifold and faces one way.
uint64_t turn_outwards(Mesh& mesh) {
  const std::vector<mesh::Side> sides = mesh::sorted_sides(mesh.triangles);
  DisjointSets pieces(mesh.triangles.size());
  for (size_t i = 1; i < sides.size(); ++i)
    if (sides[i].edge == sides[i - 1].edge) pieces.unite(sides[i].triangle, sides[i - 1].triangle);
  std::vector<bool> open(mesh.triangles.size());
  for (size_t begin = 0, end; begin < sides.size(); begin = end) {
    end = mesh::end_of_edge(sides, begin);
    if (end - begin != 2) open[pieces.find(sides[begin].triangle)] = true;
  }
  std::vector<Solid> solids;
  std::vector<uint32_t> solid_of(mesh.triangles.size());
  constexpr float kHuge = std::numeric_limits<float>::max();
  for (uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    const uint32_t piece = pieces.find(t);
    if (open[piece]) continue;
    if (piece == t) {
      solid_of[t] = uint32_t(solids.size());
      solids.push_back({t, {kHuge, kHuge, kHuge}, {-kHuge, -kHuge, -kHuge}});
    }
    Solid& solid = solids[solid_of[piece]];
    // From a vertex of its own, so that far from the origin no digits are lost.
    const Double3 origin = to_double(mesh.positions[mesh.triangles[piece][0]]);
    std::array<Double3, 3> corners;
    for (size_t i = 0; i < 3; ++i) {
      const Float3& p = mesh.positions[mesh.triangles[t][i]];
      corners[i] = to_double(p) - origin;
      for (size_t axis = 0; axis < 3; ++axis) {
        solid.low[axis] = std::min(solid.low[axis], p[axis]);
        solid.high[axis] = std::max(solid.high[axis], p[axis]);
      }
    }
    solid.volume += dot(corners[0], cross(corners[1], corners[2])) / 6;
  }
  // What could lie around a solid starts no later along x.
  std::sort(solids.begin(), solids.end(), [](const Solid& a, const Solid& b) {
    return a.low[0] != b.low[0] ? a.low[0] < b.low[0] : a.piece < b.piece;
  });
  std::vector<bool> turned(mesh.triangles.size());
  uint64_t count = 0;
  for (const Solid& solid : solids) {
    if (solid.volume >= 0) continue;
    const auto last = std::upper_bound(solids.begin(), solids.end(), solid.low[0],
                                       [](float x, const Solid& other) { return x < other.low[0]; });
    if (std::any_of(solids.begin(), last, [&](const Solid& other) { return solid.within(other); })) continue;
    turned[solid.piece] = true;
    ++count;
  }
  for (uint32_t t = 0; t < mesh.triangles.size(); ++t)
    if (turned[pieces.find(t)]) std::swap(mesh.triangles[t][1], mesh.triangles[t][2]);
  return count;
}

}  // namespace

Report& Report::operator+=(const Report& other) {
  welded += other.welded, degenerate += other.degenerate, duplicate += other.duplicate;
  opposite += other.opposite, turned_solids += other.turned_solids;
  mending.turned += other.mending.turned, mending.split_vertices += other.mending.split_vertices;
  mending.stitched_edges += other.mending.stitched_edges;
  mending.filled_holes += other.mending.filled_holes;
  mending.unfilled_holes += other.mending.unfilled_holes;
  mending.fill_triangles += other.mending.fill_triangles;
  return *this;
}

Report repair(Mesh& mesh, const Options& options, const std::atomic<bool>& cancel) {
  Report report;
  if (options.weld > 0) snap_vertices(mesh.positions, options.weld);
  mesh::CleanMesh clean = mesh::clean(mesh);
  report.welded = clean.report.welded_positions;
  report.degenerate = clean.report.degenerate;
  report.duplicate = clean.report.duplicate;
  // A sliver with three different corners holds its neighbours together; without it they would come apart.
  mesh.triangles = std::move(clean.triangles);
  mesh.triangles.insert(mesh.triangles.end(), clean.slivers.begin(), clean.slivers.end());
  report.degenerate -= clean.slivers.size();
  mesh.positions = std::move(clean.positions);
  if (!options.keep_opposite) report.opposite = drop_opposite(mesh.triangles);
  if (cancel) throw Error(Status::interrupted, "the repair was cancelled");
  report.mending = cgal::mend(mesh, options.hole_edges, cancel);
  report.turned_solids = turn_outwards(mesh);
  return report;
}

}  // namespace nif::repair
