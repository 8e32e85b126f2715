// Times several ways to do the same work in alternating rounds. If something disturbs the machine, it
// disturbs all of them equally.
#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

namespace nif::tools {

/// Of the same work in several rounds.
struct Spread {
  double median = 0, lowest = 0, highest = 0;
};
/// The median of an even number is the mean of the middle two. Not of nothing.
Spread spread_of(std::vector<double> values);
/// Of the ratios `of[r] / to[r]`, one for each round of both.
Spread ratio_by_round(const std::vector<double>& of, const std::vector<double>& to);

struct Contender {
  std::string name;
  size_t group;  ///< of which the fastest few go on after the heats
  /// Does the work once and returns the seconds that it took; what it prepares is its own time.
  std::function<double()> pass;
};

struct Timing {
  std::vector<double> heats, rounds;  ///< seconds of each pass; rounds is empty where it dropped out
};

struct Schedule {
  /// Every contender runs in each; the first also warms up. They only choose who goes on.
  size_t heats = 2;
  size_t rounds = 7;
  size_t finalists = 2;  ///< of each group, by their fastest heat
};

/// Timings by contender. `progress` is told the share of all passes done and whose turn it is; it may throw
/// to end it all.
std::vector<Timing> race(const std::vector<Contender>& contenders, const Schedule& schedule,
                         const std::function<void(double, const std::string&)>& progress);

}  // namespace nif::tools
