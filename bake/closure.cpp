#include "bake/closure.hpp"

#include <tbb/parallel_sort.h>

#include <numeric>

namespace nif::bake {
namespace {

/// One side of a triangle: the edge without direction, the triangle, and the direction it is passed in.
struct Side {
  uint64_t edge;
  uint32_t triangle;
  int32_t sign;
};

class DisjointSets {
 public:
  explicit DisjointSets(size_t count) : parent_(count) { std::iota(parent_.begin(), parent_.end(), 0u); }
  uint32_t find(uint32_t i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  /// The smaller index stays the representative, so that components are numbered by their first triangle.
  void unite(uint32_t a, uint32_t b) {
    a = find(a), b = find(b);
    parent_[a < b ? b : a] = a < b ? a : b;
  }

 private:
  std::vector<uint32_t> parent_;
};

}  // namespace

ClosedComponents find_closed_components(const mesh::CleanMesh& surface) {
  // Slivers have no area but their edges count: without them a closed surface would look torn.
  const size_t solid = surface.triangles.size(), count = solid + surface.slivers.size();
  auto triangle = [&](size_t t) { return t < solid ? surface.triangles[t] : surface.slivers[t - solid]; };

  std::vector<Side> sides;
  sides.reserve(count * 3);
  for (size_t t = 0; t < count; ++t) {
    const mesh::Triangle v = triangle(t);
    for (int e = 0; e < 3; ++e) {
      const uint32_t a = v[e], b = v[(e + 1) % 3];
      const uint64_t edge = a < b ? uint64_t{a} << 32 | b : uint64_t{b} << 32 | a;
      sides.push_back({edge, uint32_t(t), a < b ? 1 : -1});
    }
  }
  tbb::parallel_sort(sides.begin(), sides.end(),
                     [](const Side& a, const Side& b) { return a.edge < b.edge; });

  DisjointSets sets(count);
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
