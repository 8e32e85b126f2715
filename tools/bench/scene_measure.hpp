// The measurements of `nif bench SCENE`: a scene of instances in the runtime and in Embree.
#pragma once

#include "tools/bench/measure.hpp"

namespace nif::tools {

struct SceneBenchOptions {
  std::string scene;
  std::string asset;          ///< asset of a glTF; empty for a scene file, which names its assets
  std::string configuration;  ///< of the runtime's device
  std::vector<bake::RaySet> sets;
  std::vector<uint32_t> threads;
  uint64_t rays, seed;
  uint32_t moved;  ///< number of instances to move; 0: none, and moves are not measured
  bool hits;       ///< race first hits, not occlusion
  Schedule schedule;
  std::string against = {};  ///< another asset of the same glTF, which races until something moves
  std::vector<std::string> compare = {};  ///< files of other programs (entrants.hpp), about the unmoved scene
};

/// Milliseconds to move instances.
struct MoveTime {
  std::vector<double> transforms, commit;  ///< by round

  Spread whole() const;
};

/// Times of moving instances, and the race after that.
struct MovedRun {
  MoveTime nif;
  std::array<MoveTime, kEmbreeBuilds.size()> embree;
  ThreadRun run;  ///< for the scene after the last move

  /// The fastest of Embree's builds, as an index into kEmbreeBuilds.
  size_t best() const;
};

struct SceneBenchResult {
  /// `objects` and `triangles` count each object once; `info` has the sums over all assets, and its
  /// `resident_bytes` include the scene.
  BenchResult still;
  uint64_t scene_bytes = 0;  ///< the share of `still.info.resident_bytes` that the runtime's scene takes
  uint64_t instances = 0, placed_triangles = 0;
  uint32_t moved_instances = 0;
  std::vector<MovedRun> moved;  ///< by number of threads; empty if nothing moved
};

/// Throws nif::Error; Error(interrupted) soon after a signal arrives.
SceneBenchResult measure_scene(const SceneBenchOptions& options, Progress& progress);

}  // namespace nif::tools
