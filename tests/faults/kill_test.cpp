// `nif` killed at random moments: the target is the old file or the whole new one, what was finished stays,
// and the next run removes what was left behind. NIF_KILLS says how many kills of each command (20).
#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <spawn.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <thread>

#include "formats/base/random.hpp"
#include "formats/base/status.hpp"
#include "tests/cli/mesh_text.hpp"
#include "tests/faults/fault_run.hpp"
#include "tests/support/test_shapes.hpp"

namespace nif::test {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

int kills() {
  const char* text = std::getenv("NIF_KILLS");
  return text ? std::atoi(text) : 20;
}

/// Runs `nif` and kills it after this many seconds, with or without its child processes. Returns after all of
/// them have ended: true if the kill came in time.
bool run_and_kill(const std::vector<std::string>& arguments, double seconds, bool all) {
  ::prctl(PR_SET_CHILD_SUBREAPER, 1);
  std::vector<std::string> words{nif_path().string()};
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  for (const int fd : {1, 2}) posix_spawn_file_actions_addopen(&actions, fd, "/dev/null", O_WRONLY, 0);
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP);
  pid_t pid = -1;
  const auto start = Clock::now();
  EXPECT_EQ(posix_spawn(&pid, argv[0], &actions, &attributes, argv.data(), environ), 0);
  posix_spawn_file_actions_destroy(&actions);
  posix_spawnattr_destroy(&attributes);
  std::this_thread::sleep_until(
      start + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds)));
  ::kill(all ? -pid : pid, SIGKILL);
  bool killed = false;
  int status = 0;
  for (pid_t ended; (ended = ::waitpid(-1, &status, 0)) > 0;)
    if (ended == pid) killed = WIFSIGNALED(status);
  return killed;
}

double duration_of(const std::vector<std::string>& arguments) {
  std::array<double, 3> seconds{};
  for (double& each : seconds) {
    const auto start = Clock::now();
    EXPECT_EQ(nif(arguments).code, 0);
    each = seconds_since(start);
  }
  std::sort(seconds.begin(), seconds.end());
  return seconds[1];
}

/// A summary of the kills, for people.
struct Tally {
  int old_file = 0, new_file = 0, left_over = 0;
  ~Tally() {
    std::printf(
        "  killed: %d times the old file stayed, %d times the new one was there, %d left a temporary file\n",
        old_file, new_file, left_over);
  }
};

class Kill : public testing::Test {
 protected:
  /// A moment during a run, or near its end, where it writes.
  double moment(double duration) {
    return duration * (random_.below(2) ? random_.uniform(0, 1.1) : random_.uniform(0.7, 1.4));
  }

  void kill_command(size_t which) {
    const Command command = commands_in(folder_)[which];
    const std::string old = read_bytes(command.target);
    const double duration = duration_of(command.arguments);
    const std::string whole = read_bytes(command.target);
    ASSERT_NE(whole, old);
    const auto restore = [&] {
      fs::remove(command.target);
      std::ofstream(command.target) << old;
    };
    restore();
    const std::map<std::string, std::string> before = files_in(folder_.path());
    Tally tally;
    for (int i = 0; i < kills(); ++i) {
      run_and_kill(command.arguments, moment(duration), true);
      for (const auto& [name, bytes] : files_in(folder_.path())) {
        if (name == command.target.filename()) {
          ASSERT_TRUE(bytes == old || bytes == whole) << "half a file after kill " << i;
          ++(bytes == old ? tally.old_file : tally.new_file);
        } else if (!before.contains(name)) {
          ASSERT_TRUE(is_temporary(name)) << name;
          ++tally.left_over;
        } else {
          ASSERT_TRUE(bytes == before.at(name)) << name << " has changed";
        }
      }
      restore();
    }
    ASSERT_EQ(nif(command.arguments).code, 0);
    EXPECT_TRUE(read_bytes(command.target) == whole);
    EXPECT_EQ(files_in(folder_.path()).size(), before.size()) << "something was left behind";
  }

  const TempDir folder_;
  Random random_{18, 5, uint64_t(kills())};
};

TEST_F(Kill, Bake) { kill_command(0); }
TEST_F(Kill, Attach) { kill_command(1); }
TEST_F(Kill, Convert) { kill_command(2); }

