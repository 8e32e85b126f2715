#include "tools/common/shared_options.hpp"

namespace nif::tools {

void add_run_options(Command command, RunArguments& arguments, const std::string& schema) {
  add_threads_option(command, arguments.threads);
  add_json_option(command, arguments.json, schema);
  add_quiet_option(command, arguments.quiet);
}

void add_threads_option(Command command, uint32_t& threads) {
  command.add_option("-j,--threads", threads, "Threads (0 = all cores). The result does not depend on it")
      .capture_default_str();
}

void add_json_option(Command command, bool& json, const std::string& schema) {
  command.add_flag("--json", json, "Print the results as one JSON object (" + schema + ")");
}

void add_quiet_option(Command command, bool& quiet) {
  command.add_flag("--quiet", quiet, "No progress or notes, and no summary of what was written");
}

void add_seed_option(Command command, uint64_t& seed) {
  command.add_option("--seed", seed, "Seed of all random numbers").capture_default_str();
}

void add_isa_option(Command command, std::string& isa) {
  command.add_option("--isa", isa, "Instruction set of the runtime: auto, scalar, sse4, avx2, avx512, neon")
      .capture_default_str();
}

}  // namespace nif::tools
