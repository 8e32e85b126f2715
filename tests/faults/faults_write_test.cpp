// Disks that are full or broken, folders that take no files: a sentence that names the file, an exit code,
// and the old file.
#include <gtest/gtest.h>
#include <sys/mount.h>
#include <unistd.h>

#include <array>
#include <cstring>
#include <span>

#include "formats/base/status.hpp"
#include "tests/cli/mesh_text.hpp"
#include "tests/faults/fault_run.hpp"
#include "tests/support/test_shapes.hpp"

namespace nif::test {
namespace {

namespace fs = std::filesystem;

/// The output of the commands without faults.
std::map<std::string, std::string> results_of(const std::vector<Command>& commands) {
  std::map<std::string, std::string> results;
  for (const Command& command : commands) {
    const std::string old = read_bytes(command.target);
    EXPECT_EQ(nif(command.arguments).code, 0);
    results[command.name] = read_bytes(command.target);
    EXPECT_NE(results[command.name], old);
    fs::remove(command.target);
    std::ofstream(command.target) << old;
  }
  return results;
}

struct Fault {
  const char* call;
  int error;
};
constexpr Fault kFaults[] = {{"open", ENOSPC},  {"open", EDQUOT}, {"write", ENOSPC}, {"write", EIO},
                             {"fsync", ENOSPC}, {"fsync", EIO},   {"close", EIO},    {"rename", EACCES}};

void expect_failed_writes_to_say_so(std::span<const size_t> which) {
  const TempDir folder;
  const std::vector<Command> commands = commands_in(folder);
  std::map<std::string, std::string> results = results_of(commands);
  for (const size_t number_of_command : which) {
    const Command& command = commands[number_of_command];
    for (const Fault& fault : kFaults) {
      SCOPED_TRACE(command.name + ": " + fault.call + ": " + std::strerror(fault.error));
      const std::map<std::string, std::string> before = files_in(folder.path());
      int failed = 0;
      // The first call may be the check, before the work, that the file can be written.
      for (int number = 1; number <= 3; ++number) {
        const Outcome outcome = nif_with({{"FILE", std::string(fault.call) + " " + std::to_string(number) +
                                                       " " + std::to_string(fault.error)}},
                                         command.arguments);
        if (outcome.code == 0) {
          EXPECT_TRUE(read_bytes(command.target) == results[command.name]);
          fs::remove(command.target);
          std::ofstream(command.target) << before.at(command.target.filename());
          continue;
        }
        ++failed;
        EXPECT_EQ(outcome.code, int(Status::output_not_writable)) << outcome.err;
        const std::vector<std::string> lines = without_progress(outcome.err);
        ASSERT_EQ(lines.size(), 1u) << outcome.err;
        EXPECT_EQ(lines[0],
                  "nif: " + command.target.string() + ": cannot be written: " + std::strerror(fault.error));
        EXPECT_TRUE(files_in(folder.path()) == before);
      }
      EXPECT_GE(failed, 1);
    }
  }
}

TEST(WriteFaults, LeaveTheOldFileAndSaySo) { expect_failed_writes_to_say_so(std::array<size_t, 1>{2}); }
TEST(WriteFaults, OfBakeAndAttachLeaveTheOldFile) {
  expect_failed_writes_to_say_so(std::array<size_t, 2>{0, 1});
}

void expect_kills_to_leave_old_or_new(std::span<const size_t> which) {
  const TempDir folder;
  const std::vector<Command> commands = commands_in(folder);
  std::map<std::string, std::string> results = results_of(commands);
  for (const size_t number_of_command : which) {
    const Command& command = commands[number_of_command];
    for (const char* call : {"open", "write", "fsync", "close", "rename"}) {
      SCOPED_TRACE(command.name + ": " + call);
      int killed = 0;
      for (int number = 1; number <= 3; ++number) {
        const std::map<std::string, std::string> before = files_in(folder.path());
        const Outcome outcome = nif_with(
            {{"FILE", std::string(call) + " " + std::to_string(number) + " kill"}}, command.arguments);
        killed += outcome.code != 0;
        for (const auto& [name, bytes] : files_in(folder.path())) {
          if (name == command.target.filename()) {
            EXPECT_TRUE(bytes == before.at(name) || bytes == results[command.name]);
          } else {
            EXPECT_TRUE(is_temporary(name) || bytes == before.at(name)) << name;
          }
        }
        // The next run succeeds and removes leftovers.
        EXPECT_EQ(nif(command.arguments).code, 0);
        EXPECT_TRUE(read_bytes(command.target) == results[command.name]);
        for (const std::string& name : listing(folder.path())) EXPECT_FALSE(is_temporary(name)) << name;
        fs::remove(command.target);
        std::ofstream(command.target) << before.at(command.target.filename());
      }
      EXPECT_GE(killed, 1);
    }
  }
}

TEST(WriteFaults, KilledAtAnyCallOfAWriteTheTargetIsOldOrNew) {
  expect_kills_to_leave_old_or_new(std::array<size_t, 1>{2});
}
TEST(WriteFaults, KillsOfBakeAndAttachLeaveOldOrNew) {
  expect_kills_to_leave_old_or_new(std::array<size_t, 2>{0, 1});
}

TEST(WriteFaults, ALimitOnTheSizeOfFilesIsAWriteError) {
  const TempDir folder;
  for (const Command& command : commands_in(folder)) {
    const std::map<std::string, std::string> before = files_in(folder.path());
    std::vector<std::string> words{"-c", "ulimit -f 2; exec \"$@\"", "sh", nif_path()};
    words.insert(words.end(), command.arguments.begin(), command.arguments.end());
    const Outcome outcome = Process("/bin/sh", words).finish();
    EXPECT_EQ(outcome.code, int(Status::output_not_writable)) << command.name << ": " << outcome.err;
    EXPECT_NE(outcome.err.find(command.target.string() + ": cannot be written: File too large"),
              std::string::npos)
        << outcome.err;
    EXPECT_TRUE(files_in(folder.path()) == before) << command.name;
  }
}

TEST(WriteFaults, ADiskThatIsReallyFull) {
  const TempDir folder, disk;
  if (::mount("tmpfs", disk.path().c_str(), "tmpfs", 0, "size=12k") != 0)
    GTEST_SKIP() << "no file system can be mounted here";
  std::ofstream(disk.path() / "out.ply") << "the old file";
  folder.write("ball.obj", obj_text(icosphere(3)));
  const Outcome outcome = nif(
      {"mesh", "convert", (folder.path() / "ball.obj").string(), "-o", (disk.path() / "out.ply").string()});
  EXPECT_EQ(outcome.code, int(Status::output_not_writable)) << outcome.err;
  EXPECT_NE(outcome.err.find("out.ply: cannot be written: No space left on device"), std::string::npos)
      << outcome.err;
  EXPECT_EQ(files_in(disk.path()), (std::map<std::string, std::string>{{"out.ply", "the old file"}}));
  EXPECT_EQ(::umount(disk.path().c_str()), 0);
}

TEST(WriteFaults, DevicesThatTakeNothing) {
  const TempDir folder;
  for (Command command : commands_in(folder)) {
    fs::remove(command.target);
    fs::create_symlink("/dev/full", command.target);
    const Outcome outcome = nif(command.arguments);
    EXPECT_EQ(outcome.code, int(Status::output_not_writable)) << command.name << ": " << outcome.err;
    EXPECT_NE(outcome.err.find("No space left on device"), std::string::npos) << outcome.err;
    EXPECT_TRUE(fs::is_symlink(command.target));
  }
}

TEST(WriteFaults, AFolderThatTakesNoFiles) {
  const TempDir folder;
  const std::vector<Command> commands = commands_in(folder);
  ASSERT_EQ(::chmod(folder.path().c_str(), 0555), 0);
  // Root may write anywhere, so the test becomes user nobody.
  std::vector<std::string> nobody{"--reuid=65534", "--regid=65534", "--clear-groups", nif_path()};
  if (::geteuid() == 0) {
    nobody.push_back("--version");
    if (Process("/usr/bin/setpriv", nobody).finish().code != 0)
      GTEST_SKIP() << "root may write anywhere, and nobody may not run the program";
    nobody.pop_back();
  }
  for (const Command& command : commands) {
    std::vector<std::string> words = nobody;
    words.insert(words.end(), command.arguments.begin(), command.arguments.end());
    const Outcome outcome =
        ::geteuid() == 0 ? Process("/usr/bin/setpriv", words).finish() : nif(command.arguments);
    EXPECT_EQ(outcome.code, int(Status::output_not_writable)) << command.name << ": " << outcome.err;
    EXPECT_EQ(read_bytes(command.target), "the old file");
  }
  ASSERT_EQ(::chmod(folder.path().c_str(), 0755), 0);
}

/// A manifest of three meshes, one of them already baked.
class ManifestFaults : public testing::Test {
 protected:
  ManifestFaults() {
    folder_.write("a.obj", obj_text(icosphere(2)));
    run();
    finished_ = read_bytes(folder_.path() / "a.nif");
    folder_.write("b.obj", obj_text(cube()));
    folder_.write("c.obj", obj_text(torus(12, 8)));
  }
  std::vector<std::string> words() const {
    return {"bake", "--manifest", (folder_.path() / "library.toml").string(), "-j", "1", "--keep-going"};
  }
  void run() const { EXPECT_EQ(nif(words()).code, 0); }
  /// Whatever the faults, all files are whole: the finished asset is unchanged, and a run without faults
  /// bakes the others and cleans up.
  void expect_whole() const {
    EXPECT_EQ(read_bytes(folder_.path() / "a.nif"), finished_);
    run();
    const std::vector<std::string> names = listing(folder_.path());
    EXPECT_EQ(names, (std::vector<std::string>{".nif-batch", "a.nif", "a.obj", "b.nif", "b.obj", "c.nif",
                                               "c.obj", "library.toml"}));
    for (const std::string& name : listing(folder_.path() / ".nif-batch"))
      EXPECT_FALSE(is_temporary(name)) << name;
    for (const char* name : {"a.nif", "b.nif", "c.nif"})
      EXPECT_EQ(nif({"info", (folder_.path() / name).string()}).code, 0);
  }
  void forget() const {
    for (const char* name : {"b.nif", "c.nif"}) fs::remove(folder_.path() / name);
  }

