// toml++ 3.3 recurses once for each part of a dotted key, so check_keys() refuses keys of many parts
// before the parser sees them. For a misspelt key the nearest known one is suggested (Levenshtein).
#include "tools/common/toml_table.hpp"

#include <algorithm>
#include <numeric>

#include "formats/mesh/file_bytes.hpp"

namespace nif::tools {
namespace {

/// Number of letters to insert, delete or replace to turn one word into the other (Levenshtein distance).
size_t distance(const std::string& a, const std::string& b) {
  std::vector<size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), size_t{0});
  for (size_t i = 0; i < a.size(); ++i) {
    size_t diagonal = std::exchange(row[0], i + 1);
    for (size_t j = 0; j < b.size(); ++j)
      diagonal = std::exchange(row[j + 1], std::min({row[j] + 1, row[j + 1] + 1, diagonal + (a[i] != b[j])}));
  }
  return row.back();
}

/// The position after the string that opens at `at`, on one line or several; npos if it does not end.
size_t behind_string(std::string_view text, size_t at) {
  const char quote = text[at];
  const std::string three(3, quote);
  const bool many_lines = text.substr(at).starts_with(three);
  const std::string closing = many_lines ? three : std::string(1, quote);
  for (size_t i = at + closing.size(); i < text.size(); ++i) {
    if (quote == '"' && text[i] == '\\') {
      ++i;
    } else if (text[i] == quote && text.substr(i).starts_with(closing)) {
      i += closing.size();
      // Up to two quotes before the closing quotes belong to the text.
      for (int more = 0; many_lines && more < 2 && i < text.size() && text[i] == quote; ++more) ++i;
      return i;
    }
  }
  return text.npos;
}

/// toml++ 3.3 makes a nested table for each part of a dotted key, and then recurses once for each, without
/// limit. (Nested values it limits itself, to 256 levels, so tables are at most 256 times that deep.) Text
/// that is not TOML is scanned as if it were; the parser stops at the first error.
void check_keys(const std::string& file, std::string_view text, Status malformed) {
  constexpr size_t kMostParts = 16;
  size_t line = 1, parts = 1;
  for (size_t i = 0; i < text.size(); ++i) {
    switch (text[i]) {
      case '"':
      case '\'': {
        const size_t end = behind_string(text, i);
        if (end == text.npos) return;
        line += size_t(std::count(text.begin() + ptrdiff_t(i), text.begin() + ptrdiff_t(end), '\n'));
        i = end - 1;
        break;
      }
      case '#':
        i = std::min(text.find('\n', i), text.size()) - 1;
        break;
      case '.':
        if (++parts > kMostParts)
          throw Error(malformed,
                      fmt::format("{}: line {}: a key has more than {} parts", file, line, kMostParts));
        break;
      case '\n':
        ++line;
        [[fallthrough]];
      case '=':
      case ',':
      case '[':
      case ']':
      case '{':
      case '}':
        parts = 1;
    }
  }
}

}  // namespace

toml::table read_toml(const std::string& file, Status malformed) {
  constexpr uint64_t kMaxBytes = 16 << 20;
  const mesh::detail::ByteBuffer text = mesh::detail::load_file(file, kMaxBytes);
  check_keys(file, text.view(), malformed);
  try {
    return toml::parse(text.view(), file);
  } catch (const toml::parse_error& problem) {
    throw Error(malformed,
                fmt::format("{}: line {}: {}", file, problem.source().begin.line, problem.description()));
  }
}

std::string nearest(const std::string& word, const std::set<std::string>& names) {
  std::string best;
  size_t least = std::max<size_t>(2, word.size() / 2) + 1;  // more distant words are different words
  for (const std::string& name : names) {
    // needs at least the difference in length; words may be very long
    if (word.size() >= name.size() + least) continue;
    const size_t letters = distance(word, name);
    if (letters < least) {
      least = letters;
      best = name;
    }
  }
  return best;
}

std::string TomlTable::text_of(const std::string& key, const toml::node& node, const char* otherwise) const {
  const auto value = node.value_exact<std::string>();
  if (!value || value->empty()) fail(key, otherwise);
  // The system's functions would end the name at this character.
  if (value->find('\0') != std::string::npos) fail(key, "has the character U+0000");
  return *value;
}

std::string TomlTable::text(const std::string& key) { return text_of(key, need(key), "must be a string"); }

std::vector<std::string> TomlTable::texts(const std::string& key) {
  if (!has(key)) return {};
  const toml::array* array = need(key).as_array();
  if (array == nullptr) return {text(key)};
  std::vector<std::string> values;
  for (const toml::node& node : *array) {
    values.push_back(text_of(key, node, "must be a string or an array of strings"));
  }
  return values;
}

