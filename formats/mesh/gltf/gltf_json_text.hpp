// Finds the positions of values in a JSON text, so that a few of them can be replaced while every other byte
// keeps its spelling, order and white space. A parser that writes back what it has read would change all of
// these.
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
  size_t begin = 0;  ///< start of an element's value, or of a member's key
  size_t value = 0;  ///< the first byte of the value
  size_t end = 0;    ///< after the value
};

/// A view of a text that a parser has accepted as JSON. For any other text, positions mean nothing, but never
/// exceed the text.
class JsonText {
 public:
  explicit JsonText(std::string_view text) : text_(text) {}

  /// The first byte of the outermost value.
  size_t root() const { return skip_space(text_.starts_with("\xEF\xBB\xBF") ? 3 : 0); }
  bool is_object(size_t value) const { return starts_with(value, '{'); }
  bool is_array(size_t value) const { return starts_with(value, '['); }
  bool starts_with(size_t value, char c) const { return value < text_.size() && text_[value] == c; }

  /// The elements of an array, or the members of an object, that begins at `value`; empty for anything else.
  std::vector<JsonItem> items(size_t value) const;
  /// A member's key, unescaped.
  std::string key(const JsonItem& member) const;
  /// The member of an object, or nothing. If several have the same key, the last one, which parsers take.
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

/// Edits of a text, applied together.
class TextEdits {
 public:
  /// Replaces the bytes from `begin` to `end` with `text`. Non-empty ranges must not overlap; insertions at
  /// the same position keep the order of the calls.
  void replace(size_t begin, size_t end, std::string text) {
    edits_.push_back({begin, end, std::move(text)});
  }
  void insert(size_t at, std::string text) { replace(at, at, std::move(text)); }

  /// Number of bytes by which the text grows; negative if it shrinks.
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
