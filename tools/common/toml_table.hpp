// A table of a TOML file, read with toml++. Every key is checked and unknown keys are refused, so that a
// misspelt one is found.
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

/// A whole file, of 16 MiB at most. Throws nif::Error: with the codes of a mesh file that cannot be read, and
/// `malformed` with the line where it is no TOML.
toml::table read_toml(const std::string& file, Status malformed);

/// Of `names` the one that is most like `word`, by letters that differ; empty where none is near.
std::string nearest(const std::string& word, const std::set<std::string>& names);

/// Remembers what was asked of it, so that finish() can refuse the rest. Every call throws nif::Error, with
/// the status that it was made with and one sentence that names the file, the line, the table and the key.
/// The file's name and the toml::table must outlive it.
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
  /// One text, or an array of them; none where there is no such key.
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
  /// Not zero, and made one unit long.
  Double3 unit(const std::string& key);
  /// Three numbers, or one for all three.
  Double3 colour(const std::string& key, double high);
  Double3 colour(const std::string& key, double high, const Double3& otherwise) {
    return has(key) ? colour(key, high) : otherwise;
  }

  /// What stands there, as an option of the command line would say it: text, a number, "true" or "false".
  std::string word(const std::string& key) { return word(key, need(key)); }
  /// The same, or an array of them.
  std::vector<std::string> words(const std::string& key);

  /// Each table of an array of tables ([[key]]); none where there is no such key.
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

  /// Refuses keys that nobody has asked for, and names the nearest of those that somebody has.
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
