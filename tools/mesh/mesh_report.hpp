// Formats what `nif mesh info` and `nif mesh repair` print about a mesh.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "mesh/inspect/inspect.hpp"

namespace nif::tools {

/// All counts, and a list of the thousand largest components.
nlohmann::ordered_json to_json(const inspect::Inspection& inspection);

/// A few lines, without self-intersections.
std::string to_text(const inspect::Inspection& inspection);

/// "closed", "2 of 3 components open", ...: the state of a mesh in a few words.
std::string summary_of(const inspect::Inspection& inspection);

}  // namespace nif::tools
