// The measurements of `nif bench`: an asset and Embree on the same rays, in the same rounds.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "bake/ground_truth/embree_baseline.hpp"
#include "bake/ground_truth/evaluate.hpp"
#include "nif/nif.h"
#include "tools/bench/bench_rounds.hpp"
#include "tools/bench/bench_stages.hpp"
#include "tools/common/progress.hpp"

namespace nif::tools {

/// In the order of the output.
inline constexpr std::array kEmbreeBuilds{bake::EmbreeBuild::standard, bake::EmbreeBuild::high,
                                          bake::EmbreeBuild::compact, bake::EmbreeBuild::robust};
/// "default", "high", "compact", "robust".
std::string_view name_of(bake::EmbreeBuild build);

/// One way to call Embree, with its results. Rates are in million rays per second.
struct EmbreeVariant {
  size_t build;  ///< in kEmbreeBuilds
  bake::EmbreeCall call;
  bool coherent;                   ///< with Embree's hint that the rays are coherent
  uint64_t wrong = 0;              ///< answers that differ from the ground truth
  std::vector<double> rates = {};  ///< by round; empty if it was eliminated in the heats
  double fastest_heat = 0;

  Spread rate() const { return spread_of(rates); }
};
/// "default rtcOccluded16", "robust rtcOccluded1M coherent".
std::string name_of(const EmbreeVariant& variant);

/// The Embree call for rays that proofs leave open.
struct Behind {
  size_t build;  ///< in kEmbreeBuilds
  bake::EmbreeCall call;
};
std::string name_of(const Behind& behind);

/// An asset's results in a race.
struct AssetSpeed {
  bake::Accuracy accuracy;           ///< on exactly the rays of the race
  std::vector<double> rates;         ///< by round
  std::optional<StageTimes> stages;  ///< if requested and the asset has `spherical` objects

  Spread rate() const { return spread_of(rates); }
};

struct SetSpeeds {
  bake::RaySet set;
  bake::Accuracy accuracy;            ///< of the asset, on exactly the rays of the race
  std::vector<double> rates;          ///< of the asset, by round
  std::optional<Behind> behind;       ///< if proofs are in front of Embree
  std::optional<StageTimes> stages;   ///< if requested and the asset has `spherical` objects
  std::optional<AssetSpeed> against;  ///< of the other asset, if there is one
  /// Cores that the threads used while the clock ran, from the system's account of processor time.
  double cores = 0;
  std::vector<EmbreeVariant> embree;  ///< fastest first, by median; eliminated ones last

  Spread rate() const { return spread_of(rates); }
  const EmbreeVariant& best() const { return embree.front(); }
  /// The fastest call of a build.
  const EmbreeVariant& best(size_t build) const;
  /// Speed as a multiple of the best Embree call: ratio of the medians, with the spread over rounds.
  Spread ratio_to_best() const;
  /// Speed as a multiple of the other asset: ratio of the medians, with the spread over rounds.
  Spread ratio_to_other() const;
};

struct ThreadRun {
  uint32_t threads;
  std::vector<SetSpeeds> sets;
};

struct BenchOptions {
  std::string asset, mesh;
  std::string configuration;  ///< of the runtime's device
  std::string against;        ///< another asset of the same mesh to race in the same rounds; may be empty
  std::vector<bake::RaySet> sets;
  std::vector<uint32_t> threads;
  bool fallback = false;  ///< proofs in front of Embree's BVHs, instead of the asset alone
  bool hits = false;      ///< race first hits, not occlusion
  bool stages = false;    ///< time the stages, on one thread; stored with the first of `threads`
  uint64_t rays, seed;
  Schedule schedule;
};

struct BenchResult {
  uint64_t triangles = 0;
  size_t objects = 0;
  NifAssetInfo info{}, against{};
  std::vector<NifPartInfo> parts;  ///< of `info`
  std::string isa;
  std::array<uint64_t, kEmbreeBuilds.size()> embree_bytes{};
  std::vector<ThreadRun> runs;
};

/// Throws nif::Error; Error(interrupted) soon after a signal arrives.
BenchResult measure(const BenchOptions& options, Progress& progress);

}  // namespace nif::tools
