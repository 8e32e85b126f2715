// Finds Embree's fastest call for each timed set first, in a few heats. Each rival is then timed in rounds
// that alternate with it, so that a disturbance affects both.
#include "tools/study/meter.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "formats/base/status.hpp"
#include "tools/bench/bench_rounds.hpp"

namespace nif::tools {
namespace {

/// Two incoherent sets and a coherent one.
constexpr std::array kTimed{bake::RaySet::outer_lines, bake::RaySet::inner_surface, bake::RaySet::sun};

bool is_timed(bake::RaySet set) { return std::ranges::find(kTimed, set) != kTimed.end(); }

constexpr size_t kHeats = 3, kRounds = 5;

}  // namespace

Meter::Meter(const StudiedMesh& mesh, uint64_t rays, uint64_t seed, const RivalProgress& progress)
    : mesh_(mesh), fastest_(bake::kRaySets.size()) {
  for (const bake::RaySet set : bake::kRaySets) {
    progress(double(set) / bake::kRaySets.size(), fmt::format("drawing rays: {}", bake::name_of(set)));
    sets_.push_back(bake::make_ray_set(mesh.truth.source(), set, rays, seed));
  }
  embree_ = mesh_rivals(mesh, {}).front().make(progress);
  for (const bake::RaySet set : kTimed) {
    const bake::RaysWithTruth& drawn = sets_[size_t(set)];
    if (drawn.segments.empty()) continue;
    double least = INFINITY;
    for (const TimedWay& way : embree_->ways(drawn, set)) {
      double seconds = INFINITY;
      for (size_t heat = 0; heat < kHeats; ++heat) seconds = std::min(seconds, way());
      if (seconds < least) least = seconds, fastest_[size_t(set)] = way;
    }
  }
}

RivalSets Meter::measure(const Rival& rival, const RivalProgress& progress) const {
  RivalSets sets;
  for (const bake::RaySet set : bake::kRaySets) {
    const bake::RaysWithTruth& rays = sets_[size_t(set)];
    if (rays.segments.empty()) continue;
    const double done = double(set) / bake::kRaySets.size();
    progress(done, fmt::format("asking {}", bake::name_of(set)));
    const bake::Accuracy accuracy = bake::evaluate(rays, rival.answerer(), mesh_.truth.source().embree);
    RivalSet& result = sets[std::string(bake::name_of(set))];
    result.rays = accuracy.rays;
    result.leak = accuracy.rate(accuracy.leak);
    result.spurious = accuracy.rate(accuracy.spurious);
    result.certain = accuracy.rate(accuracy.certain);
    if (!is_timed(set)) continue;
    std::vector<Contender> contenders{{"Embree", 0, *fastest_[size_t(set)]}};
    for (const TimedWay& way : rival.ways(rays, set)) contenders.push_back({"", 1, way});
    const std::vector<Timing> timings =
        race(contenders, {.heats = kHeats, .rounds = kRounds, .finalists = 1},
             [&](double share, const std::string&) {
               progress(done + share / bake::kRaySets.size(), fmt::format("timing {}", bake::name_of(set)));
             });
    const auto finalist = std::ranges::find_if(timings.begin() + 1, timings.end(),
                                               [](const Timing& timing) { return !timing.rounds.empty(); });
    const double seconds = spread_of(finalist->rounds).median;
    result.mrays_per_s = double(rays.segments.size()) * 1e-6 / std::max(seconds, 1e-9);
    result.ratio = spread_of(timings.front().rounds).median / std::max(seconds, 1e-9);
  }
  return sets;
}

}  // namespace nif::tools
