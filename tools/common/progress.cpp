// Extrapolates the time left from the fraction done. A bar wider than the terminal is cut, because a
// line that wraps cannot be redrawn.
#include "tools/common/progress.hpp"

#include <fmt/format.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <string_view>

#include "formats/base/printable.hpp"

namespace nif::tools {
namespace {

std::string format_duration(double seconds) {
  const auto whole = static_cast<long>(seconds + 0.5);
  if (whole < 60) return fmt::format("{} s", whole);
  if (whole < 3600) return fmt::format("{}:{:02} min", whole / 60, whole % 60);
  return fmt::format("{}:{:02} h", whole / 3600, whole / 60 % 60);
}

ProgressPace::Reader reader_of_standard_error() {
  if (isatty(STDERR_FILENO) == 1) return ProgressPace::Reader::terminal;
  const char* asked = std::getenv("NIF_PROGRESS");
  return asked && std::string_view(asked) == "all" ? ProgressPace::Reader::program
                                                   : ProgressPace::Reader::log;
}

}  // namespace

std::string TimeLeft::text(double seconds, double fraction) {
  constexpr double kEnough = 0.04;  // earlier, there is too little to extrapolate from
  if (fraction > kEnough) {
    const double end = seconds / fraction;
    const bool corrected = std::abs(fraction - fraction_) >= 0.1 - 1e-9;
    if (!foreseen_ || end <= end_ || corrected) {
      foreseen_ = true;
      fraction_ = fraction;
      end_ = end;
    }
  }
  if (!foreseen_) return "";
  const double left = end_ - seconds;
  return left < 0 && fraction < 1 ? "takes longer" : format_duration(std::max(left, 0.0)) + " left";
}

bool ProgressPace::due(double seconds, double fraction) {
  const int tenth = int(fraction * 10 + 1e-9);
  if (reader_ != Reader::terminal && seconds < 1) return false;
  if (seconds < next_ || (reader_ == Reader::log && tenth <= tenth_)) return false;
  next_ = seconds + (reader_ == Reader::log ? 1 : 0.1);
  tenth_ = tenth;
  return true;
}

Progress::Progress(bool quiet)
    : quiet_(quiet), reader_(reader_of_standard_error()), start_(Clock::now()), pace_(reader_) {}

void Progress::update(double fraction, const std::string& text) {
  if (quiet_) return;
  const double seconds = std::chrono::duration<double>(Clock::now() - start_).count();
  fraction = std::clamp(fraction, 0.0, 1.0);
  if (!pace_.due(seconds, fraction)) return;
  // Programs that show progress parse lines of this form.
  const std::string line =
      fmt::format("{:3.0f} %  {:<15}{}", fraction * 100, left_.text(seconds, fraction), printable(text));
  if (reader_ != ProgressPace::Reader::terminal) {
    fmt::print(stderr, "{}\n", line);
    return;
  }
  constexpr int kBar = 24;
  const int filled = int(fraction * kBar);
  std::string bar = fmt::format("[{}{}] {}", std::string(filled, '#'), std::string(kBar - filled, '.'), line);
  winsize size{};
  if (ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 1 && bar.size() >= size.ws_col) {
    bar.resize(size.ws_col - 1);  // a line that wraps cannot be redrawn
  }
  fmt::print(stderr, "\r\033[K{}", bar);
  std::fflush(stderr);
  drawn_ = true;
}

void Progress::finish() {
  if (drawn_) fmt::print(stderr, "\r\033[K");
  drawn_ = false;
}

void Progress::begin() {
  start_ = Clock::now();
  pace_ = ProgressPace(reader_);
  left_ = {};
}

}  // namespace nif::tools
