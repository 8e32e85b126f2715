// --set: the ray sets to measure.
#pragma once

#include <string>
#include <vector>

#include "bake/oracle/ray_sets.hpp"
#include "tools/common/options.hpp"

namespace nif::tools {

/// --set, which may be repeated. `otherwise` says which sets are the default.
void add_set_option(Command command, std::vector<std::string>& names, const std::string& otherwise);

/// The sets that --set names. Throws Error(usage).
std::vector<bake::RaySet> parse_sets(const std::vector<std::string>& names);

}  // namespace nif::tools
