// Progress on standard error: a bar that redraws itself on a terminal, otherwise lines.
#pragma once

#include <chrono>
#include <string>

namespace nif::tools {

/// What is foreseen of the time that work still takes. Time is in seconds since the work began.
class TimeLeft {
 public:
  /// "12 s left", "takes longer", or "" where it is too early to tell. What was foreseen counts down while
  /// the work stands still, and never up: it is corrected upwards only after another tenth of the work.
  std::string text(double seconds, double fraction);

 private:
  bool foreseen_ = false;
  double fraction_ = 0, end_ = 0;  ///< when it was foreseen, and the time of the end
};

/// When progress is shown.
class ProgressPace {
 public:
  enum class Reader {
    terminal,  ///< ten times a second
    log,       ///< at most one line for each tenth of the work, and one a second
    program,   ///< lines, ten times a second
  };
  explicit ProgressPace(Reader reader) : reader_(reader) {}

  /// Whether to show this now. What ends within a second leaves no line, so that what fails at once leaves
  /// nothing but its error.
  bool due(double seconds, double fraction);

 private:
  Reader reader_;
  double next_ = 0;
  int tenth_ = -1;  ///< of the last line
};

/// Lines go to a log, unless NIF_PROGRESS=all is in the environment: then a program reads them.
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
  /// Another job follows, of which nothing is done yet.
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
