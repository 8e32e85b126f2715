// How fine the grids of an asset's objects are, which the runtime's interface does not say.
#pragma once

#include <string>
#include <vector>

namespace nif::tools {

/// By object; 0 where its encoding has no grid.
std::vector<double> voxels_per_unit(const std::string& asset);

}  // namespace nif::tools
