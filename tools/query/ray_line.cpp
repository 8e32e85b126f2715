// A small parser for one line of CSV or JSON. It supports only as much JSON as a ray needs: strings have no
// escapes. std::from_chars does not tell too large numbers from too small ones, so strtof decides.
#include "tools/query/ray_line.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cstdlib>
#include <limits>
#include <span>

#include "formats/base/printable.hpp"

namespace nif::tools {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr size_t kTMin = 6, kTMax = 7;  // in kRayNumbers

using Numbers = std::array<float, kRayNumbers.size()>;
constexpr Numbers kDefaults{0, 0, 0, 0, 0, 0, 0, kInfinity};

NifRay to_ray(const Numbers& n) { return {{n[0], n[1], n[2]}, n[kTMin], {n[3], n[4], n[5]}, n[kTMax]}; }

bool is_blank(char c) { return c == ' ' || c == '\t'; }

std::string_view trimmed(std::string_view text) {
  while (!text.empty() && is_blank(text.front())) text.remove_prefix(1);
  while (!text.empty() && is_blank(text.back())) text.remove_suffix(1);
  return text;
}

/// Removes and returns the next word of a row; nothing at the end.
class Words {
 public:
  Words(std::string_view line, char separator) : rest_(trimmed(line)), separator_(separator) {}

  bool next(std::string_view& word) {
    if (end_) return false;
    size_t length = 0;
    if (separator_ == ' ') {
      while (length < rest_.size() && !is_blank(rest_[length])) ++length;
    } else {
      length = std::min(rest_.find(separator_), rest_.size());
    }
    word = trimmed(rest_.substr(0, length));
    if (word.size() >= 2 && word.front() == '"' && word.back() == '"')
      word = trimmed(word.substr(1, word.size() - 2));
    end_ = length == rest_.size();
    if (!end_) rest_ = separator_ == ' ' ? trimmed(rest_.substr(length)) : rest_.substr(length + 1);
    return true;
  }

 private:
  std::string_view rest_;
  char separator_;
  bool end_ = false;
};

}  // namespace

std::string shown(std::string_view word) {
  constexpr size_t kMost = 40;
  if (word.size() <= kMost) return fmt::format("'{}'", printable(word));
  size_t length = kMost;
  // do not cut within a UTF-8 character
  while (length > kMost - 4 && (word[length] & 0xc0) == 0x80) --length;
  return fmt::format("'{}...'", printable(word.substr(0, length)));
}

std::optional<float> parse_float(std::string_view word) {
  std::string_view digits = word;
  bool negative = false;
  if (!digits.empty() && (digits[0] == '+' || digits[0] == '-')) {
    negative = digits[0] == '-';
    digits.remove_prefix(1);
  }
  if (digits.empty() || digits[0] == '-') return std::nullopt;
  auto format = std::chars_format::general;
  if (digits.size() > 2 && digits[0] == '0' && (digits[1] == 'x' || digits[1] == 'X')) {
    format = std::chars_format::hex;
    digits.remove_prefix(2);
    if (digits[0] != '.' && !std::isxdigit(uint8_t(digits[0]))) return std::nullopt;
  }
  float value = 0;
  const char* end = digits.data() + digits.size();
  const auto [stop, error] = std::from_chars(digits.data(), end, value, format);
  if (stop != end || error == std::errc::invalid_argument) return std::nullopt;
  if (error == std::errc::result_out_of_range)  // infinite, denormal or 0: from_chars does not tell which
    return std::strtof(std::string(word).c_str(), nullptr);
  return negative ? -value : value;
}

bool RayTable::begin(std::string_view line) {
  separator_ = line.find(';') != line.npos ? ';' : line.find(',') != line.npos ? ',' : ' ';
  std::string_view word;
  Words words(line, separator_);
  words.next(word);
  has_header_ = !parse_float(word);
  if (!has_header_) {
    size_t count = 1;
    while (words.next(word)) ++count;
    if (count != 6 && count != 8)
      throw LineProblem{
          fmt::format("a ray has 6 or 8 numbers, ox oy oz dx dy dz [tmin tmax], and there are {}", count)};
    for (size_t i = 0; i < count; ++i) columns_.push_back(uint8_t(i));
    return false;
  }
  std::array<bool, kRayNumbers.size()> known{};
  do {
    const size_t number = size_t(std::ranges::find(kRayNumbers, word) - kRayNumbers.begin());
    if (number == kRayNumbers.size())
      throw LineProblem{shown(word) +
                        " is neither a number nor the name of a column: ox, oy, oz, dx, dy, dz, "
                        "tmin or tmax"};
    if (known[number]) throw LineProblem{fmt::format("there are two columns '{}'", word)};
    known[number] = true;
    columns_.push_back(uint8_t(number));
  } while (words.next(word));
  for (size_t number = 0; number < kTMin; ++number)
    if (!known[number]) throw LineProblem{fmt::format("there is no column '{}'", kRayNumbers[number])};
  return true;
}

