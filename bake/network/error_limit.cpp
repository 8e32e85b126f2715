// Sets a decision threshold from rays that training has not seen: moves it past as many mistakes as the bound
// (Clopper and Pearson) requires. If no threshold suffices, only the safe answer is given.
#include "bake/network/error_limit.hpp"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <functional>
#include <nlohmann/json.hpp>

#include "bake/bake_clock.hpp"
#include "bake/ground_truth/evaluate.hpp"
#include "bake/loaded/open_filter.hpp"
#include "bake/seeds.hpp"
#include "kernels/reference/encodings/reference_segment.hpp"

namespace nif::bake {
namespace {

constexpr std::pair<Mistake, std::string_view> kMistakes[] = {{Mistake::leak, "leak"},
                                                              {Mistake::spurious, "spurious"}};

// This many mistakes are expected among the rays at the given rate: the bound is then some 12 % above the
// count.
constexpr double kExpectedMistakes = 400;
constexpr uint64_t kLeastRays = 250'000, kMostRays = 16'000'000;
constexpr uint64_t kRaysAtATime = 1'000'000;
/// Rays of one sun are alike, so there are many suns: kSuns for each part of the rays.
constexpr uint64_t kPartsOfSun = 8;

uint64_t rays_for(double rate) {
  if (rate * double(kMostRays) < kExpectedMistakes) return kMostRays;
  return std::max(kLeastRays, uint64_t(kExpectedMistakes / rate));
}

/// The most mistakes among this many rays that still prove the rate; -1: not even none does.
int64_t most_mistakes(uint64_t rays, double rate) {
  int64_t good = -1, bad = int64_t(rays);
  if (rate >= 1) return bad;
  while (bad - good > 1) {
    const int64_t middle = good + (bad - good) / 2;
    (rate_bound(rays, uint64_t(middle)) <= rate ? good : bad) = middle;
  }
  return good;
}

/// How far the network's output is on the wrong side, for a ray whose wrong answer would be this mistake;
/// below 0: the answer is right.
int64_t excess_of(Mistake mistake, int64_t output) { return mistake == Mistake::leak ? output : -1 - output; }

HeldOut hold_out(const RaySource& source, RaySet set, const kernels::SegmentField& field,
                 const OpenFilter& filter, Mistake mistake, uint64_t count, uint64_t seed,
                 const std::atomic<bool>& cancel) {
  constexpr size_t kChunk = 4096;
  const uint64_t least_parts = set == RaySet::sun ? kPartsOfSun : 1;
  const uint64_t part = std::min(kRaysAtATime, (count + least_parts - 1) / least_parts);
  HeldOut held;
  for (uint64_t first = 0; first < count; first += part) {
    stop_if(cancel);
    const std::vector<Segment> rays =
        draw_ray_set(source, set, std::min(part, count - first), seed + (first / part << 32)).segments;
    held.rays += rays.size();
    std::vector<std::vector<uint32_t>> chunks((rays.size() + kChunk - 1) / kChunk);
    tbb::parallel_for(size_t{0}, chunks.size(), [&](size_t b) {
      const auto chunk = std::span(rays).subspan(b * kChunk, std::min(kChunk, rays.size() - b * kChunk));
      std::vector<uint32_t> open;
      filter.select(chunk, open);
      for (const uint32_t i : open) {
        const int64_t excess = excess_of(mistake, kernels::query(field, chunk[i]).logit);
        if (excess < 0 || source.embree.occluded(chunk[i]) != (mistake == Mistake::leak)) continue;
        chunks[b].push_back(uint32_t(excess));
      }
    });
    for (const std::vector<uint32_t>& chunk : chunks)
      held.excess.insert(held.excess.end(), chunk.begin(), chunk.end());
  }
  return held;
}

}  // namespace

std::string_view name_of(Mistake mistake) {
  for (const auto& [known, name] : kMistakes)
    if (known == mistake) return name;
  return {};
}

std::optional<uint32_t> least_move(std::span<HeldOut> sets, double rate) {
  uint32_t move = 0;
  for (HeldOut& set : sets) {
    if (set.rays == 0) continue;
    std::ranges::sort(set.excess, std::greater());
    const int64_t most = most_mistakes(set.rays, rate);
    if (most < 0) return std::nullopt;
    if (size_t(most) < set.excess.size()) move = std::max(move, set.excess[size_t(most)] + 1);
  }
  return move;
}

ErrorLimitReport limit_error(const RaySource& source, const format::Object& object, const ErrorLimit& asked,
                             uint64_t seed, const std::atomic<bool>& cancel, format::Mlp& network) {
  const kernels::SegmentField field = format::field_of(object, network);
  const uint64_t count = rays_for(asked.rate);
  std::array<HeldOut, kRaySets.size()> held;
  std::optional<uint32_t> shown;
  if (rate_bound(count, 0) <= asked.rate) {
    const OpenFilter filter(field);
    for (const RaySet set : kRaySets)
      held[size_t(set)] =
          hold_out(source, set, field, filter, asked.mistake, count, seed + kThresholdSeed, cancel);
    shown = least_move(held, asked.rate);
  }

  ErrorLimitReport report{asked, 0, false, {}};
  report.proven = !shown;
  // If nothing else suffices: as far as the network's outputs can reach.
  const format::OutputRange range = format::output_range(network);
  const bool leak = asked.mistake == Mistake::leak;
  const int64_t furthest = excess_of(asked.mistake, leak ? range.largest : range.least);
  const int64_t move = shown ? int64_t{*shown} : std::max<int64_t>(furthest + 1, 0);
  report.threshold = int32_t(leak ? move : -move);
  format::move_threshold(network, report.threshold);
  for (const RaySet set : kRaySets) {
    if (report.proven || held[size_t(set)].rays == 0) continue;
    const HeldOut& rays = held[size_t(set)];
    ErrorLimitReport::Set& reached = report.sets[size_t(set)];
    reached.rays = rays.rays;
    reached.wrong = uint64_t(std::ranges::count_if(rays.excess, [&](uint32_t e) { return e >= move; }));
    reached.bound = rate_bound(reached.rays, reached.wrong);
  }
  return report;
}

RaySet ErrorLimitReport::worst() const {
  return *std::ranges::max_element(kRaySets, {}, [&](RaySet set) { return sets[size_t(set)].bound; });
}

std::string describe(const ErrorLimitReport& report) {
  const bool leak = report.asked.mistake == Mistake::leak;
  const std::string against = leak ? "limits leaks" : "limits spurious answers";
  if (report.proven)
    return fmt::format("{}: where the network is asked, it always answers {}", against,
                       leak ? "occluded" : "visible");
  const RaySet set = report.worst();
  const ErrorLimitReport::Set& worst = report.sets[size_t(set)];
  return fmt::format("{}: {:.4f} % of {} with a threshold of {}, below {:.4f} % with 99 % confidence",
                     against, 100 * double(worst.wrong) / double(std::max<uint64_t>(worst.rays, 1)),
                     name_of(set), report.threshold, 100 * worst.bound);
}

nlohmann::ordered_json to_json(const ErrorLimitReport& report) {
  nlohmann::ordered_json json{{"against", name_of(report.asked.mistake)},
                              {"rate", report.asked.rate},
                              {"threshold", report.threshold},
                              {"proven", report.proven}};
  for (const RaySet set : kRaySets) {
    const ErrorLimitReport::Set& reached = report.sets[size_t(set)];
    if (reached.rays == 0) continue;
    json["sets"][std::string(name_of(set))] = {
        {"rays", reached.rays},
        {name_of(report.asked.mistake), double(reached.wrong) / double(reached.rays)},
        {"bound", reached.bound}};
  }
  return json;
}

}  // namespace nif::bake
