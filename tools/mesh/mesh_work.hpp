// The common frame of the verbs of `nif mesh` that change meshes: read a file, change it, write another,
// report what changed.
#pragma once

#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "formats/mesh/write.hpp"
#include "tools/common/options.hpp"
#include "tools/common/progress.hpp"
#include "tools/common/shared_options.hpp"
#include "tools/mesh/verb_input.hpp"
#include "tools/mesh/verbs.hpp"

namespace nif::tools {

struct WorkArguments : RunArguments {
  std::string input, output;
  mesh::WriteOptions write;
  mesh::ReadLimits limits;  ///< set by the verb, except the format, which the user sets
};

/// Adds INPUT, -o, --format, --draco, --draco-bits, --text, -j, --json and --quiet to `command`, whose
/// results have the schema nifkit.mesh-`verb`/1.
void add_work_options(Command command, WorkArguments& arguments, const std::string& verb);

/// The results of a verb.
struct WorkResult {
  /// Added to the members that all verbs have.
  nlohmann::ordered_json json = nlohmann::ordered_json::object();
  std::string text;                ///< lines after the first one; may be empty
  std::vector<std::string> notes;  ///< one sentence each
};

/// Runs `verb`: `change` turns the scene that was read into the one to write. Meshes that it leaves without
/// triangles are dropped, with their instances and a note. While `change` runs, Ctrl-C ends the process at
/// once. Prints the results.
void work_on(const WorkArguments& arguments, const std::string& verb,
             const std::function<WorkResult(mesh::Scene&, Progress&)>& change);

}  // namespace nif::tools
