// The temporary files of this process, such that a signal's handler can remove them.
#pragma once

#include <functional>
#include <string>

namespace nif {

/// Removes from a folder what killed processes have left there: the temporary files of those targets, given
/// by their names in the folder, to which `which` says yes. Those that a living process writes stay.
void remove_abandoned(const std::string& folder, const std::function<bool(const std::string&)>& which);

/// Removes the temporary files of all OutputFiles that are under way. For handlers of signals, just before
/// the process ends: nothing else may be written after it, and an OutputFile that is begun then waits for
/// ever. Async-signal-safe; leaves errno alone.
void remove_temporaries() noexcept;

/// For OutputFile alone.
namespace temporaries {
/// Before the file is made. Returns a number for remove(), or -1 where there are too many: these are left for
/// the next run to remove. Thread-safe.
int add(const char* path) noexcept;
/// Once the file has another name, or is gone.
void remove(int number) noexcept;
}  // namespace temporaries

}  // namespace nif
