// Runs this program or another one in a child process.
#pragma once

#include <sys/types.h>

#include <optional>
#include <string>
#include <vector>

namespace nif::tools {

/// A process that runs until it ends, is stopped, or this process ends, however that happens. Not
/// thread-safe.
class Child {
 public:
  /// Exit code of a process whose program does not exist.
  static constexpr int kNoProgram = 127;

  /// Runs `nif` with these arguments. Throws nif::Error(internal) if the process cannot be started.
  explicit Child(const std::vector<std::string>& arguments);
  /// Runs a program found on the PATH; the first word is again its name.
  Child(const std::vector<std::string>& words, const std::string& program);
  /// Stops the process if it still runs.
  ~Child();
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;

  /// Once it has ended, its exit code, or 128 plus the number of the signal that killed it.
  std::optional<int> ended();
  /// Everything it has printed so far, on standard output and standard error.
  std::string out() const { return out_.text(); }
  std::string err() const { return err_.text(); }
  /// Asks it to end, as Ctrl-C does. It then removes files that it was writing.
  void stop();

 private:
  void start(const char* program, const std::vector<std::string>& words);

  /// A file that exists only in memory.
  class Output {
   public:
    Output();
    ~Output();
    Output(const Output&) = delete;
    Output& operator=(const Output&) = delete;
    std::string text() const;
    int fd() const { return fd_; }

   private:
    int fd_;
  };

  Output out_, err_;
  pid_t pid_ = -1;
  std::optional<int> code_;
};

}  // namespace nif::tools
