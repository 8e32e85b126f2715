// Greedy matching. On failure, only the last * takes one more character, so the time is below the product of
// both lengths, and a hostile pattern cannot cause deep recursion.
#include "formats/base/glob.hpp"

#include <algorithm>
#include <cstddef>

#include "formats/base/utf8.hpp"

namespace nif {
namespace {

/// Removes and returns the first character of a text, which must not be empty. The byte order of UTF-8 is
/// that of code points, so ranges can be compared as text.
std::string_view take(std::string_view& text) {
  const size_t length = std::max<size_t>(1, utf8_sequence(text));
  const std::string_view character = text.substr(0, length);
  text.remove_prefix(length);
  return character;
}

bool in_order(std::string_view a, std::string_view b) {
  return std::lexicographical_compare(a.begin(), a.end(), b.begin(), b.end(), [](char x, char y) {
    return static_cast<unsigned char>(x) < static_cast<unsigned char>(y);
  });
}

struct Set {
  std::string_view rest;  ///< the pattern after the set
  bool holds = false;
};

/// Parses a set after its [. If it is not closed, `rest` is null.
Set read_set(std::string_view pattern, std::string_view character) {
  const bool negated = pattern.starts_with('!') || pattern.starts_with('^');
  if (negated) pattern.remove_prefix(1);
  bool holds = false;
  for (bool first = true; !pattern.empty(); first = false) {
    std::string_view low = take(pattern);
    if (low == "]" && !first) return {pattern, holds != negated};
    if (low == "\\" && !pattern.empty()) low = take(pattern);
    std::string_view high = low;
    if (pattern.size() > 1 && pattern[0] == '-' && pattern[1] != ']') {
      pattern.remove_prefix(1);
      high = take(pattern);
      if (high == "\\" && !pattern.empty()) high = take(pattern);
    }
    holds |= !in_order(character, low) && !in_order(high, character);
  }
  return {};
}

/// Whether one character matches the front of a pattern, which is removed from it.
bool fits_one(std::string_view character, std::string_view& pattern) {
  std::string_view wanted = take(pattern);
  if (wanted == "?") return true;
  if (wanted == "[") {
    const Set set = read_set(pattern, character);
    if (set.rest.data() != nullptr) {
      pattern = set.rest;
      return set.holds;
    }
  }
  if (wanted == "\\" && !pattern.empty()) wanted = take(pattern);
  return wanted == character;
}

}  // namespace

bool fits(std::string_view name, std::string_view pattern) {
  if (name == pattern) return true;
  // Only the last * has to be retried: everything before it already matches as early as it can.
  bool starred = false;
  std::string_view name_then, pattern_then;
  while (!name.empty() || !pattern.empty()) {
    if (pattern.starts_with('*')) {
      pattern.remove_prefix(1);
      starred = true;
      name_then = name;
      pattern_then = pattern;
      continue;
    }
    if (!name.empty() && !pattern.empty()) {
      std::string_view rest = name;
      if (fits_one(take(rest), pattern)) {
        name = rest;
        continue;
      }
    }
    if (!starred || name_then.empty()) return false;
    take(name_then);
    name = name_then;
    pattern = pattern_then;
  }
  return true;
}

}  // namespace nif
