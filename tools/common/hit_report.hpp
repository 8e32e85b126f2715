// Formats the accuracy of first hits by ray set for people.
#pragma once

#include <string>

#include "bake/ground_truth/evaluate_hits.hpp"

namespace nif::tools {

/// All figures, as `nif eval --hits` prints them.
std::string hit_tables(const bake::SetHitFigures& sets);

/// One line with a few figures for each measured set, as `nif bake` prints them.
std::string hit_lines(const bake::SetHitFigures& sets);

}  // namespace nif::tools
