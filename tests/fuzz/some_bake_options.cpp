// A few of the options of `nif bake`, one of each kind, in place of all of them: fuzz_scene reads manifests
// without the baker, which would take minutes to compile for it. What options mean is not fuzzed.
#include "tools/common/bake_options.hpp"

#include "formats/base/status.hpp"

namespace nif::tools {

void add_bake_options(Command command, BakeArguments& arguments) {
  command.add_option("--preset", arguments.preset);
  command.add_option("--resolution", arguments.resolution).range<uint32_t>(2, 1024);
  command.add_option("--max-error", arguments.max_error);
  command.add_option("--seed", arguments.seed);
  command.add_flag("--merge", arguments.merge, "");
  command.add_option("--merge-nodes", arguments.merge_nodes).one_word_each();
  command.add_option("--view", arguments.spherical.view);
}

bake::BakeOptions resolve_options(const BakeArguments& arguments) {
  if (!arguments.merge && !arguments.merge_nodes.empty())
    throw Error(Status::usage, "--merge-nodes needs --merge");
  return {};
}

}  // namespace nif::tools