TEST_F(Kill, Manifest) {
  constexpr int kAssets = 4;
  for (int i = 0; i < kAssets; ++i)
    folder_.write("m" + std::to_string(i) + ".obj", obj_text(uv_sphere(10 + i, 20)));
  const std::string manifest = folder_.write("library.toml",
                                             "output = \"out/{stem}.nif\"\n[defaults]\nrays = 0\n"
                                             "encoding = \"bvh\"\n[[asset]]\nmesh = \"*.obj\"\n");
  const std::vector<std::string> arguments{"bake", "--manifest", manifest, "-j", "2"};
  const auto forget = [&] {
    fs::remove_all(folder_.path() / "out");
    fs::remove_all(folder_.path() / ".nif-batch");
  };
  const auto start = Clock::now();
  ASSERT_EQ(nif(arguments).code, 0);
  const double duration = seconds_since(start);
  const std::map<std::string, std::string> whole = files_in(folder_.path() / "out");
  ASSERT_EQ(whole.size(), size_t(kAssets));
  forget();
  std::map<std::string, std::string> finished;  // assets and records
  Tally tally;
  for (int i = 0; i < kills(); ++i) {
    run_and_kill(arguments, moment(duration), i % 2 == 0);
    const auto files = files_in(folder_.path());
    for (const auto& [name, bytes] : files) {
      const std::string asset = fs::path(name).filename();
      if (is_temporary(name)) {
        ++tally.left_over;
      } else if (name.starts_with("out/")) {
        ASSERT_TRUE(whole.contains(asset) && bytes == whole.at(asset)) << name << " after kill " << i;
      }
    }
    for (const auto& [name, bytes] : finished)
      ASSERT_TRUE(files.contains(name)) << name << " was finished, and is lost after kill " << i;
    size_t records = 0;
    finished.clear();
    for (const auto& [name, bytes] : files)
      if (!is_temporary(name) && (name.starts_with("out/") || name.starts_with(".nif-batch/"))) {
        finished[name] = bytes;
        records += name.ends_with(".json");
      }
    ++(records == size_t(kAssets) ? tally.new_file : tally.old_file);
    // Sometimes the batch continues where it was; otherwise it starts anew.
    if (records == size_t(kAssets) || i % 4 == 3) {
      ASSERT_EQ(nif(arguments).code, 0);
      ASSERT_TRUE(files_in(folder_.path() / "out") == whole) << "after kill " << i;
      for (const auto& [name, bytes] : files_in(folder_.path())) ASSERT_FALSE(is_temporary(name)) << name;
      forget();
      finished.clear();
    }
  }
}

TEST_F(Kill, ResumedBake) {
  const std::string mesh = folder_.write("torus.obj", obj_text(torus(40, 20))),
                    asset = (folder_.path() / "torus.nif").string();
  std::vector<std::string> arguments{"bake",    mesh,       "-o",           asset,          "--encoding",
                                     "segment", "--preset", "fast",         "--resolution", "16",
                                     "--rays",  "1000",     "--checkpoint", "0.001"};
  const double duration = duration_of(arguments);
  const std::string whole = read_bytes(asset);
  EXPECT_EQ(listing(folder_.path()), (std::vector<std::string>{"torus.nif", "torus.obj"}));
  arguments.push_back("--resume");
  const std::vector<std::string> more{"-j1", "-j2"};
  int resumed = 0, lives = 0;
  Tally tally;
  for (int i = 0; i < kills(); ++i) {
    std::vector<std::string> words = arguments;
    words.push_back(more[random_.below(2)]);
    // Kills after a short time, so that a bake needs several runs.
    fs::remove(asset);
    const bool killed = run_and_kill(words, duration * random_.uniform(0.3, 1.1), true);
    ++lives;
    if (fs::exists(asset)) {
      ASSERT_TRUE(read_bytes(asset) == whole) << "after " << lives << " lives";
      resumed += lives > 1;
      ++tally.new_file;
      if (!killed) {
        EXPECT_FALSE(fs::exists(asset + ".checkpoint"));
      }
      fs::remove(asset + ".checkpoint");
      lives = 0;
    } else {
      ++tally.old_file;
    }
    for (const std::string& name : listing(folder_.path())) tally.left_over += is_temporary(name);
  }
  const Outcome outcome = nif(arguments);
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_TRUE(read_bytes(asset) == whole);
  EXPECT_EQ(listing(folder_.path()), (std::vector<std::string>{"torus.nif", "torus.obj"}));
  std::printf("  %d bakes were finished by a resumed one\n", resumed);
  EXPECT_GE(resumed, kills() / 20);
}

}  // namespace
}  // namespace nif::test
