// Runs the repairs in an order that matters, because each step relies on those before it. orient() cuts the
// surface apart, so the rims of true holes are recorded before it; otherwise the cuts would be filled, too.
#include "mesh/repair/repair.hpp"

#include <algorithm>
#include <span>
#include <vector>

#include "formats/mesh/clean.hpp"
#include "formats/mesh/sides.hpp"
#include "mesh/repair/nesting.hpp"
#include "mesh/repair/orient.hpp"
#include "mesh/repair/snap.hpp"
#include "mesh/repair/t_junctions.hpp"

namespace nif::repair {
namespace {

using mesh::Mesh;
using mesh::Triangle;

/// Drops every triangle that has the corners of an earlier one.
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

/// The edges of a mesh with one triangle, as sorted pairs of vertices.
std::vector<uint64_t> rims_of(const Mesh& mesh) {
  std::vector<uint64_t> edges;
  mesh::for_each_edge(mesh.triangles, {}, [&](std::span<const mesh::Side> sides) {
    if (sides.size() == 1) edges.push_back(sides[0].edge);
  });
  std::sort(edges.begin(), edges.end());
  return edges;
}

}  // namespace

Report& Report::operator+=(const Report& other) {
  welded += other.welded, degenerate += other.degenerate, duplicate += other.duplicate;
  opposite += other.opposite;
  split_edges += other.split_edges, t_junctions += other.t_junctions;
  unsearched_meshes += other.unsearched_meshes;
  turned += other.turned, split_vertices += other.split_vertices, stitched_edges += other.stitched_edges;
  holes.filled += other.holes.filled, holes.unfilled += other.holes.unfilled;
  holes.triangles += other.holes.triangles;
  turned_solids += other.turned_solids, unclear_solids += other.unclear_solids;
  return *this;
}

Report repair(Mesh& mesh, const Options& options, const std::atomic<bool>& cancel) {
  if (options.hole_edges > 0) cgal::require("hole filling");
  const auto stop_if_cancelled = [&] {
    if (cancel) throw Error(Status::interrupted, "the repair was cancelled");
  };
  Report report;
  if (options.weld > 0) snap_vertices(mesh.positions, options.weld);
  mesh::CleanMesh clean = mesh::clean(mesh);
  report.welded = clean.report.welded_positions;
  report.degenerate = clean.report.degenerate;
  report.duplicate = clean.report.duplicate;
  // A sliver with three distinct corners connects its neighbours; without it they would come apart.
  mesh.triangles = std::move(clean.triangles);
  mesh.triangles.insert(mesh.triangles.end(), clean.slivers.begin(), clean.slivers.end());
  report.degenerate -= clean.slivers.size();
  mesh.positions = std::move(clean.positions);
  mesh.look = {};
  mesh.alpha = {};
  mesh.alpha_maps = {};
  mesh.holes = {};
  if (!options.keep_opposite) report.opposite = drop_opposite(mesh.triangles);
  stop_if_cancelled();
  if (!options.keep_t_junctions) {
    const TJunctions closed = close_t_junctions(mesh, options.weld);
    report.split_edges = closed.edges, report.t_junctions = closed.vertices;
    report.unsearched_meshes = closed.gave_up;
    stop_if_cancelled();
  }
  const std::vector<uint64_t> rims = options.hole_edges > 0 ? rims_of(mesh) : std::vector<uint64_t>();
  const Orienting oriented = orient(mesh);
  report.turned = oriented.turned, report.split_vertices = oriented.split_vertices;
  report.stitched_edges = oriented.stitched_edges;
  stop_if_cancelled();
  if (options.hole_edges > 0) {
    const auto is_rim = [&](uint32_t v, uint32_t w) {
      const auto [a, b] = std::minmax(oriented.origin[v], oriented.origin[w]);
      return std::binary_search(rims.begin(), rims.end(), uint64_t{a} << 32 | b);
    };
    report.holes = cgal::fill_holes(mesh, options.hole_edges, is_rim, cancel);
  }
  const Nesting placed = turn_solids(mesh, options.keep_nested);
  report.turned_solids = placed.turned, report.unclear_solids = placed.unclear;
  return report;
}

}  // namespace nif::repair
