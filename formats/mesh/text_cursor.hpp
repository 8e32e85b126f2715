// Reads the text of a mesh file word by word, without copies and locales, because files have tens of millions
// of words. Lines end in LF, CR LF or CR, also mixed.
#pragma once

#include <cstdint>
#include <string_view>

namespace nif::mesh::detail {

class TextCursor {
 public:
  explicit TextCursor(std::string_view text)
      : begin_(text.data()), at_(text.data()), end_(text.data() + text.size()) {}

  /// The next word, on this or a later line; empty at the end of the text.
  std::string_view word() {
    while (at_ != end_ && is_space(*at_)) ++at_;
    return take();
  }

  /// The rest of this line, trimmed; the cursor moves to the start of the next line.
  std::string_view rest_of_line();

  /// Whether only the line's end follows a piece of this text.
  bool ends_line(std::string_view piece) const {
    const char* after = piece.data() + piece.size();
    return after == end_ || *after == '\n' || *after == '\r';
  }

  bool at_end() const { return at_ == end_; }
  /// The number of the line, from 1. Counts from the start of the text, so it is for messages.
  uint64_t line() const;
  uint64_t bytes_left() const { return static_cast<uint64_t>(end_ - at_); }

 private:
  static bool is_space(char c) { return c == ' ' || (c >= '\t' && c <= '\r'); }
  std::string_view take() {
    const char* begin = at_;
    while (at_ != end_ && !is_space(*at_)) ++at_;
    return {begin, static_cast<size_t>(at_ - begin)};
  }

  const char* begin_;
  const char* at_;
  const char* end_;
};

/// Parses a whole word as a number, rounded to the nearest float. NaN and infinities are accepted, in the
/// spellings of C and of older Microsoft libraries; too large numbers become infinite.
bool parse_float(std::string_view word, float& value);
/// The same, rounded to the nearest double.
bool parse_double(std::string_view word, double& value);

bool parse_integer(std::string_view word, int64_t& value);

/// Whether both are equal apart from the case of ASCII letters; `lower` must be in lower case.
bool same_word(std::string_view word, std::string_view lower);

}  // namespace nif::mesh::detail
