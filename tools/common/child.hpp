// Runs another process of this program or of another one.
#pragma once

#include <sys/types.h>

#include <optional>
#include <string>
#include <vector>

namespace nif::tools {

/// Runs until it ends, is stopped, or this process ends, however it does. Not thread-safe.
class Child {
 public:
  /// Exit code of a process whose program is not there.
  static constexpr int kNoProgram = 127;

  /// Runs `nif` with these arguments. Throws nif::Error(internal) where there can be no process.
  explicit Child(const std::vector<std::string>& arguments);
  /// Runs a program of the PATH; the first word is its name again.
  Child(const std::vector<std::string>& words, const std::string& program);
  /// Stops it where it still runs.
  ~Child();
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;

  /// Its exit code, once it has ended; 128 plus the number of the signal that ended it.
  std::optional<int> ended();
  /// What it has printed so far, on standard output and standard error.
  std::string out() const { return out_.text(); }
  std::string err() const { return err_.text(); }
  /// Asks it to end, as Ctrl-C does. What it was writing is not there then.
  void stop();

 private:
  void start(const char* program, const std::vector<std::string>& words);

  /// A file that is in memory alone.
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
