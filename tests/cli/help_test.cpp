// What a newcomer types first: help is a result, not an error.
#include <gtest/gtest.h>

#include <sstream>

#include "tests/cli/program.hpp"

namespace nif::test {
namespace {

TEST(Help, IsPrintedToStandardOutput) {
  for (const std::vector<std::string>& command : std::vector<std::vector<std::string>>{{},
                                                                                       {"attach"},
                                                                                       {"bake"},
                                                                                       {"bench"},
                                                                                       {"devices"},
                                                                                       {"eval"},
                                                                                       {"export-shader"},
                                                                                       {"farm"},
                                                                                       {"info"},
                                                                                       {"mesh"},
                                                                                       {"mesh", "convert"},
                                                                                       {"mesh", "generate"},
                                                                                       {"mesh", "info"},
                                                                                       {"mesh", "repair"},
                                                                                       {"mesh", "decimate"},
                                                                                       {"mesh", "subdivide"},
                                                                                       {"mesh", "remesh"},
                                                                                       {"mesh", "voxelize"},
                                                                                       {"mesh", "compare"},
                                                                                       {"query"},
                                                                                       {"render"}}) {
    for (const char* option : {"--help", "-h"}) {
      std::vector<std::string> arguments = command;
      arguments.push_back(option);
      SCOPED_TRACE(testing::PrintToString(arguments));
      const Outcome outcome = nif(arguments);
      EXPECT_EQ(outcome.code, 0);
      EXPECT_NE(outcome.out.find("Usage"), std::string::npos) << outcome.out;
      EXPECT_NE(outcome.out.find("Examples:\n  nif "), std::string::npos) << outcome.out;
      EXPECT_EQ(outcome.err, "");
    }
  }
}

TEST(Help, NamesTheSubcommandsAndTheirOptions) {
  const std::string all = nif({"--help"}).out, bake = nif({"bake", "--help"}).out,
                    bench = nif({"bench", "--help"}).out, eval = nif({"eval", "--help"}).out,
                    generate = nif({"mesh", "generate", "--help"}).out;
  for (const char* word :
       {"attach", "bake", "bench", "devices", "eval", "export-shader", "info", "mesh", "query", "render"})
    EXPECT_NE(all.find(word), std::string::npos) << word;
  for (const char* word : {"--output", "--preset", "--encoding", "--prefer", "--max-bytes", "--max-error",
                           "--max-leak", "--max-spurious", "--uncoded", "--mix", "--outer-resolution",
                           "--precision", "--shared-network", "--seed", "--json", "--quiet"})
    EXPECT_NE(bake.find(word), std::string::npos) << word;
  for (const char* word : {"--mesh", "--set", "--rays", "--seed", "--threads", "--rounds", "--isa", "--plot",
                           "--least-memory", "--device", "--asset", "--moved"})
    EXPECT_NE(bench.find(word), std::string::npos) << word;
  for (const char* word : {"--mesh", "--set", "--rays", "--seed", "--json"})
    EXPECT_NE(eval.find(word), std::string::npos) << word;
  for (const char* word : {"--output", "--triangles", "--seed", "--json", "--quiet", "statue", "tori",
                           "torus", "tree", "terrain", "chain-mail", "city", "--instances"})
    EXPECT_NE(generate.find(word), std::string::npos) << word;
}

TEST(Help, NamesEachInstructionSet) {
  for (const char* command : {"bench", "eval", "query", "render"}) {
    const std::string help = nif({command, "--help"}).out;
    for (const char* isa : {"scalar", "sse4", "avx2", "avx512", "neon"})
      EXPECT_NE(help.find(isa), std::string::npos) << command << ' ' << isa;
  }
}

/// The help of a command as one line, independent of the terminal's width.
std::string words_of_help(std::vector<std::string> command) {
  command.emplace_back("--help");
  std::istringstream words(nif(command).out);
  std::string line;
  for (std::string word; words >> word;) line += word + ' ';
  return line;
}

TEST(Help, DescribesAnOptionTheSameEverywhere) {
  const std::string bake = words_of_help({"bake"});
  for (const std::vector<std::string>& command : std::vector<std::vector<std::string>>{{"eval"},
                                                                                       {"mesh", "compare"},
                                                                                       {"mesh", "convert"},
                                                                                       {"mesh", "generate"},
                                                                                       {"mesh", "info"},
                                                                                       {"mesh", "remesh"},
                                                                                       {"mesh", "voxelize"},
                                                                                       {"query"},
                                                                                       {"render"}}) {
    const std::string help = words_of_help(command);
    for (const std::string option : {"--threads", "--quiet"}) {
      const size_t at = bake.find(option + " "), here = help.find(option + " ");
      ASSERT_NE(at, std::string::npos) << option;
      ASSERT_NE(here, std::string::npos) << option << " of " << testing::PrintToString(command);
      EXPECT_EQ(help.substr(here, 60), bake.substr(at, 60)) << testing::PrintToString(command);
    }
  }
}

TEST(Help, VersionStatesTheLicenceToo) {
  const Outcome outcome = nif({"--version"});
  EXPECT_EQ(outcome.code, 0);
  EXPECT_NE(outcome.out.find("nif " NIF_VERSION_STRING), std::string::npos) << outcome.out;
  EXPECT_NE(outcome.out.find("Apache-2.0"), std::string::npos) << outcome.out;
  EXPECT_EQ(outcome.err, "");
}

TEST(Help, OfNifBakeIsThatOfBake) {
  const Outcome alias = Process(nif_path().parent_path() / "nif-bake", {"--help"}).finish();
  EXPECT_EQ(alias.code, 0);
  EXPECT_EQ(alias.out, nif({"bake", "--help"}).out);
}

}  // namespace
}  // namespace nif::test
