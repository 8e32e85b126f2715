// Finds where values are in a JSON text, so that a few of them can be replaced while every other byte keeps
// its spelling, order and white space. A parser that writes back what it has read would change all of these.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "formats/mesh/file_pieces.hpp"

namespace nif::mesh::detail {

/// An element of an array or a member of an object, by positions in the text.
struct JsonItem {
  size_t begin = 0;  ///< of an element its value, of a member its key
  size_t value = 0;  ///< the first byte of the value
  size_t end = 0;    ///< after the value
};

/// A view of a text that a parser has found to be JSON; for any other, positions mean nothing, but they are
/// never beyond the text.
class JsonText {
 public:
  explicit JsonText(std::string_view text) : text_(text) {}

  /// The first byte of the outermost value.
  size_t root() const { return skip_space(text_.starts_with("\xEF\xBB\xBF") ? 3 : 0); }
  bool is_object(size_t value) const { return starts_with(value, '{'); }
  bool is_array(size_t value) const { return starts_with(value, '['); }
  bool starts_with(size_t value, char c) const { return value < text_.size() && text_[value] == c; }

  /// The elements of the array, or the members of the object, that begins at `value`; none of anything else.
  std::vector<JsonItem> items(size_t value) const;
  /// A member's key, unescaped.
  std::string key(const JsonItem& member) const;
  /// The member of an object, or none; of several of the same key the last, which is the one that parsers
  /// take.
  std::optional<JsonItem> find(size_t object, std::string_view name) const;
  std::optional<JsonItem> find(const std::vector<JsonItem>& members, std::string_view name) const;

  std::string_view of(const JsonItem& item) const { return text_.substr(item.value, item.end - item.value); }
  std::string_view text() const { return text_; }

 private:
  size_t skip_space(size_t at) const;
  size_t skip_string(size_t at) const;
  size_t skip_value(size_t at) const;

  std::string_view text_;
};

/// Changes of a text, made together.
class TextEdits {
 public:
  /// Puts `text` in place of the bytes from `begin` to `end`. Spans that are not empty must not overlap;
  /// insertions at one position stand in the order in which they were made.
  void replace(size_t begin, size_t end, std::string text) {
    edits_.push_back({begin, end, std::move(text)});
  }
  void insert(size_t at, std::string text) { replace(at, at, std::move(text)); }

  /// By how many bytes the text grows; below 0 where it shrinks.
  ptrdiff_t growth() const;
  /// Appends the changed text to `out`, which then refers to `text`.
  void apply(std::string_view text, FilePieces& out) const;
  bool empty() const { return edits_.empty(); }

 private:
  struct Edit {
    size_t begin, end;
    std::string text;
  };
  std::vector<Edit> edits_;
};

}  // namespace nif::mesh::detail
