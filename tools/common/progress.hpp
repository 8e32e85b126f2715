// Progress on standard error: a bar that redraws itself on a terminal, otherwise one line per second.
#pragma once

#include <chrono>
#include <string>

namespace nif::tools {

class Progress {
 public:
  explicit Progress(bool quiet);
  ~Progress() { finish(); }
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// Says what is going on; `fraction` of all work is done. Cheap to call often.
  void update(double fraction, const std::string& text);
  /// Removes the bar. Called before anything else is printed.
  void finish();

 private:
  using Clock = std::chrono::steady_clock;
  bool quiet_, terminal_, drawn_ = false;
  Clock::time_point start_, last_{};
};

}  // namespace nif::tools
