// Searches for the thinnest slab. Starts from the mean normal, the best fit and the largest faces, and climbs
// over the grid of normals. For speed, a climb only looks at a few extreme points; points found outside its
// slab are added.
#include "bake/planes/thinnest.hpp"

#include <algorithm>
#include <cmath>

#include "kernels/reference/planes/cells.hpp"

namespace nif::bake {
namespace {

using kernels::kNormalHalf;
using kernels::kNormalSum;

constexpr uint32_t normal_bits(int32_t u, int32_t v) {
  return uint32_t(u + kNormalHalf) << 4 | uint32_t(v + kNormalHalf) << 10;
}

Double3 vector_of(uint32_t normal) {
  const kernels::CellNormal n = kernels::cell_normal(normal);
  return {double(n.x), double(n.y), double(n.z)};
}

/// The normal nearest to a direction, with either sign, or nearly so.
uint32_t nearest_normal(Double3 direction) {
  const double sum = std::abs(direction[0]) + std::abs(direction[1]) + std::abs(direction[2]);
  if (!(sum > 0)) return normal_bits(0, 0);
  const double scale = (direction[2] < 0 ? -1 : 1) * kNormalSum / sum;
  const double x = direction[0] * scale, y = direction[1] * scale;
  const auto place = [](double at) {
    return std::clamp(int32_t(std::floor(at / 2 + 0.5)), -kNormalHalf, kNormalHalf);
  };
  return normal_bits(place(x + y), place(x - y));
}

/// Calls visit with the eight neighbours of a normal. If it lies in the plane z = 0, its neighbours include
/// those of its opposite, which is equivalent.
template <class Visit>
void visit_neighbours(uint32_t normal, const Visit& visit) {
  const auto around = [&](int32_t u, int32_t v) {
    for (int32_t du = -1; du <= 1; ++du)
      for (int32_t dv = -1; dv <= 1; ++dv)
        if ((du != 0 || dv != 0) && std::abs(u + du) <= kNormalHalf && std::abs(v + dv) <= kNormalHalf)
          visit(normal_bits(u + du, v + dv));
  };
  const int32_t u = int32_t(normal >> 4 & 63) - kNormalHalf, v = int32_t(normal >> 10 & 63) - kNormalHalf;
  around(u, v);
  if (std::max(std::abs(u), std::abs(v)) == kNormalHalf) around(-u, -v);
}

/// The eigenvector of the smallest eigenvalue of a symmetric matrix (xx, yy, zz, xy, yz, zx), by Jacobi
/// rotations.
Double3 smallest_axis(double (&m)[3][3]) {
  double axes[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  for (int sweep = 0; sweep < 8; ++sweep) {
    for (int p = 0; p < 2; ++p) {
      for (int q = p + 1; q < 3; ++q) {
        if (m[p][q] == 0) continue;
        const double theta = (m[q][q] - m[p][p]) / (2 * m[p][q]);
        const double t = (theta < 0 ? -1 : 1) / (std::abs(theta) + std::sqrt(theta * theta + 1));
        const double c = 1 / std::sqrt(t * t + 1), s = t * c;
        for (int k = 0; k < 3; ++k) {
          const double a = m[k][p], b = m[k][q];
          m[k][p] = c * a - s * b;
          m[k][q] = s * a + c * b;
        }
        for (int k = 0; k < 3; ++k) {
          const double a = m[p][k], b = m[q][k];
          m[p][k] = c * a - s * b;
          m[q][k] = s * a + c * b;
          const double d = axes[k][p], e = axes[k][q];
          axes[k][p] = c * d - s * e;
          axes[k][q] = s * d + c * e;
        }
      }
    }
  }
  int least = 0;
  for (int a = 1; a < 3; ++a)
    if (m[a][a] < m[least][least]) least = a;
  return {axes[0][least], axes[1][least], axes[2][least]};
}

}  // namespace

void ThinnestSlab::clear() {
  x_.clear();
  y_.clear();
  z_.clear();
  sum_ = {};
  std::fill_n(areas_, 3, 0.0);
}

void ThinnestSlab::add(std::span<const Double3> corners, const Double3& normal) {
  for (const Double3& p : corners) {
    x_.push_back(p[0]);
    y_.push_back(p[1]);
    z_.push_back(p[2]);
  }
  Double3 moved = normal;
  double area = length(normal);
  for (int i = 0; i < 3; ++i) {
    if (!(area > areas_[i])) continue;
    std::swap(area, areas_[i]);
    std::swap(moved, largest_[i]);
  }
  sum_ = sum_ + normal * (dot(largest_[0], normal) < 0 ? -1 : 1);
}

Slab ThinnestSlab::find() {
  uint32_t candidates[5] = {nearest_normal(sum_), nearest_normal(best_fit())};
  size_t count = 2;
  for (int i = 0; i < 3; ++i)
    if (areas_[i] > 0) candidates[count++] = nearest_normal(largest_[i]);

  Found best{0, 0};
  Extent extent{};
  sample_.clear();
  for (size_t i = 0; i < count; ++i) {
    if (std::find(candidates, candidates + i, candidates[i]) != candidates + i) continue;
    const Extent reached = extent_of(candidates[i]);
    const double thick = thickness_of(candidates[i], reached);
    sample_.insert(sample_.end(), {reached.low, reached.high});
    if (i > 0 && best.thickness <= thick) continue;
    best = {candidates[i], thick};
    extent = reached;
  }

  // Climb among a few points, and add those that turn out to lie outside, until none does.
  constexpr int kMostRounds = 16;
  Found tried = best;
  for (int round = 0; round < kMostRounds; ++round) {
    const Found found = climb({tried.normal, thickness(tried.normal, sample_)});
    const Extent reached = extent_of(found.normal);
    const double thick = thickness_of(found.normal, reached);
    if (thick < best.thickness) {
      best = {found.normal, thick};
      extent = reached;
    }
    // A slab that is no thinner among these few points is no thinner among all.
    if (thick <= found.thickness || found.thickness >= best.thickness) break;
    sample_.insert(sample_.end(), {reached.low, reached.high});
    tried = best;
  }
  return {best.normal, extent.lowest, extent.highest};
}

double ThinnestSlab::thickness_of(uint32_t normal, const Extent& extent) const {
  return (extent.highest - extent.lowest + 2 * kernels::kHeightMargin) / length(vector_of(normal));
}

double ThinnestSlab::thickness(uint32_t normal, const std::vector<uint32_t>& points) const {
  const Double3 n = vector_of(normal);
  double lowest = 1e300, highest = -1e300;
  for (const uint32_t i : points) {
    const double height = n[0] * x_[i] + n[1] * y_[i] + n[2] * z_[i];
    lowest = std::min(lowest, height);
    highest = std::max(highest, height);
  }
  return thickness_of(normal, {lowest, highest, 0, 0});
}

ThinnestSlab::Extent ThinnestSlab::extent_of(uint32_t normal) const {
  const Double3 n = vector_of(normal);
  Extent extent{1e300, -1e300, 0, 0};
  for (size_t i = 0; i < x_.size(); ++i) {
    const double height = n[0] * x_[i] + n[1] * y_[i] + n[2] * z_[i];
    if (height < extent.lowest) extent.lowest = height, extent.low = uint32_t(i);
    if (height > extent.highest) extent.highest = height, extent.high = uint32_t(i);
  }
  return extent;
}

/// Climbs to a normal none of whose neighbours is thinner for the sample.
ThinnestSlab::Found ThinnestSlab::climb(Found from) const {
  for (bool better = true; better;) {
    better = false;
    Found next = from;
    visit_neighbours(from.normal, [&](uint32_t normal) {
      const double thick = thickness(normal, sample_);
      if (thick < next.thickness) next = {normal, thick}, better = true;
    });
    from = next;
  }
  return from;
}

/// The direction in which the corners spread least.
Double3 ThinnestSlab::best_fit() const {
  Double3 mean{};
  for (size_t i = 0; i < x_.size(); ++i) mean = mean + Double3{x_[i], y_[i], z_[i]};
  mean = mean * (1.0 / double(x_.size()));
  double spread[3][3] = {};
  for (size_t i = 0; i < x_.size(); ++i) {
    const Double3 p = Double3{x_[i], y_[i], z_[i]} - mean;
    for (int a = 0; a < 3; ++a)
      for (int b = a; b < 3; ++b) spread[a][b] += p[a] * p[b];
  }
  for (int a = 0; a < 3; ++a)
    for (int b = 0; b < a; ++b) spread[a][b] = spread[b][a];
  return smallest_axis(spread);
}

}  // namespace nif::bake
