// The accuracy of first hits by ray set, for people.
#pragma once

#include <string>

#include "bake/oracle/hits.hpp"

namespace nif::tools {

/// All of it, as `nif eval --hits` prints it.
std::string hit_tables(const bake::SetHitFigures& sets);

/// A few figures in a line for each set that was measured, as `nif bake` prints them.
std::string hit_lines(const bake::SetHitFigures& sets);

}  // namespace nif::tools
