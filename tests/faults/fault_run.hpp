// Runs `nif` with the faults of preload.cpp.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "tests/cli/program.hpp"

namespace nif::test {

/// `nif` with these arguments under these faults: names of variables in preload.cpp, without "NIF_FAULT_",
/// and their values.
Outcome nif_with(const std::map<std::string, std::string>& faults, const std::vector<std::string>& arguments);

/// All files below a folder by name, with their bytes.
std::map<std::string, std::string> files_in(const std::filesystem::path& folder);

/// Is it what a killed process leaves beside its target?
bool is_temporary(const std::string& name);

/// A command that writes one file over another one, with what it needs.
struct Command {
  std::string name;
  std::vector<std::string> arguments;
  std::filesystem::path target;
};
/// bake, attach and convert, of small meshes in this folder; each target exists, with other bytes than the
/// command writes.
std::vector<Command> commands_in(const TempDir& folder);

}  // namespace nif::test
