// A table of a TOML file, read with toml++. Every key is checked and unknown keys are refused, so that
// misspelt keys are found.
#pragma once

#include <fmt/format.h>

#include <set>
#include <string>
#include <utility>
#include <vector>

#define TOML_ENABLE_FORMATTERS 0
#include <toml++/toml.h>

#include "formats/base/status.hpp"
#include "formats/base/vector.hpp"

namespace nif::tools {

/// Reads a whole file of at most 16 MiB. Throws nif::Error: the codes for a mesh file that cannot be read,
/// and `malformed` with the line if it is not TOML.
toml::table read_toml(const std::string& file, Status malformed);

/// The word of `names` that differs from `word` in the fewest letters; empty if none is close.
std::string nearest(const std::string& word, const std::set<std::string>& names);

/// Remembers which keys were requested, so that finish() can refuse the rest. Every call throws nif::Error,
/// with the status given to the constructor and one sentence that names the file, the line, the table and the
/// key. The file's name and the toml::table must outlive it.
class TomlTable {
 public:
  TomlTable(const std::string& file, std::string name, const toml::table& table, Status malformed)
      : file_(file), name_(std::move(name)), table_(table), malformed_(malformed) {}

  bool has(const std::string& key) {
    known_.insert(key);
    return table_.contains(key);
  }

  std::string text(const std::string& key);
  std::string text(const std::string& key, const std::string& otherwise) {
    return has(key) ? text(key) : otherwise;
  }
  /// One text, or an array of texts; empty if there is no such key.
  std::vector<std::string> texts(const std::string& key);

  double number(const std::string& key, double low, double high);
  double number(const std::string& key, double low, double high, double otherwise) {
    return has(key) ? number(key, low, high) : otherwise;
  }
  std::vector<double> numbers(const std::string& key, size_t count);

  bool flag(const std::string& key, bool otherwise);
  uint64_t whole(const std::string& key, uint64_t low, uint64_t high, uint64_t otherwise);

  Double3 vector(const std::string& key);
  Double3 vector(const std::string& key, const Double3& otherwise) {
    return has(key) ? vector(key) : otherwise;
  }
  /// A vector that must not be zero, normalised to unit length.
  Double3 unit(const std::string& key);
  /// Three numbers, or one for all three.
  Double3 colour(const std::string& key, double high);
  Double3 colour(const std::string& key, double high, const Double3& otherwise) {
    return has(key) ? colour(key, high) : otherwise;
  }

  /// A value as an option of the command line would state it: text, a number, "true" or "false".
  std::string word(const std::string& key) { return word(key, need(key)); }
  /// The same, or an array of such values.
  std::vector<std::string> words(const std::string& key);

  /// Visits each table of an array of tables ([[key]]); nothing if there is no such key.
  template <class Use>
  void tables(const std::string& key, Use&& use) {
    if (!has(key)) return;
    const toml::array* array = table_.get(key)->as_array();
    if (array == nullptr || !array->is_array_of_tables())
      fail(key, fmt::format("must be an array of tables, [[{}]]", key));
    for (size_t i = 0; i < array->size(); ++i)
      inside(fmt::format("{} {}", key, i + 1), *array->get_as<toml::table>(i), use);
  }

  template <class Use>
  void table(const std::string& key, Use&& use) {
    if (!has(key)) return;
    const toml::table* table = table_.get(key)->as_table();
    if (table == nullptr) fail(key, fmt::format("must be a table, [{}]", key));
    inside(key, *table, use);
  }

  /// Refuses keys that were not requested, and suggests the nearest requested key.
  void finish() const;

  [[noreturn]] void fail(const std::string& key, const std::string& what) const;

 private:
  std::string text_of(const std::string& key, const toml::node& node, const char* otherwise) const;
  template <class Use>
  void inside(const std::string& name, const toml::table& table, Use&& use) const {
    TomlTable inner(file_, name, table, malformed_);
    use(inner);
    inner.finish();
  }
  const toml::node& need(const std::string& key);
  std::string word(const std::string& key, const toml::node& node) const;
  double in_range(const std::string& key, double value, double low, double high) const;
  double element(const std::string& key, const toml::array& array, size_t index, double low,
                 double high) const;

  const std::string& file_;
  std::string name_;
  const toml::table& table_;
  Status malformed_;
  std::set<std::string> known_;
};

}  // namespace nif::tools
