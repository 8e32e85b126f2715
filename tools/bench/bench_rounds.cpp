// Heats choose the fastest few of each group; only these run in the rounds that count. The order of turns
// rotates and reverses from round to round, so that nobody always runs after the same contender.
#include "tools/bench/bench_rounds.hpp"

#include <algorithm>
#include <map>
#include <numeric>

namespace nif::tools {
namespace {

/// The fastest `finalists` of each group.
std::vector<size_t> qualified(const std::vector<Contender>& contenders, const std::vector<Timing>& timings,
                              size_t finalists) {
  std::map<size_t, std::vector<size_t>> groups;
  for (size_t c = 0; c < contenders.size(); ++c) groups[contenders[c].group].push_back(c);
  const auto fastest = [&](size_t c) {
    return *std::min_element(timings[c].heats.begin(), timings[c].heats.end());
  };
  std::vector<size_t> all;
  for (auto& [group, members] : groups) {
    std::stable_sort(members.begin(), members.end(),
                     [&](size_t a, size_t b) { return fastest(a) < fastest(b); });
    members.resize(std::min(members.size(), finalists));
    all.insert(all.end(), members.begin(), members.end());
  }
  return all;
}

}  // namespace

Spread spread_of(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  const size_t n = values.size();
  return {(values[(n - 1) / 2] + values[n / 2]) / 2, values.front(), values.back()};
}

Spread ratio_by_round(const std::vector<double>& of, const std::vector<double>& to) {
  std::vector<double> ratios;
  for (size_t r = 0; r < of.size(); ++r) ratios.push_back(of[r] / to[r]);
  return spread_of(ratios);
}

std::vector<Timing> race(const std::vector<Contender>& contenders, const Schedule& schedule,
                         const std::function<void(double, const std::string&)>& progress) {
  std::vector<Timing> timings(contenders.size());
  std::vector<size_t> starters(contenders.size());
  std::iota(starters.begin(), starters.end(), size_t{0});

  std::map<size_t, size_t> groups;
  for (const Contender& contender : contenders) ++groups[contender.group];
  size_t done = 0, passes = schedule.heats * contenders.size();
  for (const auto& [group, size] : groups) passes += schedule.rounds * std::min(size, schedule.finalists);

  const auto run = [&](std::vector<double> Timing::*kept, size_t rounds) {
    for (size_t r = 0; r < rounds; ++r) {
      for (size_t i = 0; i < starters.size(); ++i) {
        // Each round starts with another contender, and every second one runs backwards, so nobody always
        // follows the same one.
        const size_t turn = (i + r) % starters.size();
        const size_t c = starters[r % 2 == 0 ? turn : starters.size() - 1 - turn];
        progress(double(done++) / double(passes), contenders[c].name);
        (timings[c].*kept).push_back(contenders[c].pass());
      }
    }
  };
  run(&Timing::heats, schedule.heats);
  starters = qualified(contenders, timings, schedule.finalists);
  run(&Timing::rounds, schedule.rounds);
  return timings;
}

}  // namespace nif::tools
