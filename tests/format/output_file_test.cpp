// Result files: there as a whole or not at all.
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/file.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <filesystem>
#include <string>
#include <thread>
#include <vector>

#include "formats/base/output_file.hpp"
#include "formats/base/status.hpp"
#include "formats/base/temporaries.hpp"
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
  static std::string error_of(auto&& call) {
    try {
      call();
      return {};
    } catch (const Error& error) {
      EXPECT_EQ(error.status(), Status::output_not_writable);
      return error.what();
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

TEST_F(OutputFile, KeepsThePermissionsOfWhatItReplaces) {
  const auto mode_of = [](const fs::path& file) { return unsigned(fs::status(file).permissions()); };
  for (const unsigned mode : {0600u, 0644u, 0666u, 0640u}) {
    const fs::path target = folder_ / std::to_string(mode);
    write_output(target, bytes("old"));
    fs::permissions(target, fs::perms(mode));
    nif::OutputFile file(target);
    for (const fs::directory_entry& entry : fs::directory_iterator(folder_)) {
      if (entry.path().string().starts_with(target.string())) {
        EXPECT_EQ(mode_of(entry), mode);
      }
    }
    file.write(bytes("new"));
    file.commit();
    EXPECT_EQ(mode_of(target), mode);
  }
}

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
  const std::string name = "/dev/fd/" + std::to_string(ends[1]);  // leads to a name outside of any folder
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

/// Limits the size of this process's files, and ignores the signal, as `nif` does.
class FileSizeLimit {
 public:
  explicit FileSizeLimit(uint64_t bytes) {
    ::getrlimit(RLIMIT_FSIZE, &before_);
    rlimit limit = before_;
    limit.rlim_cur = bytes;
    ::setrlimit(RLIMIT_FSIZE, &limit);
    handler_ = ::signal(SIGXFSZ, SIG_IGN);
  }
  ~FileSizeLimit() {
    ::setrlimit(RLIMIT_FSIZE, &before_);
    ::signal(SIGXFSZ, handler_);
  }
  FileSizeLimit(const FileSizeLimit&) = delete;
  FileSizeLimit& operator=(const FileSizeLimit&) = delete;

 private:
  rlimit before_{};
  void (*handler_)(int);
};

TEST_F(OutputFile, AWriteThatFailsHalfWayLeavesTheOldFile) {
  const fs::path target = folder_ / "out.nif";
  write_output(target, bytes("old"));
  const std::string large(100'000, 'x');
  for (const uint64_t limit : {0u, 1u, 4096u, 99'999u}) {
    const FileSizeLimit limited(limit);
    EXPECT_EQ(error_of([&] { write_output(target, bytes(large)); }),
              target.string() + ": cannot be written: File too large");
    EXPECT_EQ(test::read_bytes(target), "old");
    EXPECT_EQ(files(), std::vector<std::string>{"out.nif"});
  }
  const FileSizeLimit limited(100'000);
  write_output(target, bytes(large));
  EXPECT_EQ(test::read_bytes(target), large);
}

TEST_F(OutputFile, ARenameThatFailsLeavesWhatIsThere) {
  const fs::path target = folder_ / "out.nif";
  EXPECT_EQ(error_of([&] {
              ::nif::OutputFile file(target);
              file.write(bytes("new"));
              fs::create_directory(target);  // by another process, meanwhile
              file.commit();
            }),
            target.string() + ": cannot be written: Is a directory");
  EXPECT_EQ(files(), std::vector<std::string>{"out.nif"});
}

TEST_F(OutputFile, AFolderThatGoesMeanwhileIsAnError) {
  fs::create_directory(folder_ / "a");
  EXPECT_NE(error_of([&] {
              ::nif::OutputFile file(folder_ / "a" / "out.nif");
              file.write(bytes("new"));
              fs::remove_all(folder_ / "a");
              file.commit();
            }),
            "");
  EXPECT_EQ(files(), std::vector<std::string>());
}

/// The name of the temporary file of a target, which must be the only other file.
std::string temporary_of(const fs::path& target) {
  for (const fs::directory_entry& entry : fs::directory_iterator(target.parent_path()))
    if (entry.path() != target) return entry.path();
  return {};
}

TEST_F(OutputFile, WhatAKilledProcessLeavesIsRemovedByTheNext) {
  const fs::path target = folder_ / "out.nif";
  write_output(target, bytes("old"));
  int ready[2];
  ASSERT_EQ(::pipe(ready), 0);
  const pid_t child = ::fork();
  if (child == 0) {
    ::nif::OutputFile file(target);
    file.write(bytes("half"));
    (void)!::write(ready[1], "x", 1);
    for (;;) ::pause();
  }
  char x;
  ASSERT_EQ(::read(ready[0], &x, 1), 1);
  const std::string temporary = temporary_of(target);
  EXPECT_TRUE(temporary.starts_with(target.string() + ".tmp-")) << temporary;

  write_output(target, bytes("while it lives"));  // temporaries of a living process stay
  EXPECT_TRUE(fs::exists(temporary));
  ASSERT_EQ(::kill(child, SIGKILL), 0);
  ASSERT_EQ(::waitpid(child, nullptr, 0), child);
  EXPECT_EQ(test::read_bytes(target), "while it lives");
  EXPECT_TRUE(fs::exists(temporary));
  check_output(target);
  EXPECT_EQ(files(), std::vector<std::string>{"out.nif"});
  ::close(ready[0]);
  ::close(ready[1]);
}

TEST_F(OutputFile, OtherFilesAreNotTakenForLeftOvers) {
  const std::vector<std::string> others{
      "out.nif.tmp-",         "out.nif.tmp-1234567",    "out.nif.tmp-123456789", "out.nif.tmp-1234567g",
      "out.nif.tmp.12345678", "other.nif.tmp-12345678", "out.nif.old-12345678"};
  for (const std::string& name : others) temporary_.write(name, "mine");
  fs::create_directory(folder_ / "out.nif.tmp-12345678");
  fs::create_symlink("other.nif.tmp-12345678", folder_ / "out.nif.tmp-12345679");
  temporary_.write("out.nif.tmp-0123abcd", "left over");
  write_output(folder_ / "out.nif", bytes("new"));
  for (const std::string& name : others) EXPECT_TRUE(fs::exists(folder_ / name)) << name;
  EXPECT_TRUE(fs::exists(folder_ / "out.nif.tmp-12345678"));
  EXPECT_TRUE(fs::is_symlink(folder_ / "out.nif.tmp-12345679"));
  EXPECT_FALSE(fs::exists(folder_ / "out.nif.tmp-0123abcd"));
}

TEST_F(OutputFile, ManyWritersOfOneTargetDoNotDisturbEachOther) {
  const fs::path target = folder_ / "out.nif";
  const auto content = [](int who) { return std::string(50'000 + size_t(who), char('a' + who)); };
  std::atomic<int> failures = 0;
  std::vector<std::thread> writers;
  for (int who = 0; who < 4; ++who)
    writers.emplace_back([&, who] {
      for (int i = 0; i < 50; ++i) {
        try {
          write_output(target, bytes(content(who)));
        } catch (const Error&) {
          ++failures;
        }
        const std::string found = test::read_bytes(target);
        if (found.empty() || found != content(found[0] - 'a')) ++failures;
      }
    });
  for (std::thread& writer : writers) writer.join();
  EXPECT_EQ(failures, 0);
  EXPECT_EQ(files(), std::vector<std::string>{"out.nif"});
}

TEST_F(OutputFile, AHandlerOfSignalsCanRemoveTemporaries) {
  const fs::path target = folder_ / "out.nif";
  write_output(target, bytes("old"));
  const pid_t child = ::fork();
  if (child == 0) {
    ::signal(SIGTERM, [](int) {
      remove_temporaries();
      ::_exit(0);
    });
    ::nif::OutputFile first(target), second(folder_ / "other.nif");
    first.write(bytes("half"));
    ::raise(SIGTERM);
    ::_exit(1);
  }
  int status = 0;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  EXPECT_EQ(status, 0);
  EXPECT_EQ(files(), std::vector<std::string>{"out.nif"});
  EXPECT_EQ(test::read_bytes(target), "old");
}

}  // namespace
}  // namespace nif
