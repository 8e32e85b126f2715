// Measures rivals: all are asked about the same rays.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "bake/oracle/embree_scene.hpp"
#include "tools/study/rival.hpp"

namespace nif::tools {

/// How a rival fared on a ray set (docs/ray-sets.md). Shares of its rays.
struct RivalSet {
  uint64_t rays = 0;
  double leak = 0;      ///< occluded, called visible
  double spurious = 0;  ///< visible, called occluded
  double certain = 0;
  /// On one thread, where it was measured: millions of rays a second, and times that of the fastest call of
  /// Embree's default BVH over the whole mesh, which ran in the same rounds.
  std::optional<double> mrays_per_s, ratio;

  double error() const { return leak + spurious; }
};
using RivalSets = std::map<std::string, RivalSet>;  ///< by the set's name

class Meter {
 public:
  /// Draws and labels so many rays of each set, and finds the fastest call of Embree for each that is timed.
  /// The mesh must outlive it.
  Meter(const StudiedMesh& mesh, uint64_t rays, uint64_t seed, const RivalProgress& progress);

  /// On all threads for errors, on one for speeds. Throws what `progress` throws.
  RivalSets measure(const Rival& rival, const RivalProgress& progress) const;

 private:
  const StudiedMesh& mesh_;
  std::vector<bake::LabelledRays> sets_;  ///< [kRaySets]
  std::unique_ptr<Rival> embree_;
  std::vector<std::optional<TimedWay>> fastest_;  ///< [kRaySets], of the timed sets that have rays
};

}  // namespace nif::tools
