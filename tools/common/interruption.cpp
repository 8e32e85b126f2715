#include "tools/common/interruption.hpp"

#include <unistd.h>

#include <csignal>
#include <cstring>

#include "formats/base/status.hpp"

namespace nif::tools {
namespace {

std::atomic<bool> interrupted{false}, at_once{false};
static_assert(std::atomic<bool>::is_always_lock_free);

[[noreturn]] void end_at_once() {
  constexpr char kSentence[] = "\nnif: interrupted; nothing was written\n";
  const char* sentence =
      isatty(STDERR_FILENO) == 1 ? kSentence : kSentence + 1;  // a bar may stand in the line
  [[maybe_unused]] const ssize_t written = write(STDERR_FILENO, sentence, std::strlen(sentence));
  _exit(int(Status::interrupted));
}

void on_signal(int) {
  if (at_once) end_at_once();
  if (interrupted.exchange(true)) _exit(int(Status::interrupted));
}

}  // namespace

const std::atomic<bool>& interruption() {
  static const bool installed = [] {
    struct sigaction action {};
    action.sa_handler = on_signal;
    sigaction(SIGINT, &action, nullptr);
    sigaction(SIGTERM, &action, nullptr);
    return true;
  }();
  (void)installed;
  return interrupted;
}

EndAtOnce::EndAtOnce() {
  at_once = true;
  if (interruption()) end_at_once();  // it came just before
}
EndAtOnce::~EndAtOnce() { at_once = false; }

}  // namespace nif::tools
