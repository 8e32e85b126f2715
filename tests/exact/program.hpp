// What programs that judge for long share: numbers to print, a line in a log, errors and exit codes.
#pragma once

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <initializer_list>
#include <iomanip>
#include <stdexcept>
#include <string>

namespace nif::test {

/// For printf's %llu.
inline unsigned long long to_print(uint64_t n) { return n; }

/// Adds a line to a file, with tabs: the day, then these. Throws std::runtime_error if it cannot be written.
inline void add_to_log(const std::string& path, std::initializer_list<uint64_t> counts) {
  const std::time_t time = std::time(nullptr);
  std::tm day{};
  localtime_r(&time, &day);
  std::ofstream file(path, std::ios::app);
  file << std::put_time(&day, "%F");
  for (const uint64_t count : counts) file << '\t' << count;
  file << '\n';
  if (!file.flush()) throw std::runtime_error(path + " cannot be written");
}

/// A program's arguments: options, and values after them.
class Arguments {
 public:
  Arguments(int argc, char** argv) : count_(argc), values_(argv) {}
  bool more() const { return at_ + 1 < count_; }
  std::string key() { return key_ = values_[++at_]; }
  /// Throws std::invalid_argument if the option has no value.
  const char* value() {
    if (!more()) throw std::invalid_argument(key_ + " wants a value");
    return values_[++at_];
  }
  uint64_t number() { return std::strtoull(value(), nullptr, 10); }

 private:
  const int count_;
  char** const values_;
  int at_ = 0;
  std::string key_;
};

/// Calls run(), which returns the exit code. Errors are printed: 2 for those of the command line, else 1.
template <class Run>
int run_program(const char* name, const Run& run) try {
  return run();
} catch (const std::invalid_argument& error) {
  std::fprintf(stderr, "%s: %s\n", name, error.what());
  return 2;
} catch (const std::exception& error) {
  std::fprintf(stderr, "%s: %s\n", name, error.what());
  return 1;
}

}  // namespace nif::test
