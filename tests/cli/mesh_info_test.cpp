// `nif mesh info`: what it reports, as text and as JSON, and what it refuses.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "formats/base/status.hpp"
#include "tests/cli/mesh_text.hpp"
#include "tests/cli/program.hpp"
#include "tests/support/test_shapes.hpp"

namespace nif::test {
namespace {

using nlohmann::json;

class MeshInfo : public testing::Test {
 protected:
  static Outcome info(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), {"mesh", "info"});
    return nif(arguments);
  }
  /// Two objects: a closed ring and an open bowl.
  std::string two_objects() const {
    size_t base = 0;
    std::string text = obj_object(torus(16, 8), "ring", base);
    text += obj_object(open_bowl(4, 8), "bowl", base);
    return folder_.write("two.obj", text).string();
  }
  static bool has_cgal() { return nif({"--version"}).out.find("GPL-3.0-or-later") != std::string::npos; }

  const TempDir folder_;
};

TEST_F(MeshInfo, PrintsJson) {
  const Outcome outcome = info({two_objects(), "--json"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_EQ(outcome.err, "");
  const json found = json::parse(outcome.out);
  EXPECT_EQ(found["schema"], "nifkit.mesh-info/1");
  EXPECT_EQ(found["instances"], 2);
  EXPECT_EQ(found["components"], 2);
  EXPECT_EQ(found["closed_components"], 1);
  EXPECT_EQ(found["boundary_loops"], 1);
  EXPECT_EQ(found["boundary_edges"], 8);
  ASSERT_EQ(found["meshes"].size(), 2u);
  EXPECT_EQ(found["meshes"][0]["name"], "ring");
  EXPECT_EQ(found["meshes"][0]["triangles"], 256);
  EXPECT_EQ(found["meshes"][0]["largest_components"][0]["genus"], 1);
  EXPECT_EQ(found["meshes"][1]["largest_components"][0]["genus"], nullptr);
  if (has_cgal()) {
    EXPECT_EQ(found["self_intersections"]["pairs"], 0);
  } else {
    EXPECT_EQ(found["self_intersections"], nullptr);
  }
  EXPECT_EQ(json::parse(info({two_objects(), "--json", "--self-intersections", "off", "-j", "1"})
                            .out)["self_intersections"],
            nullptr);
}

TEST_F(MeshInfo, PrintsText) {
  const Outcome outcome = info({two_objects()});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  for (const char* text : {"2 meshes", "8 edges in 1 loop", "2: 1 closed, 1 open", "'bowl'", "0 vertices"})
    EXPECT_NE(outcome.out.find(text), std::string::npos) << "'" << text << "' in: " << outcome.out;
}

TEST_F(MeshInfo, AcceptsAnyTriangleSoup) {
  const std::string flat =
      folder_.write("flat.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\nf 1 1 2\n").string();
  const Outcome outcome = info({flat, "--json"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_EQ(json::parse(outcome.out)["degenerate"], 2);
}

TEST_F(MeshInfo, RefusesByName) {
  const std::string none = (folder_.path() / "none.ply").string();
  EXPECT_EQ(info({none}).code, int(Status::file_not_found));
  const Outcome empty = info({folder_.write("empty.ply", "").string()});
  EXPECT_EQ(empty.code, int(Status::file_empty));
  EXPECT_EQ(lines_of(empty.err).size(), 1u) << empty.err;
  const Outcome unknown = info({two_objects(), "--self-intersections", "perhaps"});
  EXPECT_EQ(unknown.code, int(Status::usage));
  EXPECT_NE(unknown.err.find("--self-intersections"), std::string::npos) << unknown.err;
  if (has_cgal()) return;
  const Outcome lacking = info({two_objects(), "--self-intersections", "on"});
  EXPECT_EQ(lacking.code, int(Status::usage));
  EXPECT_NE(lacking.err.find("CGAL"), std::string::npos) << lacking.err;
}

TEST_F(MeshInfo, RefusesWhatDoesNotFitIntoMemory) {
  if (kSanitized) GTEST_SKIP() << "sanitizers do not work where memory is limited";
  // A sparse file, far larger than the program's memory limit.
  const std::string file = folder_.write("huge.ply", "ply\n").string();
  std::filesystem::resize_file(file, uint64_t{3} << 30);
  const Outcome outcome =
      Process("/bin/sh", {"-c", R"(ulimit -v 4000000; exec "$0" mesh info "$1")", nif_path().string(), file})
          .finish();
  EXPECT_EQ(outcome.code, int(Status::too_large)) << outcome.err;
  EXPECT_NE(outcome.err.find("huge.ply: reading it takes about 6.0 GiB"), std::string::npos) << outcome.err;
}

}  // namespace
}  // namespace nif::test
