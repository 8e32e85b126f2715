// Ctrl-C and termination signals: work that can stop asks for them, work that cannot is ended at once.
#pragma once

#include <atomic>

namespace nif::tools {

/// At the start of a program: signals that end it remove its temporary files first, and a limit on the size
/// of files (`ulimit -f`) is a write error like others.
void leave_nothing_behind();

/// Set once Ctrl-C or a termination signal has come; a second one ends the process at once. The first call
/// installs the handler: before it, signals kill as usual.
const std::atomic<bool>& interruption();

/// While one lives, Ctrl-C and a termination signal end the process at once, with Status::interrupted and one
/// sentence: for work within libraries that cannot be asked to stop. Only while no file is being written.
class EndAtOnce {
 public:
  EndAtOnce();
  ~EndAtOnce();
  EndAtOnce(const EndAtOnce&) = delete;
  EndAtOnce& operator=(const EndAtOnce&) = delete;
};

}  // namespace nif::tools