double TomlTable::number(const std::string& key, double low, double high) {
  const toml::node& node = need(key);
  if (!node.is_number()) fail(key, "must be a number");
  return in_range(key, *node.value<double>(), low, high);
}

std::vector<double> TomlTable::numbers(const std::string& key, size_t count) {
  const toml::array* array = need(key).as_array();
  if (array == nullptr || array->size() != count) fail(key, fmt::format("must be {} numbers", count));
  std::vector<double> values;
  for (size_t i = 0; i < count; ++i) values.push_back(element(key, *array, i, -1e15, 1e15));
  return values;
}

bool TomlTable::flag(const std::string& key, bool otherwise) {
  if (!has(key)) return otherwise;
  const auto value = need(key).value_exact<bool>();
  if (!value) fail(key, "must be true or false");
  return *value;
}

uint64_t TomlTable::whole(const std::string& key, uint64_t low, uint64_t high, uint64_t otherwise) {
  if (!has(key)) return otherwise;
  const auto value = need(key).value_exact<int64_t>();
  if (!value || *value < 0 || uint64_t(*value) < low || uint64_t(*value) > high)
    fail(key, fmt::format("must be a whole number from {} to {}", low, high));
  return uint64_t(*value);
}

Double3 TomlTable::vector(const std::string& key) {
  const toml::array* array = need(key).as_array();
  if (array == nullptr || array->size() != 3) fail(key, "must be three numbers");
  Double3 v{};
  for (size_t a = 0; a < 3; ++a) v[a] = element(key, *array, a, -1e15, 1e15);
  return v;
}

Double3 TomlTable::unit(const std::string& key) {
  const Double3 v = vector(key);
  const double size = length(v);
  if (!(size > 1e-12)) fail(key, "must not be zero");
  return v * (1 / size);
}

Double3 TomlTable::colour(const std::string& key, double high) {
  const toml::node& node = need(key);
  if (node.is_number()) {
    const double grey = in_range(key, *node.value<double>(), 0, high);
    return {grey, grey, grey};
  }
  const toml::array* array = node.as_array();
  if (array == nullptr || array->size() != 3) fail(key, "must be one number or three numbers");
  Double3 c{};
  for (size_t a = 0; a < 3; ++a) c[a] = element(key, *array, a, 0, high);
  return c;
}

std::vector<std::string> TomlTable::words(const std::string& key) {
  const toml::array* array = need(key).as_array();
  if (array == nullptr) return {word(key)};
  std::vector<std::string> words;
  for (const toml::node& node : *array) words.push_back(word(key, node));
  return words;
}

std::string TomlTable::word(const std::string& key, const toml::node& node) const {
  if (const auto text = node.value_exact<std::string>()) return *text;
  if (const auto whole = node.value_exact<int64_t>()) return fmt::format("{}", *whole);
  if (const auto number = node.value_exact<double>()) return fmt::format("{}", *number);
  if (const auto flag = node.value_exact<bool>()) return *flag ? "true" : "false";
  fail(key, "must be a string, a number, true or false");
}

void TomlTable::finish() const {
  for (const auto& [key, node] : table_) {
    const std::string name(key.str());
    if (known_.contains(name)) continue;
    const std::string near = nearest(name, known_);
    fail(name, near.empty() ? "is unknown here" : fmt::format("is unknown here; did you mean '{}'?", near));
  }
}

void TomlTable::fail(const std::string& key, const std::string& what) const {
  const toml::node* node = table_.get(key);
  const auto line = (node != nullptr ? node->source() : table_.source()).begin.line;
  const std::string of = name_.empty() ? "" : name_ + ": ";
  throw Error(malformed_,
              fmt::format("{}: line {}: {}'{}' {}", file_, std::max<uint64_t>(line, 1), of, key, what));
}

const toml::node& TomlTable::need(const std::string& key) {
  if (!has(key)) fail(key, "is missing");
  return *table_.get(key);
}

double TomlTable::in_range(const std::string& key, double value, double low, double high) const {
  if (!(value >= low && value <= high)) fail(key, fmt::format("must be from {} to {}", low, high));
  return value;
}

double TomlTable::element(const std::string& key, const toml::array& array, size_t index, double low,
                          double high) const {
  const auto value = array[index].value<double>();
  if (!array[index].is_number() || !value) fail(key, "must contain only numbers");
  return in_range(key, *value, low, high);
}

}  // namespace nif::tools
