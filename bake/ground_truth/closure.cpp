// Finds closed components. Disjoint sets join triangles over edges, and the balance of each edge tells
// whether a component is closed. Open components get a second try, with some triangles turned to face as
// their neighbours do.
#include "bake/ground_truth/closure.hpp"

#include <algorithm>
#include <numeric>

#include "formats/base/disjoint_sets.hpp"
#include "formats/mesh/sides.hpp"

namespace nif::bake {
namespace {

using mesh::CleanMesh;
using mesh::Side;

/// By triangle: does it have an edge that is not passed equally often in both directions? `turned`, by
/// triangle, may be empty. Unites triangles at the same edge.
std::vector<bool> find_unbalanced(const CleanMesh& surface, const std::vector<bool>& turned,
                                  DisjointSets& components) {
  std::vector<bool> unbalanced(surface.triangles.size() + surface.slivers.size());
  mesh::for_each_edge(surface.triangles, surface.slivers, [&](std::span<const Side> sides) {
    int64_t balance = 0;
    for (const Side& side : sides) {
      balance += !turned.empty() && turned[side.triangle] ? -side.sign : side.sign;
      components.unite(side.triangle, sides[0].triangle);
    }
    if (balance != 0) unbalanced[sides[0].triangle] = true;
  });
  return unbalanced;
}

/// By representative: does the component have an unbalanced triangle, or one with holes?
std::vector<bool> find_open(const CleanMesh& surface, const std::vector<bool>& unbalanced,
                            DisjointSets& components) {
  const auto has_holes = [&](size_t t) { return t < surface.holes.size() && surface.holes[t].any(); };
  std::vector<bool> open(unbalanced.size());
  for (size_t t = 0; t < open.size(); ++t)
    if (unbalanced[t] || has_holes(t)) open[components.find(uint32_t(t))] = true;
  return open;
}

/// Which triangles of open components to turn so that all face as their neighbours do across edges of two
/// triangles, as few as possible. None in a piece of surface that has only one side.
std::vector<bool> find_turned(const CleanMesh& surface, DisjointSets& components,
                              const std::vector<bool>& open) {
  // Each triangle twice, as it is (2 t) and turned (2 t + 1): sets are the ways in which pieces can face.
  const size_t count = open.size();
  DisjointSets ways(2 * count);
  mesh::for_each_edge(surface.triangles, surface.slivers, [&](std::span<const Side> sides) {
    if (sides.size() != 2 || !open[components.find(sides[0].triangle)]) return;
    const uint32_t a = 2 * sides[0].triangle, b = 2 * sides[1].triangle;
    const uint32_t differ = sides[0].sign == sides[1].sign;
    ways.unite(a, b + differ);
    ways.unite(a + 1, b + (1 - differ));
  });
  // The smaller number, which is even, names a piece's two ways: that of its first triangle as it is.
  const auto piece = [&](uint32_t t) { return std::min(ways.find(2 * t), ways.find(2 * t + 1)); };
  const auto against = [&](uint32_t t) { return ways.find(2 * t) != piece(t); };
  std::vector<int32_t> majority(count);
  for (uint32_t t = 0; t < count; ++t) majority[piece(t) / 2] += against(t) ? -1 : 1;
  std::vector<bool> turned(count);
  for (uint32_t t = 0; t < count; ++t) {
    const bool one_sided = ways.find(2 * t) == ways.find(2 * t + 1);
    turned[t] = !one_sided && against(t) == (majority[piece(t) / 2] >= 0);
  }
  return turned;
}

}  // namespace

ClosedComponents find_closed_components(const CleanMesh& surface) {
  // Slivers have no area, but their edges count: without them a closed surface would look torn.
  const size_t solid = surface.triangles.size(), count = solid + surface.slivers.size();
  DisjointSets sets(count);
  std::vector<bool> turned, open = find_open(surface, find_unbalanced(surface, turned, sets), sets);
  if (std::ranges::find(open, true) != open.end()) {
    turned = find_turned(surface, sets, open);
    open = find_open(surface, find_unbalanced(surface, turned, sets), sets);
  }

  // First count, then place: triangles of one component end up together, in the order of the mesh.
  constexpr uint32_t kNone = 0xffffffffu;
  std::vector<uint32_t> component(count, kNone);
  ClosedComponents closed;
  std::vector<uint32_t> sizes;
  for (size_t t = 0; t < count; ++t) {
    const uint32_t root = sets.find(uint32_t(t));
    if (open[root]) {
      closed.open_components += root == t;
      continue;
    }
    if (root == t) {
      component[t] = uint32_t(sizes.size());
      sizes.push_back(0);
    }
    if (t < solid) ++sizes[component[root]];
  }
  closed.first.assign(sizes.size() + 1, 0);
  std::partial_sum(sizes.begin(), sizes.end(), closed.first.begin() + 1);
  closed.members.resize(closed.first.back());
  std::vector<uint32_t> next(closed.first.begin(), closed.first.end() - 1);
  for (size_t t = 0; t < solid; ++t) {
    const uint32_t root = sets.find(uint32_t(t));
    if (!open[root])
      closed.members[next[component[root]]++] = uint32_t(2 * t + (!turned.empty() && turned[t]));
  }
  for (size_t t = 0; t < turned.size(); ++t) closed.turned += turned[t] && !open[sets.find(uint32_t(t))];
  return closed;
}

}  // namespace nif::bake
