// How much two meshes differ: in distance, and in the rays that they block.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "bake/oracle/prepare.hpp"

namespace nif::compare {

/// From points of one surface to the nearest ones of another, in units of the meshes.
struct Distance {
  uint64_t samples = 0;
  double mean = 0, root_mean_square = 0;
  double max = 0;  ///< over the samples: the one-sided Hausdorff distance is at least this
};

/// Points of `from`, evenly by area and drawn from the seed, and all its vertices, each against the nearest
/// point of `to`. The mean is over the drawn points, the maximum over both. Runs on all threads; the result
/// does not depend on their number.
Distance distance(const mesh::CleanMesh& from, const mesh::CleanMesh& to, uint64_t samples, uint64_t seed);

/// How many rays of a named set (docs/ray-sets.md) two meshes answer differently.
struct Visibility {
  bake::RaySet set;
  uint64_t rays = 0;
  uint64_t opened = 0;  ///< blocked by the first mesh, not by the second
  uint64_t closed = 0;  ///< blocked by the second mesh alone

  double difference() const { return rays ? double(opened + closed) / double(rays) : 0; }
};

/// The sets are those of `first`, `rays` of each, drawn from the seed and answered by Embree on both meshes.
/// The picture of `sun` is that of `first`.
Visibility visibility(const bake::GroundTruth& first, const bake::Oracle& second, bake::RaySet set,
                      uint64_t rays, uint64_t seed);

}  // namespace nif::compare
