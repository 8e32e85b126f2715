#include "bake/closure.hpp"

#include <numeric>

#include "formats/mesh/disjoint_sets.hpp"
#include "formats/mesh/sides.hpp"

namespace nif::bake {

ClosedComponents find_closed_components(const mesh::CleanMesh& surface) {
  // Slivers have no area but their edges count: without them a closed surface would look torn.
  const size_t solid = surface.triangles.size(), count = solid + surface.slivers.size();
  std::vector<mesh::Side> sides = mesh::sorted_sides(surface.triangles, surface.slivers);
  mesh::DisjointSets sets(count);
  for (size_t i = 1; i < sides.size(); ++i) {
    if (sides[i].edge == sides[i - 1].edge) sets.unite(sides[i].triangle, sides[i - 1].triangle);
  }
  std::vector<uint8_t> open(count, 0);  // by representative
  for (size_t i = 0; i < sides.size();) {
    int64_t balance = 0;
    const size_t begin = i;
    for (; i < sides.size() && sides[i].edge == sides[begin].edge; ++i) balance += sides[i].sign;
    if (balance != 0) open[sets.find(sides[begin].triangle)] = 1;
  }
  sides = {};

  // Count, then place: triangles of one component end up together, in the order of the mesh.
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
  closed.triangles.resize(closed.first.back());
  std::vector<uint32_t> next(closed.first.begin(), closed.first.end() - 1);
  for (size_t t = 0; t < solid; ++t) {
    const uint32_t root = sets.find(uint32_t(t));
    if (!open[root]) closed.triangles[next[component[root]]++] = surface.triangles[t];
  }
  return closed;
}

}  // namespace nif::bake
