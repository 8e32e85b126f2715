// Finds the ring of a vertex or triangle by exact integer square roots, because the root of a double alone
// would be rounded. The upper cap is the lower one upside down.
#include "mesh/generate/stacked_rings.hpp"

#include <algorithm>
#include <cmath>

namespace nif::generate {
namespace {

/// The largest integer whose square is at most `x`.
uint64_t whole_root(uint64_t x) {
  auto root = uint64_t(std::sqrt(double(x)));
  while (root * root > x) --root;
  while ((root + 1) * (root + 1) <= x) ++root;
  return root;
}

}  // namespace

StackedRings::StackedRings(uint64_t triangles, double rings_a_turn) {
  // 8 cap (cap + body) triangles, and 4 cap vertices in a ring of the body.
  cap_ = std::max<uint64_t>(1, uint64_t(std::sqrt(double(triangles) / (8 + 32 * rings_a_turn)) + 0.5));
  body_ = triangles / (8 * cap_) - cap_;
}

StackedRings::Place StackedRings::place(uint64_t vertex) const {
  const bool upper = vertex >= vertex_count() - start(cap_);
  if (!upper && vertex >= start(cap_)) {
    const uint64_t at = vertex - start(cap_), ring = at / (4 * cap_);
    return {double(at % (4 * cap_)) / double(4 * cap_), 0, double(ring) / double(body_)};
  }
  const uint64_t from_pole = upper ? vertex_count() - 1 - vertex : vertex;
  if (from_pole == 0) return {0, upper ? 1.0 : -1.0, upper ? 1.0 : 0.0};
  const uint64_t ring = (1 + whole_root(2 * from_pole - 1)) / 2;
  const uint64_t at = vertex - (upper ? vertex_count() - start(ring + 1) : start(ring));
  const double below = double(ring) / double(cap_) - 1;
  return {double(at) / double(4 * ring), upper ? -below : below, upper ? 1.0 : 0.0};
}

uint32_t StackedRings::lower(uint64_t k, uint64_t at) const {
  return k == 0 ? 0u : uint32_t(start(k) + at % (4 * k));
}

uint32_t StackedRings::upper(uint64_t k, uint64_t at) const {
  if (k == 0) return uint32_t(vertex_count() - 1);
  return uint32_t(vertex_count() - start(k + 1) + (4 * k - at % (4 * k)) % (4 * k));
}

mesh::Triangle StackedRings::triangle(uint64_t index) const {
  const uint64_t of_cap = 4 * cap_ * cap_;
  const bool below = index < of_cap, above = index >= triangle_count() - of_cap;
  if (below || above) {
    // The strip from ring r to ring r + 1 has, in each quarter, r + 1 triangles with an edge on the outer
    // ring and r with one on the inner.
    const uint64_t from_pole = below ? index : triangle_count() - 1 - index;
    const uint64_t r = whole_root(from_pole / 4), in_strip = from_pole - 4 * r * r;
    const uint64_t quarter = in_strip / (2 * r + 1), step = in_strip % (2 * r + 1);
    const uint64_t inner = quarter * r + step / 2, outer = quarter * (r + 1) + step / 2;
    const auto vertex = [&](uint64_t k, uint64_t at) { return below ? lower(k, at) : upper(k, at); };
    if (step % 2 == 0) return {vertex(r + 1, outer + 1), vertex(r + 1, outer), vertex(r, inner)};
    return {vertex(r, inner), vertex(r, inner + 1), vertex(r + 1, outer + 1)};
  }
  const uint64_t quad = (index - of_cap) / 2, around = 4 * cap_, j = quad % around;
  const auto low = uint32_t(start(cap_) + quad / around * around), high = uint32_t(low + around);
  const auto here = uint32_t(j), after = uint32_t(j + 1 == around ? 0 : j + 1);
  return index % 2 == 0 ? mesh::Triangle{low + here, low + after, high + after}
                        : mesh::Triangle{low + here, high + after, high + here};
}

}  // namespace nif::generate
