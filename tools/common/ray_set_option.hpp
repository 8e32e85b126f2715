// Parses --set, the ray sets to measure.
#pragma once

#include <string>
#include <vector>

#include "bake/ground_truth/ray_sets.hpp"
#include "tools/common/options.hpp"

namespace nif::tools {

/// Adds --set, which may be repeated. `otherwise` describes the default sets.
void add_set_option(Command command, std::vector<std::string>& names, const std::string& otherwise);

/// Returns the sets that --set names. Throws Error(usage).
std::vector<bake::RaySet> parse_sets(const std::vector<std::string>& names);

}  // namespace nif::tools
