// The standard library formats the number of an error of the system, and nothing else here does: without the
// C library's formatting, floating point and all, a page downloads 4 kB less.
#include <cstddef>
#include <cstring>

extern "C" int snprintf(char* to, size_t room, const char* format, ...) {
  const size_t length = std::strlen(format);
  if (room > 0) {
    const size_t copied = length < room ? length : room - 1;
    std::memcpy(to, format, copied);
    to[copied] = 0;
  }
  return int(length);
}
