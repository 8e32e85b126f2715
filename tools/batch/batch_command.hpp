// Implements the command line of `nif bake --manifest`.
#pragma once

#include <string>
#include <vector>

#include "tools/common/options.hpp"
#include "tools/common/shared_options.hpp"

namespace nif::tools {

struct BatchArguments : RunArguments {
  std::string manifest, memory, report, depfile, shard, outputs;
  bool dry_run = false, keep_going = false, force = false;

  // `report` and `depfile` also apply to a single bake.
  /// Returns the name of a given option that applies to manifests only, or null if there is none.
  const char* first_given() const;
};

/// Adds --manifest and the options that only it uses. `arguments` must outlive the command.
void add_batch_options(Command command, BatchArguments& arguments);

/// Bakes the assets of the manifest. Throws nif::Error: if assets fail, the error of the first one, with its
/// code.
void run_batch(const BatchArguments& arguments);

/// A rule in the syntax of make and ninja: each target depends on all of these files.
std::string dependency_rule(const std::vector<std::string>& targets, const std::vector<std::string>& files);

}  // namespace nif::tools
