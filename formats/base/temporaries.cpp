// A fixed table of paths without locks, because a signal handler may read it at any moment. A path is written
// only while its entry is marked as changing. Once the handler has begun, new entries wait.
#include "formats/base/temporaries.hpp"

#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <cstring>

namespace nif {
namespace {

/// A handler may read entries at any time, so a path changes only while nobody may read it.
struct Entry {
  enum State : int { none, changing, there };
  std::atomic<int> state{none};
  char path[4096];
};
std::array<Entry, 32> entries;
std::atomic<bool> ending{false};
static_assert(std::atomic<int>::is_always_lock_free && std::atomic<bool>::is_always_lock_free);

}  // namespace

void remove_temporaries() noexcept {
  const int before = errno;
  ending = true;
  for (const Entry& entry : entries)
    if (entry.state == Entry::there) ::unlink(entry.path);
  errno = before;
}

int temporaries::add(const char* path) noexcept {
  const size_t size = std::strlen(path) + 1;
  if (size > sizeof(Entry::path)) return -1;
  for (size_t i = 0; i < entries.size(); ++i) {
    int expected = Entry::none;
    if (!entries[i].state.compare_exchange_strong(expected, Entry::changing)) continue;
    while (ending) ::pause();
    std::memcpy(entries[i].path, path, size);
    entries[i].state = Entry::there;
    return int(i);
  }
  return -1;
}

void temporaries::remove(int number) noexcept {
  if (number >= 0) entries[size_t(number)].state = Entry::none;
}

}  // namespace nif
