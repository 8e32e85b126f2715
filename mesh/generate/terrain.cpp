// `terrain`: mountains and valleys as the top of a square chunk with walls and a flat bottom.
#include <algorithm>
#include <cmath>

#include "mesh/generate/computed.hpp"
#include "mesh/generate/noise.hpp"
#include "mesh/generate/shapes.hpp"
#include "mesh/generate/slab.hpp"

namespace nif::generate {
namespace {

constexpr double kBottom = -0.35;  ///< below the lowest valley of any seed

class Terrain {
 public:
  explicit Terrain(const Request& request) : noise_(request.seed, 1), bends_(request.seed, 2) {
    // 2 nx nz + 6 (nx + nz) triangles: nearly square, then as long as the number of triangles allows.
    slab_.nx = std::max<uint64_t>(2, uint64_t(std::sqrt(double(request.triangles) / 2 + 9) - 3));
    slab_.nz = (request.triangles - 6 * slab_.nx) / (2 * slab_.nx + 6);
  }

  uint64_t vertex_count() const { return slab_.vertex_count(); }
  uint64_t triangle_count() const { return slab_.triangle_count(); }
  mesh::Triangle triangle(uint64_t index) const { return slab_.triangle(index); }

  Double3 vertex(uint64_t index) const {
    if (index < slab_.top_vertices()) {
      const auto [i, k] = slab_.top_point(index);
      return surface(i, k);
    }
    if (index == vertex_count() - 1) return {0, kBottom, 0};
    const auto [i, k] = slab_.border_point(index - slab_.top_vertices());
    Double3 point = flat(i, k);
    point[1] = kBottom;
    return point;
  }

 private:
  Double3 flat(uint64_t i, uint64_t k) const {
    return {2 * double(i) / double(slab_.nx) - 1, 0, 2 * double(k) / double(slab_.nz) - 1};
  }

  Double3 surface(uint64_t i, uint64_t k) const {
    const Double3 p = flat(i, k);
    // Ridges in warped space, high where a slow noise is high, plus gravel of all sizes: valleys stay smooth.
    const Double3 bent = bends_.warp(p * 1.6, 0.2);
    const double range = smoothstep(-0.45, 0.6, bends_.octaves(p * 0.9 + Double3{5, 5, 5}, 2, 0.5));
    const double ridges = noise_.ridges(bent * 0.9, 11, 0.45);
    const double hills = noise_.octaves(p * 2.3 + Double3{9, 9, 9}, 12, 0.48);
    const double height = 0.06 * hills + range * (0.28 * ridges + 0.03 * hills);
    return {p[0], std::fmax(height - 0.1, kBottom + 0.05), p[2]};
  }

  Noise noise_, bends_;
  Slab slab_{};
};

}  // namespace

std::unique_ptr<mesh::MeshSource> make_terrain(const Request& request) { return computed(Terrain(request)); }

}  // namespace nif::generate
