// Measures an asset that bends against Embree, over the frames of an animation.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "bake/ground_truth/ray_sets.hpp"
#include "tools/common/progress.hpp"

namespace nif::tools {

inline constexpr const char* kClipBenchSchema = "nifkit.bench-clip/1";

struct ClipBenchOptions {
  std::string asset, mesh, configuration, clip;
  uint32_t frames;
  std::vector<bake::RaySet> sets;
  uint64_t rays;  ///< per set, divided among the frames
  uint64_t seed;
  uint32_t rounds;  ///< how often each frame is timed
};

/// Seconds of all frames and rounds, for the same rays on one thread.
struct ClipSpeeds {
  bake::RaySet set;
  uint64_t rays = 0;      ///< of all frames
  uint64_t wrong = 0;     ///< answers that are wrong although the truth is not in doubt
  uint64_t in_doubt = 0;  ///< other answers that differ from Embree's
  // By the asset, by Embree's tree refitted frame by frame, and by its tree built anew for each frame.
  double nif = 0, refitted = 0, rebuilt = 0;
  double nif_hits = 0, refitted_hits = 0, rebuilt_hits = 0;  ///< first hits
};

struct ClipBenchResult {
  std::string embree, isa;
  uint64_t triangles = 0, bending = 0;  ///< placed; of these, those that bend
  size_t frames = 0;
  std::vector<ClipSpeeds> sets;
  /// Mean seconds a frame: the median of the rounds; and the first round, which finds its memory out of the caches.
  struct Times {
    double median = 0, first = 0;
  };
  Times pose, commit, embree_refit, embree_rebuild;
  uint64_t scene_bytes = 0, asset_bytes = 0;  ///< in memory: of the posed scene; of its asset
  uint64_t embree_bytes = 0;                  ///< the refitted tree, with vertices and indices
};

/// Throws as MeasuredAsset and ClipFrames do; Error(interrupted).
ClipBenchResult measure_clip(const ClipBenchOptions& options, Progress& progress);

/// docs/benchmark.md explains the fields of the schema.
nlohmann::ordered_json to_json(const ClipBenchOptions& options, const ClipBenchResult& result);
std::string clip_bench_tables(const ClipBenchOptions& options, const ClipBenchResult& result);

}  // namespace nif::tools
