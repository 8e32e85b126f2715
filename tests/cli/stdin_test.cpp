// Meshes that are piped into nif: "-" instead of a file name.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "formats/base/status.hpp"
#include "tests/cli/mesh_text.hpp"
#include "tests/cli/program.hpp"
#include "tests/support/test_shapes.hpp"

namespace nif::test {
namespace {

using nlohmann::json;

class Stdin : public testing::Test {
 protected:
  Stdin() {
    size_t base = 0;
    obj_ = folder_.write("ball.obj", obj_object(icosphere(3), "ball", base)).string();
  }
  std::string path(const std::string& name) const { return (folder_.path() / name).string(); }
  static Outcome shell(const std::string& line) { return Process("/bin/sh", {"-c", line}).finish(); }
  /// Runs nif with a file as standard input, through a pipe.
  static Outcome piped(const std::string& file, const std::string& words) {
    return shell("cat '" + file + "' | '" + nif_path().string() + "' " + words);
  }

  const TempDir folder_;
  std::string obj_;
};

TEST_F(Stdin, IsBakedAndComparedAsTheFileIs) {
  ASSERT_EQ(nif({"bake", obj_, "-o", path("a.nif"), "--encoding", "exact", "--rays", "1000"}).code, 0);
  const Outcome baked = piped(obj_, "bake - --format obj -o '" + path("b.nif") + "' --depfile '" +
                                        path("b.d") + "' --encoding exact --rays 1000 --json");
  ASSERT_EQ(baked.code, 0) << baked.err;
  EXPECT_EQ(json::parse(baked.out)["sources"], json::array());
  EXPECT_EQ(read_bytes(path("a.nif")), read_bytes(path("b.nif")));
  EXPECT_EQ(read_bytes(path("b.d")).find(" -"), std::string::npos);
  EXPECT_EQ(piped(obj_, "eval '" + path("b.nif") + "' --mesh - --format obj --rays 1000").code, 0);
}

TEST_F(Stdin, IsReadByTheVerbsOfMesh) {
  ASSERT_EQ(piped(obj_, "mesh convert - --format obj -o '" + path("c.ply") + "'").code, 0);
  // Formats with a signature need no name, even if compressed.
  ASSERT_EQ(shell("gzip '" + path("c.ply") + "'").code, 0);
  const Outcome info = piped(path("c.ply.gz"), "mesh info - --json");
  ASSERT_EQ(info.code, 0) << info.err;
  EXPECT_EQ(json::parse(info.out)["meshes"][0]["name"], "stdin");
  const Outcome compared = piped(obj_, "mesh compare - --format obj '" + path("c.ply.gz") + "' --rays 0");
  EXPECT_EQ(compared.code, 0) << compared.err;
  for (const std::string verb : {"repair", "decimate --ratio 0.5"}) {
    const Outcome outcome = piped(obj_, "mesh " + verb + " - --format obj -o '" + path("d.off") + "'");
    EXPECT_EQ(outcome.code, 0) << verb << outcome.err;
  }
}

TEST_F(Stdin, IsRefusedWithASentence) {
  const auto refused = [&](const std::string& words, Status status, const std::string& fragment) {
    const Outcome outcome = piped(obj_, words);
    EXPECT_EQ(outcome.code, int(status)) << outcome.err;
    EXPECT_NE(outcome.err.find(fragment), std::string::npos) << outcome.err;
  };
  refused("mesh info -", Status::not_a_mesh, "standard input: does not reveal its format by its content");
  refused("mesh info - --format ply", Status::not_a_mesh, "standard input: ");
  refused("mesh info - --format dxf", Status::usage, "--format");
  refused("bake - --format obj", Status::usage, "--output is required");
  refused("mesh compare - -", Status::usage, "only one of the two");
  EXPECT_EQ(nif({"mesh", "info", "-", "--format", "obj"}).code, int(Status::file_empty));
}

TEST_F(Stdin, FormatOptionsOverrideNames) {
  const std::string misnamed = folder_.write("ball.dat", read_bytes(obj_)).string();
  EXPECT_EQ(nif({"mesh", "info", misnamed}).code, int(Status::not_a_mesh));
  EXPECT_EQ(nif({"mesh", "info", misnamed, "--format", "obj"}).code, 0);
}

}  // namespace
}  // namespace nif::test
