// `nif devices`, with the GPU module of an emulated machine, and without one.
#include <gtest/gtest.h>

#include <cstdlib>
#include <nlohmann/json.hpp>

#include "tests/cli/program.hpp"

namespace nif::test {
namespace {

class Devices : public testing::Test {
 protected:
  void use_module(const char* file) { ASSERT_EQ(setenv("NIF_GPU_MODULE", file, 1), 0); }
  void TearDown() override { unsetenv("NIF_GPU_MODULE"); }
};

#ifdef NIF_EMULATED_MODULE
TEST_F(Devices, AreListed) {
  use_module(NIF_EMULATED_MODULE);
  const Outcome outcome = nif({"devices"});
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  const auto lines = lines_of(outcome.out);
  ASSERT_EQ(lines.size(), 7u) << outcome.out;
  EXPECT_TRUE(lines[0].starts_with("cpu  isa ")) << lines[0];
  EXPECT_TRUE(lines[1].starts_with("gpu  device=0: emulated GPU 0, wmma, ")) << lines[1];
  EXPECT_TRUE(lines[2].starts_with("gpu  device=1: emulated GPU 1, imma, ")) << lines[2];
  EXPECT_EQ(outcome.err, "");

  const auto result = nlohmann::json::parse(nif({"devices", "--json"}).out);
  EXPECT_EQ(result["schema"], "nifkit.devices/2");
  ASSERT_EQ(result["backends"].size(), 3u);
  EXPECT_EQ(result["backends"][1]["name"], "cuda");
  EXPECT_EQ(result["backends"][1]["available"], false);
  EXPECT_EQ(result["backends"][2]["name"], "hip");
  EXPECT_EQ(result["backends"][2]["available"], true);
  ASSERT_EQ(result["gpus"].size(), 6u);
  EXPECT_EQ(result["gpus"][1]["device"], 1);
  EXPECT_EQ(result["gpus"][1]["backend"], "hip");
  EXPECT_EQ(result["gpus"][1]["pci"], "0001:03:03.0");
  EXPECT_EQ(result["gpus"][1]["uuid"], "ab010000-0000-0000-0000-000000000000");
  EXPECT_EQ(result["gpus"][1]["target"], "imma");
  EXPECT_EQ(result["gpus"][1]["available"], true);
}
#endif

TEST_F(Devices, AreToldWhyThereAreNone) {
  use_module("/no/such/module.so");
  const Outcome outcome = nif({"devices"});
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_NE(outcome.out.find("gpu  not available: the GPU module /no/such/module.so cannot be loaded"),
            std::string::npos)
      << outcome.out;
  const auto result = nlohmann::json::parse(nif({"devices", "--json"}).out);
  EXPECT_EQ(result["backends"][1]["available"], false);
  EXPECT_NE(result["backends"][1]["reason"], "");
  EXPECT_EQ(result["gpus"].size(), 0u);
}

}  // namespace
}  // namespace nif::test
