// Finds how fine the grids of an asset's objects are, because the runtime's interface does not report it.
#pragma once

#include <string>
#include <vector>

namespace nif::tools {

/// By object; 0 if its encoding has no grid.
std::vector<double> voxels_per_unit(const std::string& asset);

}  // namespace nif::tools
