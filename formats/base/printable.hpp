// Makes untrusted text safe for a terminal.
#pragma once

#include <string>
#include <string_view>

namespace nif {

/// Calls `put` for each byte of the text, with control characters escaped ("\x1b"), so that a name in a file
/// cannot move the cursor, change colours or end a line. UTF-8 is unchanged. Does not allocate.
template <class Put>
void put_printable(std::string_view text, Put put) {
  constexpr char kDigits[] = "0123456789abcdef";
  const auto write_out = [&](unsigned char c) {
    for (const char letter : {'\\', 'x', kDigits[c >> 4], kDigits[c & 15]}) put(letter);
  };
  for (size_t i = 0; i < text.size(); ++i) {
    const auto c = static_cast<unsigned char>(text[i]),
               next = static_cast<unsigned char>(i + 1 < text.size() ? text[i + 1] : 0);
    if (c < 0x20 || c == 0x7f) {
      write_out(c);
    } else if (c == 0xc2 && next >= 0x80 && next < 0xa0) {  // U+0080 to U+009F
      write_out(next);
      ++i;
    } else {
      put(text[i]);
    }
  }
}

/// The same as a string.
inline std::string printable(std::string_view text) {
  std::string shown;
  put_printable(text, [&](char c) { shown += c; });
  return shown;
}

}  // namespace nif
