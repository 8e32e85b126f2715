// Runs the `nif` executable as a user does: arguments in; exit code, standard output and standard error out.
#pragma once

#include <sys/types.h>

#include <chrono>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "tests/support/temp_dir.hpp"

namespace nif::test {

/// Whether `nif` has sanitizers, which take more memory than a limit leaves.
#ifdef NIF_SANITIZED
inline constexpr bool kSanitized = true;
#else
inline constexpr bool kSanitized = false;
#endif

double seconds_since(std::chrono::steady_clock::time_point start);

struct Outcome {
  int code = -1;  ///< exit code; 128 plus the number of the signal that ended the process
  std::string out, err;
};

/// A started process whose outputs go to files. The destructor ends it if it still runs.
class Process {
 public:
  /// `out` replaces the file for standard output, e.g. "/dev/full".
  Process(const std::filesystem::path& program, const std::vector<std::string>& arguments,
          const std::filesystem::path& out = {});
  ~Process();
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  /// Waits until standard error contains `text`. Returns false if the process ends or a minute passes first.
  bool wait_for_error_text(const std::string& text);
  void send(int signal) const;
  /// Waits for the end. After `seconds` the process is killed and the test fails.
  Outcome finish(double seconds = 600);

 private:
  bool running();

  TempDir folder_;
  std::filesystem::path out_, err_;
  pid_t pid_ = -1;
  int status_ = 0;
};

/// Runs `nif` with these arguments until it ends.
Outcome nif(const std::vector<std::string>& arguments);
/// Path of the executable; `nif-bake` lies beside it.
std::filesystem::path nif_path();

std::vector<std::string> lines_of(const std::string& text);
/// The lines of standard error that do not report progress.
std::vector<std::string> without_progress(const std::string& err);
bool is_progress(const std::string& line);

/// Checks that the "parts" of "bytes" in a JSON report add up exactly to "file" and "resident".
void expect_parts_add_up(const nlohmann::json& bytes);

/// Names of everything in a folder, sorted.
std::vector<std::string> listing(const std::filesystem::path& folder);

}  // namespace nif::test
