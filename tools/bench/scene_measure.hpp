// The measurements of `nif bench SCENE`: a scene of instances in the runtime and in Embree.
#pragma once

#include "tools/bench/measure.hpp"

namespace nif::tools {

struct SceneBenchOptions {
  std::string scene;
  std::string asset;          ///< of a glTF; empty for a scene file, which names its assets
  std::string configuration;  ///< of the runtime's device
  std::vector<bake::RaySet> sets;
  std::vector<uint32_t> threads;
  uint64_t rays, seed;
  uint32_t moved;  ///< instances that move; 0: none, and nothing is measured of it
  bool hits;       ///< first hits are raced, not occlusion
  Schedule schedule;
};

/// Milliseconds that instances take to move.
struct MoveTime {
  std::vector<double> transforms, commit;  ///< by round

  Spread whole() const;
};

/// How some instances moved, and what was measured then.
struct MovedRun {
  MoveTime nif;
  std::array<MoveTime, kEmbreeBuilds.size()> embree;
  ThreadRun run;  ///< rays of the scene as it is after the last move

  /// Embree's fastest, in kEmbreeBuilds.
  size_t best() const;
};

struct SceneBenchResult {
  /// `objects` and `triangles` count each object once; `info` has the sums of all assets, and its
  /// `resident_bytes` those of the scene, too.
  BenchResult still;
  uint64_t scene_bytes = 0;  ///< of `still.info.resident_bytes`, what the runtime's scene takes
  uint64_t instances = 0, placed_triangles = 0;
  uint32_t moved_instances = 0;
  std::vector<MovedRun> moved;  ///< by number of threads; empty where nothing moved
};

/// Throws nif::Error; Error(interrupted) soon after a signal has come.
SceneBenchResult measure_scene(const SceneBenchOptions& options, Progress& progress);

}  // namespace nif::tools
