// What the verbs of `nif mesh` that change meshes share: read a file, change it, write another, report what
// changed.
#pragma once

#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "formats/mesh/write.hpp"
#include "tools/mesh/input.hpp"
#include "tools/mesh/mesh.hpp"

namespace nif::tools {

struct WorkArguments {
  std::string input, output;
  mesh::WriteOptions write;
  uint32_t threads = 0;
  bool json = false, quiet = false;
};

/// INPUT, -o, --draco, --draco-bits, --text, -j, --json and --quiet of `command`, whose results have the
/// schema nifkit.mesh-`verb`/1.
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

/// The longest side of the bounds of a mesh; 0 where it has no vertices.
double longest_side(const mesh::Mesh& mesh);
/// The diagonal of these bounds.
double diagonal(const mesh::Mesh& mesh);

/// A length as text: "0.01", in units of the mesh, or "0.1%", of the diagonal of its bounds. Throws
/// Error(usage) that names `option` where it is neither, or is not above 0.
class Length {
 public:
  Length(const std::string& text, const std::string& option);
  double of(const mesh::Mesh& mesh) const { return relative_ ? value_ * diagonal(mesh) : value_; }

 private:
  double value_ = 0;
  bool relative_ = false;
};

}  // namespace nif::tools
