// Builds self-contained HTML pages in one style for everything that `nif` writes for people.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace nif::tools {

/// Escapes text for HTML and SVG, and for attributes in double quotes. A file name may contain any bytes.
std::string escaped(std::string_view text);

/// A whole file as a data address: "data:TYPE;base64,...".
std::string data_address(std::string_view type, std::string_view bytes);
/// A PNG as a data address.
std::string png_address(std::string_view png);

/// A page that follows the reader's light or dark mode and is readable on a phone. `body` is HTML.
std::string html_page(std::string_view title, std::string_view body);

/// A section with a title and a sentence or two about what it shows. `html` is HTML.
std::string html_section(std::string_view title, std::string_view about, const std::string& html);

/// Bars below each other, each with a name, a length from 0 to 1, and a text.
class PageBars {
 public:
  void add(std::string_view name, double share, std::string_view said);
  const std::string& html() const { return html_; }

 private:
  std::string html_;
};

/// A table that its reader can sort by any column without pictures, and filter by words in the first column.
/// Without scripts, it keeps the order in which it was written. On a narrow screen each row becomes a block
/// with the names of the columns.
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
  /// Adds the next cell of the row. `html` is shown; the column is sorted by `value`, a number or a text.
  /// Empty values sort last.
  void cell(std::string_view html, std::string_view value);

  std::string html() const;

 private:
  std::vector<Column> columns_;
  std::string rows_;
  size_t column_ = 0;
};

}  // namespace nif::tools