NifRay RayTable::parse(std::string_view line) const {
  Numbers numbers = kDefaults;
  Words words(line, separator_);
  std::string_view word;
  size_t count = 0;
  for (; words.next(word); ++count) {
    if (count == columns_.size()) {
      do ++count;
      while (words.next(word));
      break;
    }
    const uint8_t number = columns_[count];
    if (word.empty() && number >= kTMin) continue;  // the default
    const std::optional<float> value = parse_float(word);
    if (!value)
      throw LineProblem{
          fmt::format("column {} ({}): {} is not a number", count + 1, kRayNumbers[number], shown(word))};
    numbers[number] = *value;
  }
  if (count != columns_.size())
    throw LineProblem{fmt::format("there are {} numbers, but {} has {}", count,
                                  has_header_ ? "the header" : "the first ray", columns_.size())};
  return to_ray(numbers);
}

namespace {

class JsonRay {
 public:
  explicit JsonRay(std::string_view line) : rest_(line) {}

  NifRay parse() {
    Numbers numbers = kDefaults;
    if (take('[')) {
      const size_t count = array(numbers);
      if (count != 6 && count != 8)
        throw LineProblem{fmt::format("an array of 6 or 8 numbers is needed, and there are {}", count)};
    } else {
      need('{', "a ray is an object or an array");
      members(numbers);
    }
    if (!trimmed(rest_).empty())
      throw LineProblem{shown(trimmed(rest_)) + " follows the ray; each line has one ray"};
    return to_ray(numbers);
  }

 private:
  bool take(char c) {
    rest_ = trimmed(rest_);
    if (!rest_.starts_with(c)) return false;
    rest_.remove_prefix(1);
    return true;
  }

  void need(char c, const char* why) {
    if (!take(c))
      throw LineProblem{fmt::format("{}: '{}' is needed before {}", why, c,
                                    rest_.empty() ? "the end of the line" : shown(rest_))};
  }

  /// Returns the text up to the closing quote; the opening one is already consumed.
  std::string_view text() {
    const size_t length = rest_.find('"');
    if (length == rest_.npos) throw LineProblem{"a string does not end"};
    const std::string_view inside = rest_.substr(0, length);
    rest_.remove_prefix(length + 1);
    return inside;
  }

  /// `index` is the position in the array of this name; -1: no array.
  float number(std::string_view name, int64_t index = -1) {
    std::string_view word;
    if (take('"')) {
      word = text();
    } else {
      const size_t length = std::min(rest_.find_first_of(",]} \t"), rest_.size());
      word = rest_.substr(0, length);
      rest_.remove_prefix(length);
    }
    const std::optional<float> value = parse_float(word);
    if (!value)
      throw LineProblem{fmt::format("{}{}: {} is not a number", name,
                                    index < 0 ? "" : fmt::format(" [{}]", index), shown(word))};
    return *value;
  }

  /// Parses what follows a '['. Returns how many numbers there are, which may be more than fit.
  size_t array(std::span<float> numbers, std::string_view name = "array") {
    size_t count = 0;
    if (take(']')) return 0;
    do {
      const float value = number(name, int64_t(count));
      if (count < numbers.size()) numbers[count] = value;
      ++count;
    } while (take(','));
    need(']', "an array ends so");
    return count;
  }

  void members(Numbers& numbers) {
    constexpr std::array<std::string_view, 4> kKeys{"origin", "direction", "tmin", "tmax"};
    std::array<bool, kKeys.size()> known{};
    if (!take('}')) {
      do {
        need('"', "a key is a string");
        const std::string_view key = text();
        const size_t k = size_t(std::ranges::find(kKeys, key) - kKeys.begin());
        if (k == kKeys.size())
          throw LineProblem{shown(key) + " is not one of the keys origin, direction, tmin and tmax"};
        if (known[k]) throw LineProblem{fmt::format("'{}' occurs twice", key)};
        known[k] = true;
        need(':', "a value follows its key");
        if (k >= 2) {
          rest_ = trimmed(rest_);
          if (rest_.starts_with("null"))
            rest_.remove_prefix(4);  // the default
          else
            numbers[k == 2 ? kTMin : kTMax] = number(key);
          continue;
        }
        need('[', "a point or direction is an array");
        if (const size_t count = array(std::span(numbers).subspan(3 * k, 3), key); count != 3)
          throw LineProblem{fmt::format("{} has {} numbers instead of 3", key, count)};
      } while (take(','));
      need('}', "an object ends so");
    }
    for (size_t k = 0; k < 2; ++k)
      if (!known[k]) throw LineProblem{fmt::format("there is no '{}'", kKeys[k])};
  }

  std::string_view rest_;
};

}  // namespace

NifRay parse_json_ray(std::string_view line) { return JsonRay(line).parse(); }

}  // namespace nif::tools
