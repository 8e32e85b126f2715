// Finds the thinnest slab around polygons, among the normals that cells can have.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "formats/base/vector.hpp"

namespace nif::bake {

/// All points p have slab.lowest <= dot(n, p) <= slab.highest, with n = kernels::cell_normal(normal).
struct Slab {
  uint32_t normal;  ///< the bits of the normal as in a word, all others 0
  double lowest, highest;
};

/// Finds slabs, reusing its memory. A heuristic: it starts from normals of the enclosed polygons and climbs
/// to one that no neighbour improves.
class ThinnestSlab {
 public:
  void clear();
  bool empty() const { return x_.empty(); }
  /// `normal`, with either sign, is proportional to the polygon's area.
  void add(std::span<const Double3> corners, const Double3& normal);
  /// Requires at least one polygon.
  Slab find();

 private:
  struct Extent {
    double lowest, highest;
    uint32_t low, high;  // the points that reach them
  };
  struct Found {
    uint32_t normal;
    double thickness;
  };

  double thickness(uint32_t normal, const std::vector<uint32_t>& points) const;
  double thickness_of(uint32_t normal, const Extent& extent) const;
  Extent extent_of(uint32_t normal) const;
  Found climb(Found from) const;
  Double3 best_fit() const;

  std::vector<double> x_, y_, z_;  // corners
  std::vector<uint32_t> sample_;   // corners that reach far in some direction
  Double3 sum_{};                  // of normals, turned to the side of the largest so far
  Double3 largest_[3];             // normals of the largest polygons
  double areas_[3] = {};
};

}  // namespace nif::bake
