// The accuracy of first hits by ray set, as `nif eval --hits` prints it.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "tools/common/first_hits.hpp"

namespace nif::tools {

std::string hit_tables(const SetHits& sets);

/// "hits" of a set: rates are fractions of its rays, percentiles by name.
nlohmann::ordered_json to_json(const HitAccuracy& hits);

}  // namespace nif::tools
