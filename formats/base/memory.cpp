// Free memory is the least of three limits: what the system has free, what the control group allows, and what
// is left of the address space. A limit that cannot be read is ignored.
#include "formats/base/memory.hpp"

#include <sys/resource.h>

#include <algorithm>
#include <cstdio>
#include <fstream>
#include <limits>

#include "formats/base/status.hpp"

namespace nif {
namespace {

constexpr uint64_t kAll = std::numeric_limits<uint64_t>::max();

/// The number in a file; kAll if it has none ("max") or does not exist.
uint64_t number_in(const char* file) {
  uint64_t value = 0;
  return std::ifstream(file) >> value ? value : kAll;
}

uint64_t free_in_machine() {
  std::ifstream file("/proc/meminfo");
  for (std::string key, unit; file >> key;) {
    uint64_t kib = 0;
    if (!(file >> kib)) break;
    if (key == "MemAvailable:") return kib * 1024;
    std::getline(file, unit);
  }
  return kAll;
}

/// Free memory in the control group that a container shows as the root. Its caches count as used: estimating
/// a tenth too little is better than being killed.
uint64_t free_in_group() {
  const uint64_t limit = number_in("/sys/fs/cgroup/memory.max"),
                 used = number_in("/sys/fs/cgroup/memory.current");
  if (limit == kAll || used == kAll) return kAll;
  uint64_t cached = 0;
  std::ifstream file("/sys/fs/cgroup/memory.stat");
  std::string key;
  for (uint64_t value = 0; file >> key >> value;)
    if (key == "inactive_file") cached = value;
  return limit - std::min(limit, used - std::min(used, cached));
}

uint64_t free_in_address_space() {
  rlimit limit{};
  if (::getrlimit(RLIMIT_AS, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY) return kAll;
  uint64_t pages = 0;
  std::ifstream("/proc/self/statm") >> pages;
  return limit.rlim_cur - std::min<uint64_t>(limit.rlim_cur, pages * 4096);
}

std::string gibibytes(uint64_t bytes) {
  char text[32];
  std::snprintf(text, sizeof(text), "%.1f GiB", double(bytes) / (1 << 30));
  return text;
}

}  // namespace

uint64_t available_memory() {
  return std::min({free_in_machine(), free_in_group(), free_in_address_space()});
}

void require_memory(uint64_t bytes, const std::string& what) {
  const uint64_t free = available_memory();
  if (bytes > free)
    throw Error(Status::too_large, what + " takes about " + gibibytes(bytes) + " of memory, but only " +
                                       gibibytes(free) + " are free");
}

}  // namespace nif
