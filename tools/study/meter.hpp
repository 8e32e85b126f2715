// Measures rivals, all with the same rays, so that their results can be compared.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "bake/ground_truth/embree_scene.hpp"
#include "tools/study/rival.hpp"

namespace nif::tools {

/// Results of a rival on a ray set (docs/ray-sets.md), as shares of its rays.
struct RivalSet {
  uint64_t rays = 0;
  double leak = 0;      ///< occluded, but answered visible
  double spurious = 0;  ///< visible, but answered occluded
  double certain = 0;
  /// Speed on one thread, if it was measured: million rays per second, and as a multiple of the fastest call
  /// of Embree's default BVH over the whole mesh, which ran in the same rounds.
  std::optional<double> mrays_per_s, ratio;

  double error() const { return leak + spurious; }
};
using RivalSets = std::map<std::string, RivalSet>;  ///< by the set's name

class Meter {
 public:
  /// Draws `rays` rays of each set with their ground truth, and finds the fastest Embree call for each timed
  /// set. The mesh must outlive it.
  Meter(const StudiedMesh& mesh, uint64_t rays, uint64_t seed, const RivalProgress& progress);

  /// Uses all threads for errors, and one for speeds. Throws what `progress` throws.
  RivalSets measure(const Rival& rival, const RivalProgress& progress) const;

 private:
  const StudiedMesh& mesh_;
  std::vector<bake::RaysWithTruth> sets_;  ///< [kRaySets]
  std::unique_ptr<Rival> embree_;
  std::vector<std::optional<TimedWay>> fastest_;  ///< [kRaySets], for the timed sets that have rays
};

}  // namespace nif::tools
