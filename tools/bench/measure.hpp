// The measurements of `nif bench`: an asset and Embree on the same rays, in the same rounds.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "bake/oracle/embree_baseline.hpp"
#include "bake/oracle/evaluate.hpp"
#include "nif/nif.h"
#include "tools/bench/rounds.hpp"
#include "tools/bench/stages.hpp"
#include "tools/common/progress.hpp"

namespace nif::tools {

/// In the order in which they are listed.
inline constexpr std::array kEmbreeBuilds{bake::EmbreeBuild::standard, bake::EmbreeBuild::high,
                                          bake::EmbreeBuild::compact, bake::EmbreeBuild::robust};
/// "default", "high", "compact", "robust".
std::string_view name_of(bake::EmbreeBuild build);

/// One way to ask Embree, and how it fared. Rates are in millions of rays a second.
struct EmbreeVariant {
  size_t build;  ///< in kEmbreeBuilds
  bake::EmbreeCall call;
  bool coherent;                   ///< with Embree's hint that the rays are
  uint64_t wrong = 0;              ///< answers that differ from the labels
  std::vector<double> rates = {};  ///< by round; empty where it dropped out after the heats
  double fastest_heat = 0;

  Spread rate() const { return spread_of(rates); }
};
/// "default rtcOccluded16", "robust rtcOccluded1M coherent".
std::string name_of(const EmbreeVariant& variant);

/// The way to ask Embree about what proofs leave open.
struct Behind {
  size_t build;  ///< in kEmbreeBuilds
  bake::EmbreeCall call;
};
std::string name_of(const Behind& behind);

/// An asset's part in a race.
struct AssetSpeed {
  bake::Accuracy accuracy;           ///< on the very rays of the race
  std::vector<double> rates;         ///< by round
  std::optional<StageTimes> stages;  ///< where they were asked for and it has `spherical` objects

  Spread rate() const { return spread_of(rates); }
};

struct SetSpeeds {
  bake::RaySet set;
  bake::Accuracy accuracy;            ///< of the asset, on the very rays of the race
  std::vector<double> rates;          ///< of the asset, by round
  std::optional<Behind> behind;       ///< where proofs are in front of Embree
  std::optional<StageTimes> stages;   ///< where they were asked for and it has `spherical` objects
  std::optional<AssetSpeed> against;  ///< of the other asset, where there is one
  double cores = 0;  ///< that the threads got while a clock ran, by the system's account of processor time
  std::vector<EmbreeVariant> embree;  ///< the fastest first, by median; those that dropped out last

  Spread rate() const { return spread_of(rates); }
  const EmbreeVariant& best() const { return embree.front(); }
  /// The fastest of a build.
  const EmbreeVariant& best(size_t build) const;
  /// How many times as fast as the best Embree: of the medians, with the spread of the rounds.
  Spread ratio_to_best() const;
  /// How many times as fast as the other asset: of the medians, with the spread of the rounds.
  Spread ratio_to_other() const;
};

struct ThreadRun {
  uint32_t threads;
  std::vector<SetSpeeds> sets;
};

struct BenchOptions {
  std::string asset, mesh;
  std::string configuration;  ///< of the runtime's device
  std::string against;        ///< another asset of the same mesh, to race beside it; may be empty
  std::vector<bake::RaySet> sets;
  std::vector<uint32_t> threads;
  bool fallback = false;  ///< the asset's proofs in front of Embree's BVHs, instead of the asset alone
  bool hits = false;      ///< first hits are raced, not occlusion
  bool stages = false;    ///< on one thread, kept with the first of `threads`
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

/// Throws nif::Error; Error(interrupted) soon after a signal has come.
BenchResult measure(const BenchOptions& options, Progress& progress);

}  // namespace nif::tools
