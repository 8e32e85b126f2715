// What the verbs of `nif mesh` that change meshes share: read a file, change it, write another, report what
// changed.
#pragma once

#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "formats/mesh/write.hpp"
#include "tools/common/options.hpp"
#include "tools/common/progress.hpp"
#include "tools/common/shared_options.hpp"
#include "tools/mesh/input.hpp"
#include "tools/mesh/verbs.hpp"

namespace nif::tools {

struct WorkArguments : RunArguments {
  std::string input, output;
  mesh::WriteOptions write;
  mesh::ReadLimits limits;  ///< a verb sets these, and its user the format
};

/// INPUT, -o, --format, --draco, --draco-bits, --text, -j, --json and --quiet of `command`, whose results
/// have the schema nifkit.mesh-`verb`/1.
void add_work_options(Command command, WorkArguments& arguments, const std::string& verb);

/// What a verb has to say of its work.
struct WorkResult {
  nlohmann::ordered_json json = nlohmann::ordered_json::object();  ///< beside what all verbs say
  std::string text;                ///< lines that follow the first one; may be empty
  std::vector<std::string> notes;  ///< one sentence each
};

/// Does the work of `verb`: `change` is given what was read and leaves what is to be written. Meshes that it
/// leaves without triangles are dropped, with their instances and a note. While it runs, Ctrl-C ends the
/// process at once. Prints the results.
void work_on(const WorkArguments& arguments, const std::string& verb,
             const std::function<WorkResult(mesh::Scene&, Progress&)>& change);

}  // namespace nif::tools
