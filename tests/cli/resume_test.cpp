// `nif bake --resume`: a killed bake resumes from its checkpoint and gives the same bytes; checkpoints of
// other bakes are refused, and none is left in the end.
#include <gtest/gtest.h>
#include <signal.h>

#include <chrono>
#include <fstream>
#include <thread>

#include "formats/base/status.hpp"
#include "tests/cli/mesh_text.hpp"
#include "tests/cli/program.hpp"
#include "tests/support/test_shapes.hpp"

namespace nif::test {
namespace {

namespace fs = std::filesystem;

class Resume : public testing::Test {
 protected:
  std::string path(const std::string& name) const { return (folder_.path() / name).string(); }
  std::vector<std::string> words(const std::vector<std::string>& more = {}) const {
    std::vector<std::string> words{
        "bake", path("torus.obj"), "-o", path("torus.nif"), "--encoding", "segment", "--preset",
        "fast", "--resolution",    "16", "--rays",          "1000"};
    words.insert(words.end(), more.begin(), more.end());
    return words;
  }
  /// Starts a bake and kills it as soon as there is a checkpoint.
  void kill_at_checkpoint(const std::vector<std::string>& arguments) const {
    Process process(nif_path(), arguments);
    for (int i = 0; i < 20'000 && !fs::exists(checkpoint_); ++i)
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    process.send(SIGKILL);
    ASSERT_EQ(process.finish().code, 128 + SIGKILL);
    ASSERT_TRUE(fs::exists(checkpoint_));
    ASSERT_FALSE(fs::exists(path("torus.nif")));
  }

  const TempDir folder_;
  const fs::path mesh_ = folder_.write("torus.obj", obj_text(torus(40, 20)));
  const fs::path checkpoint_ = path("torus.nif.checkpoint");
};

TEST_F(Resume, GoesOnToTheSameBytes) {
  ASSERT_EQ(nif(words()).code, 0);
  const std::string whole = read_bytes(path("torus.nif"));
  fs::remove(path("torus.nif"));
  EXPECT_FALSE(fs::exists(checkpoint_)) << "it was not so long";
  kill_at_checkpoint(words({"--checkpoint", "0.01", "-j", "1"}));
  const std::string kept = read_bytes(checkpoint_);

  // The checkpoint of another bake is refused and kept.
  const auto refused = [&](const std::vector<std::string>& more, const std::string& why) {
    const Outcome outcome = nif(words(more));
    EXPECT_EQ(outcome.code, int(Status::checkpoint_refused)) << outcome.err;
    EXPECT_NE(outcome.err.find("nif: " + checkpoint_.string() + ": " + why + "; without --resume"),
              std::string::npos)
        << outcome.err;
    EXPECT_FALSE(fs::exists(path("torus.nif")));
  };
  refused({"--resume", "--seed", "2"}, "is of a bake with other options");
  folder_.write("torus.obj", obj_text(torus(41, 20)));
  refused({"--resume"}, "is of a bake of another mesh");
  folder_.write("torus.obj", obj_text(torus(40, 20)));
  EXPECT_TRUE(read_bytes(checkpoint_) == kept);
  std::string damaged = kept;
  damaged[damaged.size() / 2] ^= 1;
  folder_.write("torus.nif.checkpoint", damaged);
  refused({"--resume"}, "is damaged");
  folder_.write("torus.nif.checkpoint", "no such thing");
  refused({"--resume"}, "is not a checkpoint");

  folder_.write("torus.nif.checkpoint", kept);
  const Outcome outcome = nif(words({"--resume", "-j", "2"}));
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_TRUE(read_bytes(path("torus.nif")) == whole);
  EXPECT_FALSE(fs::exists(checkpoint_));
}

TEST_F(Resume, IsOptionalAndStartsAnewWithoutACheckpoint) {
  const std::vector<std::string> quick{"bake", path("torus.obj"), "-o", path("torus.nif"), "--encoding",
                                       "bvh",  "--rays",          "0"};
  std::vector<std::string> resumed = quick;
  resumed.push_back("--resume");
  const Outcome first = nif(resumed);
  EXPECT_EQ(first.code, 0);
  EXPECT_NE(first.err.find("there is no such checkpoint, so the bake starts from the beginning"),
            std::string::npos)
      << first.err;
  folder_.write("torus.nif.checkpoint", "NIFBAKE\nof something");
  const Outcome second = nif(quick);
  EXPECT_EQ(second.code, 0);
  EXPECT_NE(second.err.find("--resume continues from it"), std::string::npos) << second.err;
  EXPECT_FALSE(fs::exists(checkpoint_));
}

TEST_F(Resume, ACheckpointThatCannotBeWrittenEndsNoBake) {
  fs::create_directory(checkpoint_);
  folder_.write("torus.nif.checkpoint/x", "");
  const Outcome outcome = nif(words({"--checkpoint", "0.01"}));
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_NE(outcome.err.find("the bake continues, but cannot be resumed from here"), std::string::npos)
      << outcome.err;
}

TEST_F(Resume, AFileThatIsNoCheckpointIsLeftAlone) {
  folder_.write("torus.nif.checkpoint", "somebody's own");
  const Outcome outcome = nif(words({"--checkpoint", "0.01"}));
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_NE(outcome.err.find("is not a checkpoint, so it is not replaced; the bake continues"),
            std::string::npos)
      << outcome.err;
  EXPECT_EQ(read_bytes(checkpoint_), "somebody's own");
}

TEST_F(Resume, AManifestGoesOnByItself) {
  ASSERT_EQ(nif(words()).code, 0);
  const std::string whole = read_bytes(path("torus.nif"));
  fs::remove(path("torus.nif"));
  const std::string manifest =
      folder_.write("library.toml",
                    "[defaults]\nencoding = \"segment\"\npreset = \"fast\"\nresolution = "
                    "16\nrays = 1000\n[[asset]]\nmesh = \"*.obj\"\n");
  kill_at_checkpoint(words({"--checkpoint", "0.01"}));
  const Outcome resumed = nif({"bake", "--manifest", manifest, "--json"});
  EXPECT_EQ(resumed.code, 0) << resumed.err;
  EXPECT_TRUE(read_bytes(path("torus.nif")) == whole);
  EXPECT_FALSE(fs::exists(checkpoint_));

  // An unusable checkpoint does not prevent a bake.
  fs::remove(path("torus.nif"));
  folder_.write("torus.nif.checkpoint", "NIFBAKE\nof something");
  const Outcome anew = nif({"bake", "--manifest", manifest, "--json"});
  EXPECT_EQ(anew.code, 0) << anew.err;
  EXPECT_NE(anew.out.find("is damaged, so the bake starts from the beginning"), std::string::npos)
      << anew.out;
  EXPECT_TRUE(read_bytes(path("torus.nif")) == whole);
  EXPECT_FALSE(fs::exists(checkpoint_));
}

}  // namespace
}  // namespace nif::test
