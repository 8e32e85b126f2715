// One parallel sort, by edge and then by triangle. To save memory, edges can be processed in parts. A hash
// selects the part of an edge, because neighbours in the mesh have numbers that are close together.
#include "formats/mesh/sides.hpp"

#include <tbb/parallel_sort.h>

namespace nif::mesh {

void sort_sides(std::span<const Triangle> triangles, std::span<const Triangle> more, size_t part,
                size_t parts, std::vector<Side>& sides) {
  const size_t count = triangles.size() + more.size();
  sides.clear();
  sides.reserve(count * 3 / parts + count / 64);  // the sizes of parts differ a little
  for (size_t t = 0; t < count; ++t) {
    const Triangle& v = t < triangles.size() ? triangles[t] : more[t - triangles.size()];
    for (uint16_t corner = 0; corner < 3; ++corner) {
      const uint32_t a = v[corner], b = v[(corner + 1) % 3];
      const uint64_t edge = a < b ? uint64_t{a} << 32 | b : uint64_t{b} << 32 | a;
      // Neighbours in the mesh have numbers close to each other, so a range of numbers may contain many
      // edges.
      if (parts > 1 && (edge * 0x9E3779B97F4A7C15u >> 32) * parts >> 32 != part) continue;
      sides.push_back({edge, uint32_t(t), corner, int16_t(a < b ? 1 : -1)});
    }
  }
  tbb::parallel_sort(sides.begin(), sides.end(), [](const Side& a, const Side& b) {
    return a.edge != b.edge ? a.edge < b.edge : a.triangle < b.triangle;
  });
}

std::vector<Side> sorted_sides(std::span<const Triangle> triangles, std::span<const Triangle> more) {
  std::vector<Side> sides;
  sort_sides(triangles, more, 0, 1, sides);
  return sides;
}

}  // namespace nif::mesh
