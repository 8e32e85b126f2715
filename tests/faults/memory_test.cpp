// No memory, at the start and at many places of a command: an error that says so, and the old file; or the
// right bytes, where the program can do without. Never a crash, never half a file.
//
// By default each command fails at 12 random allocations, or at the last ones; NIF_EVERY_ALLOCATION=1000 makes it every 1,000th,
// and more of the last.
#include <gtest/gtest.h>

#include <fstream>

#include "formats/base/random.hpp"
#include "formats/base/status.hpp"
#include "tests/cli/mesh_text.hpp"
#include "tests/faults/fault_run.hpp"
#include "tests/support/test_shapes.hpp"

namespace nif::test {
namespace {

namespace fs = std::filesystem;

class NoMemory : public testing::Test {
 protected:
  uint64_t allocations_of(const std::vector<std::string>& arguments) const {
    const fs::path file = folder_.path() / "count";
    EXPECT_EQ(nif_with({{"COUNT", file.string()}}, arguments).code, 0);
    uint64_t count = 0;
    std::ifstream(file) >> count;
    fs::remove(file);
    EXPECT_GT(count, 1000u);
    return count;
  }

  std::vector<uint64_t> places(uint64_t count) const {
    std::vector<uint64_t> numbers;
    if (const char* text = std::getenv("NIF_EVERY_ALLOCATION")) {
      const uint64_t step = std::strtoull(text, nullptr, 10);
      for (uint64_t n = step; n <= count; n += step) numbers.push_back(n);
    } else {
      Random random(18, 52, count);
      for (int i = 0; i < 12; ++i) numbers.push_back(1 + random.below(uint32_t(count)));
    }
    return numbers;
  }

  /// Also at some of the last allocations, when files are opened and written: at each where NIF_EVERY_ALLOCATION is set.
  void expect_clean(const Command& command, uint64_t last = 0) const {
    const std::string old = read_bytes(command.target);
    const uint64_t count = allocations_of(command.arguments);
    const std::string whole = read_bytes(command.target);
    const auto restore = [&] {
      fs::remove(command.target);
      if (!old.empty()) std::ofstream(command.target) << old;
    };
    restore();
    const std::map<std::string, std::string> before = files_in(folder_.path());
    int refused = 0, right = 0;
    std::vector<uint64_t> numbers = places(count);
    for (uint64_t i = 0; i < last; i += std::getenv("NIF_EVERY_ALLOCATION") ? 1 : 6)
      numbers.push_back(count - i);
    for (const uint64_t number : numbers) {
      for (const char* mode : {"once", "on"}) {
        SCOPED_TRACE(command.name + ": allocation " + std::to_string(number) + " " + mode);
        const Outcome outcome =
            nif_with({{"ALLOCATION", std::to_string(number) + " " + mode}}, command.arguments);
        if (outcome.code == 0) {
          ++right;
          EXPECT_TRUE(read_bytes(command.target) == whole);
          restore();
          continue;
        }
        ++refused;
        EXPECT_TRUE(outcome.code == int(Status::out_of_memory) || outcome.code == int(Status::too_large))
            << outcome.code << ": " << outcome.err;
        const std::vector<std::string> lines = without_progress(outcome.err);
        ASSERT_FALSE(lines.empty());
        EXPECT_TRUE(lines.back().find("memory") != std::string::npos) << outcome.err;
        // The last allocations are for the output after the file is written.
        if (fs::exists(command.target) && read_bytes(command.target) == whole) restore();
        EXPECT_TRUE(files_in(folder_.path()) == before);
      }
    }
    std::printf("  %s: %lu allocations; %d times refused, %d times done\n", command.name.c_str(), count,
                refused, right);
    EXPECT_GT(refused, 0);
  }

  const TempDir folder_;
};

TEST_F(NoMemory, Bake) { expect_clean(commands_in(folder_)[0]); }
TEST_F(NoMemory, Attach) { expect_clean(commands_in(folder_)[1]); }
TEST_F(NoMemory, Convert) { expect_clean(commands_in(folder_)[2], 120); }

TEST_F(NoMemory, BakeOfAField) {
  const std::string mesh = folder_.write("torus.obj", obj_text(torus(24, 12)));
  const fs::path asset = folder_.path() / "torus.nif";
  expect_clean({"bake of a field",
                {"bake", mesh, "-o", asset.string(), "--encoding", "segment", "--preset", "fast",
                 "--resolution", "8", "--rays", "1000", "-j", "2"},
                asset});
}

TEST(ClockJumps, ChangeNoByte) {
  const TempDir folder;
  for (const Command& command : commands_in(folder)) {
    EXPECT_EQ(nif(command.arguments).code, 0);
    const std::string whole = read_bytes(command.target);
    fs::remove(command.target);
    const Outcome outcome = nif_with({{"CLOCK", "100000000"}}, command.arguments);  // three years
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    EXPECT_TRUE(read_bytes(command.target) == whole) << command.name;
  }
}

TEST(ClockJumps, ChangeNoManifest) {
  const TempDir folder;
  for (int i = 0; i < 3; ++i) folder.write("m" + std::to_string(i) + ".obj", obj_text(uv_sphere(8 + i, 12)));
  const std::string manifest = folder.write(
      "library.toml", "output = \"{stem}.nif\"\n[defaults]\nrays = 0\n[[asset]]\nmesh = \"*.obj\"\n");
  const std::vector<std::string> words{"bake", "--manifest", manifest};
  for (int run = 0; run < 4; ++run) {
    const Outcome outcome = nif_with({{"CLOCK", "100000000"}}, words);
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    EXPECT_NE(outcome.out.find(run == 0 ? "3 baked, 0 up to date" : "0 baked, 3 up to date"),
              std::string::npos)
        << outcome.out;
  }
  // A change is noticed.
  folder.write("m1.obj", obj_text(cube()));
  const Outcome outcome = nif_with({{"CLOCK", "100000000"}}, words);
  EXPECT_NE(outcome.out.find("1 baked, 2 up to date"), std::string::npos) << outcome.out;
}

}  // namespace
}  // namespace nif::test
