// A hash table of grid cells as wide as the distance: near vertices are in at most 27 cells. If coordinates
// are too large for that, floats are farther apart than the distance, and each gets its own cell.
#include "mesh/repair/snap.hpp"

#include <bit>
#include <cmath>
#include <limits>
#include <unordered_map>

namespace nif::repair {
namespace {

using mesh::Float3;
using Cell = std::array<int64_t, 3>;

struct HashCell {
  size_t operator()(const Cell& cell) const {
    uint64_t h = 0;
    for (const int64_t x : cell) h = (h ^ uint64_t(x)) * 0x9E3779B97F4A7C15u, h ^= h >> 29;
    return h;
  }
};

double distance_squared(const Float3& a, const Float3& b) {
  double sum = 0;
  for (size_t axis = 0; axis < 3; ++axis) sum += (double(a[axis]) - b[axis]) * (double(a[axis]) - b[axis]);
  return sum;
}

/// The vertices that stay, by cells of a grid as wide as the distance.
class Kept {
 public:
  explicit Kept(double distance) : distance_(distance) {}

  /// The position of the nearest vertex within the distance, or null.
  const Float3* near(const Float3& p) const {
    const Cell at = cell_of(p);
    const Float3* nearest = nullptr;
    double least = std::nextafter(distance_ * distance_, std::numeric_limits<double>::infinity());
    for (int64_t x = -1; x <= 1; ++x)
      for (int64_t y = -1; y <= 1; ++y)
        for (int64_t z = -1; z <= 1; ++z) {
          const auto cell = cells_.find({at[0] + x, at[1] + y, at[2] + z});
          if (cell == cells_.end()) continue;
          for (const Float3& other : cell->second)
            if (const double d = distance_squared(p, other); d < least) least = d, nearest = &other;
        }
    return nearest;
  }
  void add(const Float3& p) { cells_[cell_of(p)].push_back(p); }

 private:
  Cell cell_of(const Float3& p) const {
    Cell cell;
    for (size_t axis = 0; axis < 3; ++axis) {
      const double at = std::floor(double(p[axis]) / distance_);
      cell[axis] = std::abs(at) < kFar ? int64_t(at) : far_cell(p[axis]);
    }
    return cell;
  }

  /// At this distance, two different floats are farther apart than the merging distance: each gets its own
  /// cell, with empty ones around it.
  static constexpr double kFar = double(int64_t{1} << 40);
  static int64_t far_cell(float x) {
    const int64_t cell = (int64_t{1} << 41) + 4 * int64_t{std::bit_cast<uint32_t>(std::abs(x))};
    return x < 0 ? -cell : cell;
  }

  double distance_;
  std::unordered_map<Cell, std::vector<Float3>, HashCell> cells_;
};

}  // namespace

uint64_t snap_vertices(std::vector<Float3>& positions, double distance) {
  Kept kept(distance);
  uint64_t moved = 0;
  for (Float3& p : positions) {
    const Float3* other = kept.near(p);
    if (other == nullptr) {
      kept.add(p);
    } else if (*other != p) {
      p = *other;
      ++moved;
    }
  }
  return moved;
}

}  // namespace nif::repair
