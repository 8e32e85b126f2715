// Result files: there as a whole or not at all.
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <string>
#include <vector>

#include "formats/base/output_file.hpp"
#include "formats/base/status.hpp"
#include "tests/support/temp_dir.hpp"

namespace nif {
namespace {

namespace fs = std::filesystem;

class OutputFile : public testing::Test {
 protected:
  static Status status_of(auto&& call) {
    try {
      call();
      return Status::ok;
    } catch (const Error& error) {
      return error.status();
    }
  }
  static std::span<const std::byte> bytes(std::string_view text) { return std::as_bytes(std::span(text)); }
  std::vector<std::string> files() const {
    std::vector<std::string> names;
    for (const fs::directory_entry& entry : fs::directory_iterator(folder_))
      names.push_back(entry.path().filename());
    return names;
  }

  const test::TempDir temporary_;
  const fs::path folder_ = temporary_.path();
};

TEST_F(OutputFile, WritesAndReplaces) {
  const fs::path target = folder_ / "out.nif";
  check_output(target);
  EXPECT_EQ(files(), std::vector<std::string>());
  write_output(target, bytes("one"));
  EXPECT_EQ(test::read_bytes(target), "one");
  check_output(target);
  EXPECT_EQ(test::read_bytes(target), "one");
  write_output(target, bytes(""));
  EXPECT_EQ(test::read_bytes(target), "");
  EXPECT_EQ(files(), std::vector<std::string>{"out.nif"});
}

TEST_F(OutputFile, RelativePath) {
  const fs::path before = fs::current_path();
  fs::current_path(folder_);
  write_output("plain.nif", bytes("here"));
  fs::current_path(before);
  EXPECT_EQ(test::read_bytes(folder_ / "plain.nif"), "here");
}

TEST_F(OutputFile, FollowsLinks) {
  write_output(folder_ / "real", bytes("old"));
  fs::create_symlink("real", folder_ / "link");
  write_output(folder_ / "link", bytes("new"));
  EXPECT_TRUE(fs::is_symlink(folder_ / "link"));
  EXPECT_EQ(test::read_bytes(folder_ / "real"), "new");
}

TEST_F(OutputFile, RefusesByName) {
  const fs::path missing = folder_ / "no" / "out.nif";
  EXPECT_EQ(status_of([&] { check_output(missing); }), Status::output_folder_missing);
  EXPECT_EQ(status_of([&] { write_output(missing, bytes("x")); }), Status::output_folder_missing);
  EXPECT_EQ(status_of([&] { check_output(folder_); }), Status::output_not_writable);
  EXPECT_EQ(status_of([&] { check_output(folder_.string() + "/"); }), Status::output_not_writable);
  EXPECT_EQ(status_of([&] { check_output(""); }), Status::output_not_writable);
  write_output(folder_ / "file", bytes("x"));
  EXPECT_EQ(status_of([&] { check_output(folder_ / "file" / "out.nif"); }), Status::output_not_writable);
  EXPECT_EQ(status_of([&] { check_output(folder_ / std::string(300, 'x')); }), Status::output_not_writable);
}

TEST_F(OutputFile, RefusesFolderThatTakesNoFiles) {
  if (!fs::is_directory("/proc/self")) GTEST_SKIP() << "no /proc here";  // not even root may write there
  EXPECT_EQ(status_of([] { check_output("/proc/self/out.nif"); }), Status::output_not_writable);
  EXPECT_EQ(status_of([] { write_output("/proc/self/out.nif", bytes("x")); }), Status::output_not_writable);
}

TEST_F(OutputFile, InPiecesIsThereOnceCommitted) {
  const fs::path target = folder_ / "out.nif";
  write_output(target, bytes("old"));
  {
    ::nif::OutputFile file(target);
    file.write(bytes("one "));
    file.write(bytes(""));
    file.write(bytes("two"));
    EXPECT_EQ(files().size(), 2u);
    EXPECT_EQ(test::read_bytes(target), "old");
    file.commit();
  }
  EXPECT_EQ(test::read_bytes(target), "one two");
  EXPECT_EQ(files(), std::vector<std::string>{"out.nif"});
}

TEST_F(OutputFile, NotCommittedLeavesNothing) {
  { ::nif::OutputFile(folder_ / "out.nif").write(bytes("half")); }
  EXPECT_EQ(files(), std::vector<std::string>());
}

TEST_F(OutputFile, PipesAreWrittenToByAnyName) {
  int ends[2];
  ASSERT_EQ(::pipe(ends), 0);
  const std::string name = "/dev/fd/" + std::to_string(ends[1]);  // leads to a name that no folder has
  if (fs::exists(name)) {
    check_output(name);
    write_output(name, bytes("through"));
    char read[8] = {};
    EXPECT_EQ(::read(ends[0], read, sizeof(read)), 7);
    EXPECT_STREQ(read, "through");
  }
  ::close(ends[0]);
  ::close(ends[1]);
}

TEST_F(OutputFile, LeavesDevicesAlone) {
  check_output("/dev/null");
  write_output("/dev/null", bytes("gone"));
  EXPECT_TRUE(fs::is_character_file("/dev/null"));
}

TEST_F(OutputFile, FullDiskLeavesNothing) {
  if (!fs::exists("/dev/full")) GTEST_SKIP() << "no /dev/full here";
  EXPECT_EQ(status_of([&] { write_output("/dev/full", bytes("x")); }), Status::output_not_writable);
}

}  // namespace
}  // namespace nif
