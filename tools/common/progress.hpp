// Shows progress on standard error: a bar that redraws itself on a terminal, otherwise lines.
#pragma once

#include <chrono>
#include <string>

namespace nif::tools {

/// Estimates the remaining time. Times are in seconds since the work began.
class TimeLeft {
 public:
  /// "12 s left", "takes longer", or "" if it is too early to tell. The estimate counts down while the work
  /// stands still. It is corrected upwards only after another tenth of the work.
  std::string text(double seconds, double fraction);

 private:
  bool foreseen_ = false;
  double fraction_ = 0, end_ = 0;  ///< fraction and estimated end at the time of the last estimate
};

/// Decides when progress is shown.
class ProgressPace {
 public:
  enum class Reader {
    terminal,  ///< ten times a second
    log,       ///< at most one line per tenth of the work, and one per second
    program,   ///< lines, ten times a second
  };
  explicit ProgressPace(Reader reader) : reader_(reader) {}

  /// Whether to show this now. Work that ends within a second leaves no line, so that an immediate failure
  /// prints nothing but its error.
  bool due(double seconds, double fraction);

 private:
  Reader reader_;
  double next_ = 0;
  int tenth_ = -1;  ///< that the last line was in
};

/// Lines go to a log, unless the environment has NIF_PROGRESS=all: then a program reads them.
class Progress {
 public:
  explicit Progress(bool quiet);
  ~Progress() { finish(); }
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// Shows the current step; `fraction` of all work is done. Cheap enough to call often.
  void update(double fraction, const std::string& text);
  /// Removes the bar. To be called before anything else is printed.
  void finish();
  /// Starts another job, at 0.
  void begin();

 private:
  using Clock = std::chrono::steady_clock;
  bool quiet_, drawn_ = false;
  ProgressPace::Reader reader_;
  Clock::time_point start_;
  ProgressPace pace_;
  TimeLeft left_;
};

}  // namespace nif::tools
