// Draws ray sets by weight: subtracts weights from one random number until it is used up. If rounding leaves
// a remainder, takes the last set with a weight, so that a set of weight 0 is never drawn.
#include "bake/mix.hpp"

#include <numeric>

namespace nif::bake {

RaySet draw_set(const Mix& mix, Random& random) {
  double pick = random.uniform(0, std::accumulate(mix.begin(), mix.end(), 0.0));
  RaySet set = RaySet::outer_lines;
  for (RaySet candidate : kRaySets) {
    if (mix[size_t(candidate)] <= 0) continue;
    set = candidate;
    pick -= mix[size_t(candidate)];
    if (pick < 0) break;
  }
  return set;
}

}  // namespace nif::bake
