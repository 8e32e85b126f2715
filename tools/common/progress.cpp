#include "tools/common/progress.hpp"

#include <fmt/format.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>

#include "formats/base/printable.hpp"

namespace nif::tools {
namespace {

std::string format_duration(double seconds) {
  const auto whole = static_cast<long>(seconds + 0.5);
  if (whole < 60) return fmt::format("{} s", whole);
  if (whole < 3600) return fmt::format("{}:{:02} min", whole / 60, whole % 60);
  return fmt::format("{}:{:02} h", whole / 3600, whole / 60 % 60);
}

}  // namespace

Progress::Progress(bool quiet) : quiet_(quiet), terminal_(isatty(STDERR_FILENO) == 1), start_(Clock::now()) {}

void Progress::update(double fraction, const std::string& text) {
  if (quiet_) return;
  const auto now = Clock::now();
  const auto interval = terminal_ ? std::chrono::milliseconds(100) : std::chrono::milliseconds(1000);
  // In a log the first line comes after a second, too: what fails at once leaves nothing but its error there.
  if (last_ == Clock::time_point{} && !terminal_) last_ = start_;
  if (last_ != Clock::time_point{} && now - last_ < interval) return;
  last_ = now;

  fraction = std::clamp(fraction, 0.0, 1.0);
  const double elapsed = std::chrono::duration<double>(now - start_).count();
  // Too early there is nothing to extrapolate from.
  const std::string left =
      fraction > 0.04 ? format_duration(elapsed / fraction * (1 - fraction)) + " left" : "";
  if (!terminal_) {
    fmt::print(stderr, "{:3.0f} %  {:<15}{}\n", fraction * 100, left, printable(text));
    return;
  }
  constexpr int kBar = 24;
  const int filled = int(fraction * kBar);
  std::string line = fmt::format("[{}{}] {:3.0f} %  {:<15}{}", std::string(filled, '#'),
                                 std::string(kBar - filled, '.'), fraction * 100, left, printable(text));
  winsize size{};
  if (ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 1 && line.size() >= size.ws_col) {
    line.resize(size.ws_col - 1);  // a line that wraps cannot be redrawn
  }
  fmt::print(stderr, "\r\033[K{}", line);
  std::fflush(stderr);
  drawn_ = true;
}

void Progress::finish() {
  if (drawn_) fmt::print(stderr, "\r\033[K");
  drawn_ = false;
}

}  // namespace nif::tools
