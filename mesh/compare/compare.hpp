// Measures how much two meshes differ: in distance, and in the rays that they block.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "bake/ground_truth/prepare.hpp"

namespace nif::compare {

/// Distances from points of one surface to the nearest points of another, in units of the meshes.
struct Distance {
  uint64_t samples = 0;
  double mean = 0, root_mean_square = 0;
  double max = 0;  ///< over the samples: the one-sided Hausdorff distance is at least this
};

/// Distances of points on `from`, evenly distributed by area and drawn from the seed, and of all its
/// vertices, to the nearest point of `to`. The mean is over the drawn points, the maximum over both. Runs on
/// all threads; the result does not depend on their number. Triangles with holes count as solid.
Distance distance(const mesh::CleanMesh& from, const mesh::CleanMesh& to, uint64_t samples, uint64_t seed);

/// Number of rays of a named set (docs/ray-sets.md) that two meshes answer differently.
struct Visibility {
  bake::RaySet set;
  uint64_t rays = 0;
  uint64_t opened = 0;  ///< blocked by the first mesh, not by the second
  uint64_t closed = 0;  ///< blocked only by the second mesh

  double difference() const { return rays ? double(opened + closed) / double(rays) : 0; }
};

/// Uses the ray sets of `first`, with `rays` rays each, drawn from the seed and answered by Embree on both
/// meshes, with their holes. The `sun` set uses the picture of `first`.
Visibility visibility(const bake::GroundTruth& first, const bake::EmbreeTruth& second, bake::RaySet set,
                      uint64_t rays, uint64_t seed);

}  // namespace nif::compare
