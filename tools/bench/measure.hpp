// The measurements of `nif bench`: an asset and Embree on the same rays, in the same rounds.
#pragma once

#include <algorithm>
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

/// Rays that another program answered, and how.
struct EntrantCounts {
  uint64_t differing = 0;  ///< with another visibility, or hit or miss, than the ground truth
  uint64_t wrong = 0;      ///< of those, where the truth is not in doubt
  // Of first hits:
  uint64_t compared = 0;   ///< both sides have a first hit
  uint64_t displaced = 0;  ///< of those, more than kSameHit apart
  uint64_t misplaced = 0;  ///< of those, where rounding does not explain it
  uint64_t other = 0;      ///< hits in the same place, but on another triangle or instance

  EntrantCounts& operator+=(const EntrantCounts& more) {
    differing += more.differing, wrong += more.wrong, compared += more.compared;
    displaced += more.displaced, misplaced += more.misplaced, other += more.other;
    return *this;
  }
};

/// Another program that answered the same rays, and timed itself (entrants.hpp).
struct EntrantSpeed : EntrantCounts {
  std::string program;        ///< its name and version
  std::string variant;        ///< may be empty
  std::string file;           ///< that states this
  std::vector<double> rates;  ///< by pass
  std::optional<uint64_t> bytes;
  uint64_t rays = 0;
  bool hits = false;   ///< it found first hits
  bool named = false;  ///< it names triangles or instances

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
  std::vector<EmbreeVariant> embree;   ///< fastest first, by median; eliminated ones last
  std::vector<EntrantSpeed> entrants;  ///< in the order of their files

  Spread rate() const { return spread_of(rates); }
  const EmbreeVariant& best() const { return embree.front(); }
  /// The fastest call of a build.
  const EmbreeVariant& best(size_t build) const;
  /// Speed as a multiple of the best Embree call: ratio of the medians, with the spread over rounds.
  Spread ratio_to_best() const;
  /// Speed as a multiple of the other asset: ratio of the medians, with the spread over rounds.
  Spread ratio_to_other() const;
  /// Speed as a multiple of an entrant: ratio of the medians. It ran at another time, so there is no spread.
  double ratio_to(const EntrantSpeed& entrant) const { return rate().median / entrant.rate().median; }
};

struct ThreadRun {
  uint32_t threads;
  std::vector<SetSpeeds> sets;
};

struct BenchOptions {
  std::string asset, mesh;
  std::string configuration;  ///< of the runtime's device
  std::string against;        ///< another asset of the same mesh to race in the same rounds; may be empty
  std::vector<std::string> compare = {};  ///< files of other programs (entrants.hpp)
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
  std::vector<std::string> notes;  ///< one sentence each
};

/// Rays of a set for each object, if all of them get `rays`.
constexpr uint64_t rays_of_each(uint64_t rays, size_t objects) {
  return std::max<uint64_t>(1, rays / objects);
}

/// Throws nif::Error; Error(interrupted) soon after a signal arrives.
BenchResult measure(const BenchOptions& options, Progress& progress);

}  // namespace nif::tools
