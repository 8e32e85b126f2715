// Runs `nif` with the faults of preload.cpp.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "tests/cli/program.hpp"

namespace nif::test {

/// Runs `nif` with these arguments and faults: names of variables in preload.cpp without "NIF_FAULT_", and
/// their values.
Outcome nif_with(const std::map<std::string, std::string>& faults, const std::vector<std::string>& arguments);

/// All files below a folder by name, with their bytes.
std::map<std::string, std::string> files_in(const std::filesystem::path& folder);

/// Whether a killed process leaves a file of this name beside its target.
bool is_temporary(const std::string& name);

/// A command that overwrites a file, with its inputs.
struct Command {
  std::string name;
  std::vector<std::string> arguments;
  std::filesystem::path target;
};
/// bake, attach and convert of small meshes in this folder. Each target exists already, with other bytes than
/// the command writes.
std::vector<Command> commands_in(const TempDir& folder);

}  // namespace nif::test
