// The command line of `nif bake --manifest`.
#pragma once

#include <string>
#include <vector>

#include "tools/common/options.hpp"
#include "tools/common/shared_options.hpp"

namespace nif::tools {

struct BatchArguments : RunArguments {
  std::string manifest, memory, report, depfile, shard, outputs;
  bool dry_run = false, keep_going = false, force = false;

  // `report` and `depfile` have a meaning for a single bake, too.
  /// Name of an option that has a meaning for a manifest alone, and was given; null where none was.
  const char* first_given() const;
};

/// --manifest and what belongs to it alone. `arguments` must outlive the command.
void add_batch_options(Command command, BatchArguments& arguments);

/// Bakes what the manifest names. Throws nif::Error: of the first asset that failed, with its code, among
/// others.
void run_batch(const BatchArguments& arguments);

/// A rule as make and ninja read it: each target depends on all of these files.
std::string dependency_rule(const std::vector<std::string>& targets, const std::vector<std::string>& files);

}  // namespace nif::tools
