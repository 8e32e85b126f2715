// Options that several subcommands have: each has one name, one meaning and one wording everywhere.
#pragma once

#include <string>

#include "tools/common/options.hpp"

namespace nif::tools {

/// --isa: what the runtime's configuration says of instruction sets. `value` is the default.
void add_isa_option(Command command, std::string& value);

}  // namespace nif::tools
