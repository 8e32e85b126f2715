// Times several ways to do the same work in alternating rounds. If something disturbs the machine, it
// disturbs all of them equally.
#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

namespace nif::tools {

/// Statistics of a measurement over several rounds.
struct Spread {
  double median = 0, lowest = 0, highest = 0;
};
/// The median of an even number of values is the mean of the middle two. `values` must not be empty.
Spread spread_of(std::vector<double> values);
/// Spread of the ratios `of[r] / to[r]`, one for each round.
Spread ratio_by_round(const std::vector<double>& of, const std::vector<double>& to);

struct Contender {
  std::string name;
  size_t group;  ///< the fastest few of each group advance from the heats
  /// Does the work once and returns the seconds that it took, without preparation.
  std::function<double()> pass;
};

struct Timing {
  std::vector<double> heats, rounds;  ///< seconds of each pass; rounds is empty if it was eliminated
};

struct Schedule {
  /// Every contender runs in each; the first also warms up. They only decide who advances.
  size_t heats = 2;
  size_t rounds = 7;
  size_t finalists = 2;  ///< per group, by their fastest heat
};

/// Returns timings by contender. `progress` gets the fraction of passes done and whose turn it is; it may
/// throw to end everything.
std::vector<Timing> race(const std::vector<Contender>& contenders, const Schedule& schedule,
                         const std::function<void(double, const std::string&)>& progress);

}  // namespace nif::tools
