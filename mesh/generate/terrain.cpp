// `terrain`: mountains and valleys as the top of a square chunk with walls and a flat bottom.
#include <algorithm>
#include <cmath>

#include "mesh/generate/computed.hpp"
#include "mesh/generate/noise.hpp"
#include "mesh/generate/shapes.hpp"

namespace nif::generate {
namespace {

constexpr double kBottom = -0.35;  ///< below the lowest valley of any seed

/// Vertices: the top in rows, the bottom's border, the bottom's middle. Triangles: the top, the walls, the
/// bottom as a fan about its middle.
class Terrain {
 public:
  explicit Terrain(const Request& request) : noise_(request.seed, 1), bends_(request.seed, 2) {
    // 2 nx nz + 6 (nx + nz) triangles: nearly a square, and then as long as they allow.
    nx_ = std::max<uint64_t>(2, uint64_t(std::sqrt(double(request.triangles) / 2 + 9) - 3));
    nz_ = (request.triangles - 6 * nx_) / (2 * nx_ + 6);
  }

  uint64_t vertex_count() const { return top_vertices() + border() + 1; }
  uint64_t triangle_count() const { return 2 * nx_ * nz_ + 3 * border(); }

  Double3 vertex(uint64_t index) const {
    if (index < top_vertices()) return surface(index % (nx_ + 1), index / (nx_ + 1));
    if (index == vertex_count() - 1) return {0, kBottom, 0};
    const auto [i, k] = border_point(index - top_vertices());
    Double3 point = flat(i, k);
    point[1] = kBottom;
    return point;
  }

  mesh::Triangle triangle(uint64_t index) const {
    if (index < 2 * nx_ * nz_) {
      const uint64_t quad = index / 2, i = quad % nx_, k = quad / nx_;
      const uint32_t a = top(i, k), b = top(i, k + 1), c = top(i + 1, k + 1), d = top(i + 1, k);
      return index % 2 == 0 ? mesh::Triangle{a, b, c} : mesh::Triangle{a, c, d};
    }
    index -= 2 * nx_ * nz_;
    const uint64_t of_wall = 2 * border();
    const uint64_t at = index < of_wall ? index / 2 : index - of_wall,
                   after = at + 1 == border() ? 0 : at + 1;
    const auto low = uint32_t(top_vertices() + at), low_after = uint32_t(top_vertices() + after);
    if (index >= of_wall) return {low_after, low, uint32_t(vertex_count() - 1)};
    const auto [i, k] = border_point(at);
    const auto [i_after, k_after] = border_point(after);
    return index % 2 == 0 ? mesh::Triangle{low, low_after, top(i_after, k_after)}
                          : mesh::Triangle{low, top(i_after, k_after), top(i, k)};
  }

 private:
  struct Point {
    uint64_t i, k;
  };

  uint64_t top_vertices() const { return (nx_ + 1) * (nz_ + 1); }
  uint64_t border() const { return 2 * (nx_ + nz_); }
  uint32_t top(uint64_t i, uint64_t k) const { return uint32_t(k * (nx_ + 1) + i); }

  /// Along the border, counter-clockwise seen from above.
  Point border_point(uint64_t at) const {
    if (at < nz_) return {0, at};
    if (at < nz_ + nx_) return {at - nz_, nz_};
    if (at < 2 * nz_ + nx_) return {nx_, 2 * nz_ + nx_ - at};
    return {border() - at, 0};
  }

  Double3 flat(uint64_t i, uint64_t k) const {
    return {2 * double(i) / double(nx_) - 1, 0, 2 * double(k) / double(nz_) - 1};
  }

  Double3 surface(uint64_t i, uint64_t k) const {
    const Double3 p = flat(i, k);
    // Ridges in a bent space, high where a slow noise is, plus gravel of all sizes: valleys stay calm.
    const Double3 bent = bends_.warp(p * 1.6, 0.2);
    const double range = smoothstep(-0.45, 0.6, bends_.octaves(p * 0.9 + Double3{5, 5, 5}, 2, 0.5));
    const double ridges = noise_.ridges(bent * 0.9, 11, 0.45);
    const double hills = noise_.octaves(p * 2.3 + Double3{9, 9, 9}, 12, 0.48);
    const double height = 0.06 * hills + range * (0.28 * ridges + 0.03 * hills);
    return {p[0], std::fmax(height - 0.1, kBottom + 0.05), p[2]};
  }

  Noise noise_, bends_;
  uint64_t nx_, nz_;
};

}  // namespace

std::unique_ptr<mesh::MeshSource> make_terrain(const Request& request) { return computed(Terrain(request)); }

}  // namespace nif::generate
