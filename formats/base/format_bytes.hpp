// Counts of bytes as people read them.
#pragma once

#include <cstdio>
#include <string>

namespace nif {

/// "152.3 kB", in powers of 1000.
inline std::string format_bytes(double bytes) {
  struct Unit {
    double size;
    const char* format;
  };
  constexpr Unit kUnits[] = {{1e9, "%.2f GB"}, {1e6, "%.1f MB"}, {1e3, "%.1f kB"}};
  char text[64];
  for (const auto& [size, format] : kUnits) {
    if (bytes < size) continue;
    std::snprintf(text, sizeof(text), format, bytes / size);
    return text;
  }
  std::snprintf(text, sizeof(text), "%.0f B", bytes);
  return text;
}

}  // namespace nif
