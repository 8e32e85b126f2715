// Records the temporary files of this process, so that a signal handler can remove them.
#pragma once

#include <functional>
#include <string>

namespace nif {

/// Removes the temporary files that killed processes left in a folder, for those targets, given by their
/// names in the folder, for which `which` returns true. Temporary files of living processes stay.
void remove_abandoned(const std::string& folder, const std::function<bool(const std::string&)>& which);

/// Removes the temporary files of all open OutputFiles. For signal handlers, just before the process ends:
/// nothing else may be written afterwards, and an OutputFile that is created then waits for ever.
/// Async-signal-safe; keeps errno.
void remove_temporaries() noexcept;

/// Only for OutputFile.
namespace temporaries {
/// To be called before the file is created. Returns a number for remove(), or -1 if there are too many; such
/// files are left for the next run to remove. Thread-safe.
int add(const char* path) noexcept;
/// To be called once the file was renamed or removed.
void remove(int number) noexcept;
}  // namespace temporaries

}  // namespace nif
