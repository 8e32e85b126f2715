// Decimals come from std::to_chars, which ignores the locale: in some locales, printf writes a comma.
#include "formats/base/quantities.hpp"

#include <charconv>

namespace nif {
namespace {

/// Independent of the locale.
std::string with_decimals(double value, int decimals) {
  char text[512];  // the largest double has 309 digits
  const auto [end, error] =
      std::to_chars(text, text + sizeof(text), value, std::chars_format::fixed, decimals);
  return {text, end};
}

}  // namespace

std::string format_bytes(double bytes) {
  if (bytes < 1e3) return with_decimals(bytes, 0) + " B";
  if (bytes < 1e6) return with_decimals(bytes / 1e3, 1) + " kB";
  if (bytes < 1e9) return with_decimals(bytes / 1e6, 1) + " MB";
  return with_decimals(bytes / 1e9, 2) + " GB";
}

std::string count_of(uint64_t count, const std::string& noun) {
  return std::to_string(count) + " " + noun + (count == 1 ? "" : "s");
}

}  // namespace nif