  const TempDir folder_;
  const fs::path manifest_ = folder_.write(
      "library.toml",
      "output = \"{stem}.nif\"\n[defaults]\nrays = 0\nencoding = \"bvh\"\n[[asset]]\nmesh = \"*.obj\"\n");
  std::string finished_;
};

TEST_F(ManifestFaults, FailedWritesLoseNothing) {
  for (const Fault& fault : kFaults) {
    for (int number = 1; number <= 2; ++number) {
      SCOPED_TRACE(std::string(fault.call) + " " + std::to_string(number) + ": " +
                   std::strerror(fault.error));
      forget();
      const Outcome outcome = nif_with({{"FILE", std::string(fault.call) + " " + std::to_string(number) +
                                                     " " + std::to_string(fault.error)}},
                                       words());
      EXPECT_TRUE(outcome.code == 0 || outcome.code == int(Status::output_not_writable)) << outcome.err;
      if (outcome.code != 0) {
        EXPECT_NE(outcome.err.find(std::string("cannot be written: ") + std::strerror(fault.error)),
                  std::string::npos)
            << outcome.err;
      }
      expect_whole();
    }
  }
}

TEST_F(ManifestFaults, KillsLoseNothing) {
  for (const char* call : {"open", "write", "fsync", "close", "rename"}) {
    for (int number = 1; number <= 2; ++number) {
      SCOPED_TRACE(std::string(call) + " " + std::to_string(number));
      forget();
      nif_with({{"FILE", std::string(call) + " " + std::to_string(number) + " kill"}}, words());
      expect_whole();
    }
  }
}

}  // namespace
}  // namespace nif::test
