// Keeps the shared help texts in one place, so that a change of wording shows in every subcommand.
#include "tools/common/shared_options.hpp"

#include <fmt/format.h>

#include <utility>

#include "formats/base/status.hpp"
#include "formats/mesh/read.hpp"

namespace nif::tools {

void add_run_options(Command command, RunArguments& arguments, const std::string& schema) {
  add_threads_option(command, arguments.threads);
  add_json_option(command, arguments.json, schema);
  add_quiet_option(command, arguments.quiet);
}

void add_choice_options(Command command, mesh::Choice& choice) {
  command
      .add_option(
          "--only", choice.only,
          "Read only parts with this name: nodes (with everything below them), meshes and materials of glTF, "
          "objects, groups and materials of OBJ, solids of STL. May contain *, ? and [...], and may be "
          "repeated")
      .one_word_each();
  command
      .add_option("--except", choice.except,
                  "Leave out parts with this name, e.g. collision shapes. Patterns as for --only; takes "
                  "precedence over it")
      .one_word_each();
}

void check_choice(const mesh::Choice& choice) {
  for (const auto& [names, option] : {std::pair{&choice.only, "--only"}, {&choice.except, "--except"}})
    if (names->size() > mesh::kMostPatterns)
      throw Error(Status::usage, fmt::format("{} can be given {} times at most; use a pattern", option,
                                             mesh::kMostPatterns));
}

void add_threads_option(Command command, uint32_t& threads) {
  command.add_option("-j,--threads", threads, "Threads (0 = all cores). The result does not depend on it")
      .range(0, 1024)
      .capture_default_str();
}

void add_json_option(Command command, bool& json, const std::string& schema) {
  command.add_flag("--json", json, "Print the results as one JSON object (" + schema + ")");
}

void add_quiet_option(Command command, bool& quiet) {
  command.add_flag("--quiet", quiet, "No progress or notes, and no summary of what was written");
}

void add_format_option(Command command, std::string& format) {
  command
      .add_option("--format", format,
                  "Format of the mesh file, whatever its name and content are: obj, ply, stl, off, gltf, glb "
                  "or drc. MESH and INPUT may be -, standard input, where OBJ always needs this")
      .one_of({mesh::kFormats.begin(), mesh::kFormats.end()});
}

void add_seed_option(Command command, uint64_t& seed) {
  command.add_option("--seed", seed, "Seed of all random numbers").capture_default_str();
}

std::string RuntimeArguments::configuration() const {
  return fmt::format("isa={},memory={}", isa, least_memory ? "least" : "auto");
}

void add_runtime_options(Command command, RuntimeArguments& arguments) {
  command
      .add_option("--isa", arguments.isa,
                  "Instruction set of the runtime: auto, scalar, sse4, avx2, avx512, neon")
      .capture_default_str();
  command.add_flag("--least-memory", arguments.least_memory,
                   "Make the runtime's tables as small as possible; rays are slower");
}

}  // namespace nif::tools
