// Reports what `nif bake` merged in a scene.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "formats/mesh/merging.hpp"

namespace nif::tools {

/// How many instances were merged, and why the others were not, for --json.
nlohmann::ordered_json to_json(const mesh::Merging& merging);

/// "merged 8123 of 10000 instances, which do not move against each other, into 24 objects; 1877 stay: 3 move,
/// 1874 would exceed --merge-triangles 1000000". `copies`: with --merge, which makes copies.
std::string summary(const mesh::Merging& merging, bool copies);

}  // namespace nif::tools
