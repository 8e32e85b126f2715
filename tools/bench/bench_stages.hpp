// Times each stage of an asset's `spherical` objects, to show where a query spends its time.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "bake/ground_truth/ray_sets.hpp"
#include "kernels/cpu/spherical/stage_times.hpp"
#include "tools/bench/bench_rounds.hpp"

namespace nif::tools {

/// Nanoseconds per ray of the set on one thread, indexed by kernels::cpu::SphericalStage.
using StageTimes = std::array<Spread, kernels::cpu::kSphericalStages>;

/// Queries each `spherical` object of an asset with its rays, `rounds` times. Returns nothing if there is no
/// such object. `rays` has an entry for each object. Throws nif::Error if the file cannot be read, and
/// Error(internal) if the number of wrong answers over all rays is not `wrong`.
std::optional<StageTimes> time_stages(const std::string& asset,
                                      const std::vector<const bake::RaysWithTruth*>& rays, size_t rounds,
                                      uint64_t wrong);

}  // namespace nif::tools
