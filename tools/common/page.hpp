// HTML pages that need no other file: one style for all that `nif` writes for people.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace nif::tools {

/// Text that may stand in HTML and SVG, and in their attributes in double quotes, whatever bytes a file's
/// name has.
std::string escaped(std::string_view text);

/// A whole file as an address: "data:TYPE;base64,...".
std::string data_address(std::string_view type, std::string_view bytes);
/// A PNG so.
std::string png_address(std::string_view png);

/// The page: light or dark as the reader's system has it, readable on a phone. `body` is HTML.
std::string html_page(std::string_view title, std::string_view body);

/// A part of it with a title and a sentence or two about what it shows. `html` is HTML.
std::string html_section(std::string_view title, std::string_view about, const std::string& html);

/// Bars below each other, each with a name, its length as a share from 0 to 1, and what is said of it.
class PageBars {
 public:
  void add(std::string_view name, double share, std::string_view said);
  const std::string& html() const { return html_; }

 private:
  std::string html_;
};

/// A table that its reader can sort by any column but pictures, and filter by words in the first; without
/// scripts it is as it was written. On a narrow screen each row stands by itself, with the names of the
/// columns.
class PageTable {
 public:
  enum class Kind { text, number, picture };
  struct Column {
    std::string name;
    Kind kind = Kind::text;
  };
  explicit PageTable(std::vector<Column> columns);

  /// The next row; `style` is "failed" or empty.
  void row(std::string_view style = "");
  /// The next cell of the row. `html` is shown, and `value` is what the column is sorted by: a number, or a
  /// text; empty sorts last.
  void cell(std::string_view html, std::string_view value);

  std::string html() const;

 private:
  std::vector<Column> columns_;
  std::string rows_;
  size_t column_ = 0;
};

}  // namespace nif::tools
