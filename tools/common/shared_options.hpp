// Adds options that several subcommands share, so that each has one name, one meaning and one wording
// everywhere.
#pragma once

#include <cstdint>
#include <string>

#include "formats/mesh/mesh_choice.hpp"
#include "tools/common/options.hpp"

namespace nif::tools {

/// How to run, and what to print.
struct RunArguments {
  uint32_t threads = 0;  ///< for limit_threads()
  bool json = false, quiet = false;
};

/// How the runtime answers on the CPU.
struct RuntimeArguments {
  std::string isa = "auto";  ///< as in the runtime's configuration, which refuses unknown words
  bool least_memory = false;

  /// For nifNewDevice().
  std::string configuration() const;
};

/// Adds -j, --threads, --json and --quiet. `schema` is the schema that the printed JSON names.
void add_run_options(Command command, RunArguments& arguments, const std::string& schema);

/// Adds --only and --except; check_choice() checks them once they are parsed.
void add_choice_options(Command command, mesh::Choice& choice);
/// Throws Error(usage) if there are too many patterns.
void check_choice(const mesh::Choice& choice);

/// Each adds one option. The variables hold the defaults, and must live until the words are parsed.
void add_threads_option(Command command, uint32_t& threads);
void add_json_option(Command command, bool& json, const std::string& schema);
void add_quiet_option(Command command, bool& quiet);
/// Adds --format for the mesh that a command reads: ReadLimits::format.
void add_format_option(Command command, std::string& format);
void add_seed_option(Command command, uint64_t& seed);
/// Adds --isa and --least-memory.
void add_runtime_options(Command command, RuntimeArguments& arguments);

}  // namespace nif::tools
