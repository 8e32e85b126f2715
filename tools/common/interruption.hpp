// Handles Ctrl-C and termination signals: work that can stop polls a flag; work that cannot is ended at once.
#pragma once

#include <atomic>

namespace nif::tools {

/// For the start of a program. Signals that end it then remove its temporary files first, and exceeding the
/// limit on file sizes (`ulimit -f`) is a write error like any other.
void leave_nothing_behind();

/// Set once Ctrl-C or a termination signal has arrived; a second one ends the process at once. The first call
/// installs the handler; until then, signals kill the process as usual.
const std::atomic<bool>& interruption();

/// During its lifetime, Ctrl-C and termination signals end the process at once, with Status::interrupted and
/// one sentence. For work in libraries that cannot be stopped, and only while no file is being written.
class EndAtOnce {
 public:
  EndAtOnce();
  ~EndAtOnce();
  EndAtOnce(const EndAtOnce&) = delete;
  EndAtOnce& operator=(const EndAtOnce&) = delete;
};

}  // namespace nif::tools
