#include "tools/common/shared_options.hpp"

namespace nif::tools {

void add_isa_option(Command command, std::string& value) {
  command.add_option("--isa", value, "Instruction set of the runtime: auto, scalar, sse4, avx2, avx512, neon")
      .capture_default_str();
}

}  // namespace nif::tools
