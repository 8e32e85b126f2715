// Starts `nif` through env, so that the library with the faults is loaded into `nif` and not into the
// test. Also the commands that are tested for what they leave behind.
#include "tests/faults/fault_run.hpp"

#include <gtest/gtest.h>

#include <regex>

#include "tests/cli/mesh_text.hpp"
#include "tests/support/gltf.hpp"
#include "tests/support/test_shapes.hpp"

namespace nif::test {

namespace fs = std::filesystem;

Outcome nif_with(const std::map<std::string, std::string>& faults,
                 const std::vector<std::string>& arguments) {
  std::vector<std::string> words{"LD_PRELOAD=" NIF_FAULTS};
  for (const auto& [name, value] : faults) words.push_back("NIF_FAULT_" + name + "=" + value);
  words.push_back(nif_path());
  words.insert(words.end(), arguments.begin(), arguments.end());
  return Process("/usr/bin/env", words).finish();
}

std::map<std::string, std::string> files_in(const fs::path& folder) {
  std::map<std::string, std::string> files;
  for (const auto& entry : fs::recursive_directory_iterator(folder))
    if (entry.is_regular_file())
      files[entry.path().lexically_relative(folder).string()] = read_bytes(entry.path());
  return files;
}

bool is_temporary(const std::string& name) {
  static const std::regex form(".*\\.tmp-[0-9a-f]{8}");
  return std::regex_match(name, form);
}

std::vector<Command> commands_in(const TempDir& folder) {
  const auto path = [&](const std::string& name) { return (folder.path() / name).string(); };
  folder.write("ball.obj", obj_text(icosphere(3)));
  folder.write("ball.glb", gltf_of(icosphere(3)).glb());
  const Outcome baked =
      nif({"bake", path("ball.glb"), "-o", path("asset.nif"), "--encoding", "bvh", "--rays", "0"});
  EXPECT_EQ(baked.code, 0) << baked.err;
  std::vector<Command> commands{
      {"bake",
       {"bake", path("ball.obj"), "-o", path("out.nif"), "--encoding", "exact", "--rays", "200", "-j", "1"},
       path("out.nif")},
      {"attach", {"attach", path("ball.glb"), path("asset.nif"), "-o", path("both.glb")}, path("both.glb")},
      {"convert", {"mesh", "convert", path("ball.obj"), "-o", path("out.ply")}, path("out.ply")}};
  for (const Command& command : commands) folder.write(command.target.filename(), "the old file");
  return commands;
}

}  // namespace nif::test
