// Parses numbers and lines of text formats. std::from_chars rounds correctly and ignores the locale.
#include "formats/mesh/text_cursor.hpp"

#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>
#include <limits>

namespace nif::mesh::detail {

namespace {

bool is_line_end(char c) { return c == '\n' || c == '\r'; }

/// Finds the first LF or CR, eight characters at a time: most lines have some twenty.
const char* line_end(const char* at, const char* end) {
  constexpr uint64_t kOnes = 0x0101010101010101;
  static_assert(std::endian::native == std::endian::little);
  while (end - at >= 8) {
    uint64_t eight;
    std::memcpy(&eight, at, sizeof eight);
    // The lowest set bit marks the first character up to '\r'.
    const uint64_t low = (eight - kOnes * ('\r' + 1)) & ~eight & (kOnes * 0x80);
    if (low == 0) {
      at += 8;
      continue;
    }
    at += std::countr_zero(low) / 8;
    if (is_line_end(*at)) return at;
    ++at;
  }
  while (at != end && !is_line_end(*at)) ++at;
  return at;
}

}  // namespace

std::string_view TextCursor::rest_of_line() {
  while (at_ != end_ && !is_line_end(*at_) && is_space(*at_)) ++at_;
  const char* begin = at_;
  at_ = line_end(at_, end_);
  const char* last = at_;
  while (last != begin && is_space(last[-1])) --last;
  if (at_ != end_ && *at_++ == '\r' && at_ != end_ && *at_ == '\n') ++at_;
  return {begin, static_cast<size_t>(last - begin)};
}

uint64_t TextCursor::line() const {
  uint64_t line = 1;
  for (const char* at = begin_; at != at_; ++at)
    line += *at == '\n' || (*at == '\r' && (at + 1 == end_ || at[1] != '\n'));
  return line;
}

namespace {

template <class Real>
bool parse_real(std::string_view word, Real& value) {
  const char* begin = word.data();
  const char* end = begin + word.size();
  if (word.size() > 1 && *begin == '+' && begin[1] != '-') ++begin;
  const auto [stop, code] = std::from_chars(begin, end, value);
  if (code == std::errc::invalid_argument) return false;
  if (stop != end) {
    // "1.#QNAN", "1.#INF", "-1.#IND": written by printf of older Microsoft libraries.
    if (*stop == '#' && end - stop > 1) {
      value = std::numeric_limits<Real>::quiet_NaN();
      return true;
    }
    return false;
  }
  if (code == std::errc::result_out_of_range) {
    // from_chars does not tell in which direction; a double has the range to tell in all but absurd cases.
    double wide = 0;
    const bool known = std::from_chars(begin, end, wide).ec == std::errc();
    const bool tiny =
        known ? std::abs(wide) < 1 : word.find("e-") != word.npos || word.find("E-") != word.npos;
    value = std::copysign(tiny ? static_cast<Real>(wide) : std::numeric_limits<Real>::infinity(),
                          *begin == '-' ? Real{-1} : Real{1});
  }
  return true;
}

}  // namespace

bool parse_float(std::string_view word, float& value) { return parse_real(word, value); }
bool parse_double(std::string_view word, double& value) { return parse_real(word, value); }

bool parse_integer(std::string_view word, int64_t& value) {
  const char* begin = word.data();
  const char* end = begin + word.size();
  if (word.size() > 1 && *begin == '+' && begin[1] != '-') ++begin;
  const auto [stop, code] = std::from_chars(begin, end, value);
  return code == std::errc() && stop == end;
}

bool same_word(std::string_view word, std::string_view lower) {
  if (word.size() != lower.size()) return false;
  for (size_t i = 0; i < word.size(); ++i) {
    const char c = word[i] >= 'A' && word[i] <= 'Z' ? static_cast<char>(word[i] - 'A' + 'a') : word[i];
    if (c != lower[i]) return false;
  }
  return true;
}

}  // namespace nif::mesh::detail
