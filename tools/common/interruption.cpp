// Signal handlers may only use what is safe in them: atomic flags, write() and _exit(). The first signal sets
// a flag; a second one, or any during EndAtOnce, removes temporary files and ends the process.
#include "tools/common/interruption.hpp"

#include <unistd.h>

#include <csignal>
#include <cstring>

#include "formats/base/status.hpp"
#include "formats/base/temporaries.hpp"

namespace nif::tools {
namespace {

std::atomic<bool> interrupted{false}, at_once{false};
static_assert(std::atomic<bool>::is_always_lock_free);

[[noreturn]] void end_at_once() {
  constexpr char kSentence[] = "\nnif: interrupted; nothing was written\n";
  const char* sentence =
      isatty(STDERR_FILENO) == 1 ? kSentence : kSentence + 1;  // a progress bar may be on the line
  [[maybe_unused]] const ssize_t written = write(STDERR_FILENO, sentence, std::strlen(sentence));
  remove_temporaries();
  _exit(int(Status::interrupted));
}

void on_signal(int) {
  if (at_once) end_at_once();
  if (!interrupted.exchange(true)) return;
  remove_temporaries();
  _exit(int(Status::interrupted));
}

void end_by_signal(int number) {
  remove_temporaries();
  signal(number, SIG_DFL);
  raise(number);  // delivered as soon as this handler has returned
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

void leave_nothing_behind() {
  struct sigaction action {};
  action.sa_handler = end_by_signal;
  for (const int number : {SIGINT, SIGTERM, SIGHUP, SIGPIPE}) {
    struct sigaction before {};
    sigaction(number, nullptr, &before);
    // signals that nohup ignores stay ignored
    if (before.sa_handler == SIG_DFL) sigaction(number, &action, nullptr);
  }
  signal(SIGXFSZ, SIG_IGN);
}

EndAtOnce::EndAtOnce() {
  at_once = true;
  if (interruption()) end_at_once();  // the signal arrived just before
}
EndAtOnce::~EndAtOnce() { at_once = false; }

}  // namespace nif::tools
