// Parses PLY headers, strictly for everything that the layout of the body depends on.
#include "formats/mesh/ply_header.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <limits>
#include <optional>
#include <utility>

#include "formats/mesh/readers.hpp"
#include "formats/mesh/text_cursor.hpp"

namespace nif::mesh::detail {
namespace {

std::optional<PlyType> type_named(std::string_view word) {
  static constexpr std::array<std::pair<std::string_view, PlyType>, 16> kNames{{
      {"char", PlyType::i8},
      {"int8", PlyType::i8},
      {"uchar", PlyType::u8},
      {"uint8", PlyType::u8},
      {"short", PlyType::i16},
      {"int16", PlyType::i16},
      {"ushort", PlyType::u16},
      {"uint16", PlyType::u16},
      {"int", PlyType::i32},
      {"int32", PlyType::i32},
      {"uint", PlyType::u32},
      {"uint32", PlyType::u32},
      {"float", PlyType::f32},
      {"float32", PlyType::f32},
      {"double", PlyType::f64},
      {"float64", PlyType::f64},
  }};
  for (const auto& [name, type] : kNames) {
    if (word == name) return type;
  }
  return std::nullopt;
}

bool is_integer(PlyType type) { return type < PlyType::f32; }

/// Returns the header's lines, which may end in LF, CR LF or CR, also mixed. A binary body starts after the
/// last line. If the first line ends in a CR alone, an LF after the last CR belongs to the body.
class HeaderLines {
 public:
  explicit HeaderLines(const Input& input) : input_(input) {
    const size_t end = input.bytes.find_first_of("\r\n");
    if (end == std::string_view::npos) {
      input.fail(Status::file_truncated, "the PLY header ends in its first line");
    }
    cr_alone_ = input.bytes[end] == '\r' && !input.bytes.substr(end + 1).starts_with('\n');
  }

  std::string_view next() {
    const size_t end = input_.bytes.find_first_of("\r\n", at_);
    if (end == std::string_view::npos) {
      input_.fail(Status::file_truncated,
                  fmt::format("the PLY header ends in line {}, before 'end_header'", line_ + 1));
    }
    const std::string_view text = input_.bytes.substr(at_, end - at_);
    at_ = end + (!cr_alone_ && input_.bytes.substr(end).starts_with("\r\n") ? 2 : 1);
    ++line_;
    return text;
  }

  size_t at() const { return at_; }

  [[noreturn]] void fail(const std::string& reason) const {
    input_.fail(Status::malformed_mesh, fmt::format("line {} of the PLY header {}", line_, reason));
  }

 private:
  const Input& input_;
  bool cr_alone_ = false;
  size_t at_ = 0;
  uint64_t line_ = 0;
};

PlyElement parse_element(TextCursor& words, const HeaderLines& lines) {
  PlyElement element;
  element.name = words.word();
  int64_t count = 0;
  if (element.name.empty() || !parse_integer(words.word(), count) || count < 0) {
    lines.fail("does not give an element's name and count");
  }
  element.count = static_cast<uint64_t>(count);
  using Kind = PlyElement::Kind;
  element.kind = element.name == "vertex"      ? Kind::vertex
                 : element.name == "face"      ? Kind::face
                 : element.name == "tristrips" ? Kind::strip
                                               : Kind::other;
  return element;
}

PlyProperty::Role role_of(const PlyElement& element, const PlyProperty& property, std::string_view name) {
  using Role = PlyProperty::Role;
  if (element.kind == PlyElement::Kind::vertex && !property.is_list) {
    if (name == "x") return Role::x;
    if (name == "y") return Role::y;
    if (name == "z") return Role::z;
    if (name == "red") return Role::red;
    if (name == "green") return Role::green;
    if (name == "blue") return Role::blue;
  }
  if (element.kind != PlyElement::Kind::vertex && element.kind != PlyElement::Kind::other &&
      property.is_list && (name == "vertex_indices" || name == "vertex_index")) {
    return Role::corners;
  }
  return Role::skip;
}

void parse_property(TextCursor& words, const HeaderLines& lines, PlyHeader& header) {
  if (header.elements.empty()) lines.fail("gives a property before any element");
  PlyElement& element = header.elements.back();
  PlyProperty property;
  std::string_view type = words.word();
  if (type == "list") {
    property.is_list = true;
    const auto count_type = type_named(words.word());
    if (!count_type || !is_integer(*count_type)) lines.fail("gives a list whose count has no integer type");
    property.count_type = *count_type;
    type = words.word();
  }
  const auto known = type_named(type);
  const std::string_view name = words.word();
  if (!known || name.empty()) lines.fail("gives a property without a known type and a name");
  property.type = *known;
  property.role = role_of(element, property, name);
  if (property.role == PlyProperty::Role::corners && !is_integer(property.type)) {
    lines.fail("gives vertex indices that are not integers");
  }
  if (property.is_list) element.lists.emplace_back(name);
  element.properties.push_back(property);
}

/// Refuses a header without corners of faces, and names the lists that it has instead.
void check_corners(const Input& input, const PlyHeader& header) {
  std::vector<std::string> lists;
  for (const PlyElement& element : header.elements) {
    if (std::ranges::count(element.properties, PlyProperty::Role::corners, &PlyProperty::role) != 0) return;
    for (const std::string& list : element.lists)
      if (lists.size() < kMostNotes)
        lists.push_back(fmt::format("'{}' in '{}'", clean_name(list.substr(0, 40)),
                                    clean_name(element.name.substr(0, 40))));
  }
  input.fail(
      Status::no_triangles,
      fmt::format(
          "has no triangles: the PLY header has no list 'vertex_indices' or 'vertex_index' in an "
          "element 'face' or 'tristrips', {}",
          lists.empty() ? std::string("and no other list") : fmt::format("but {}", fmt::join(lists, ", "))));
}

void check_elements(const Input& input, PlyHeader& header) {
  uint64_t left = input.bytes.size() - header.body;
  bool seen_vertices = false;
  for (PlyElement& element : header.elements) {
    for (const PlyProperty& p : element.properties) {
      // A number in a text file takes a digit and, except for the last one, a space.
      element.min_bytes +=
          header.format == PlyHeader::Format::text ? 2 : ply_size(p.is_list ? p.count_type : p.type);
    }
    const uint64_t slack = header.format == PlyHeader::Format::text ? 1 : 0;
    if (element.min_bytes != 0 && element.count > (left + slack) / element.min_bytes) {
      input.fail(
          Status::file_truncated,
          fmt::format("the PLY header announces {} elements '{}' of at least {} bytes, but {} bytes follow",
                      element.count, element.name, element.min_bytes, left));
    }
    left -= std::min(left, element.count * element.min_bytes);
    const auto has = [&](PlyProperty::Role role) {
      return std::ranges::count(element.properties, role, &PlyProperty::role);
    };
    using Role = PlyProperty::Role;
    if (element.kind == PlyElement::Kind::vertex) {
      if (seen_vertices) input.fail(Status::malformed_mesh, "the PLY header has two elements 'vertex'");
      seen_vertices = true;
      if (has(Role::x) != 1 || has(Role::y) != 1 || has(Role::z) != 1) {
        input.fail(Status::malformed_mesh, "the PLY header does not give each vertex one x, y and z");
      }
      // Colours are read only if requested and complete.
      if (!input.limits.colors || has(Role::red) != 1 || has(Role::green) != 1 || has(Role::blue) != 1)
        for (PlyProperty& p : element.properties)
          if (p.role >= Role::red && p.role <= Role::blue) p.role = Role::skip;
      if (element.count > std::numeric_limits<uint32_t>::max()) {
        input.fail(Status::too_large,
                   fmt::format("has {} vertices, more than 32-bit indices can address", element.count));
      }
    } else if (has(Role::corners) > 1) {
      input.fail(Status::malformed_mesh,
                 fmt::format("the PLY element '{}' has two lists of vertices", element.name));
    }
  }
  if (!seen_vertices) input.fail(Status::malformed_mesh, "the PLY header has no element 'vertex'");
}

}  // namespace

uint32_t ply_size(PlyType type) {
  static constexpr std::array<uint32_t, 8> kSizes{1, 1, 2, 2, 4, 4, 4, 8};
  return kSizes[static_cast<size_t>(type)];
}

PlyHeader read_ply_header(const Input& input) {
  if (!input.bytes.starts_with("ply") && !input.bytes.starts_with("PLY")) {
    input.fail(Status::not_a_mesh, "is taken for PLY, but does not start with 'ply'");
  }
  HeaderLines lines(input);
  lines.next();
  PlyHeader header;
  bool has_format = false;
  for (;;) {
    TextCursor words(lines.next());
    const std::string_view keyword = words.word();
    if (keyword == "end_header") break;
    if (keyword == "format") {
      const std::string_view format = words.word();
      has_format = true;
      if (format == "ascii") {
        header.format = PlyHeader::Format::text;
      } else if (format == "binary_little_endian") {
        header.format = PlyHeader::Format::little_endian;
      } else if (format == "binary_big_endian") {
        header.format = PlyHeader::Format::big_endian;
      } else {
        lines.fail(fmt::format("gives the unknown format '{}'", format.substr(0, 40)));
      }
    } else if (keyword == "element") {
      header.elements.push_back(parse_element(words, lines));
    } else if (keyword == "property") {
      parse_property(words, lines, header);
    } else if (!keyword.empty() && keyword != "comment" && keyword != "obj_info") {
      lines.fail(fmt::format("has the unknown keyword '{}'", keyword.substr(0, 40)));
    }
  }
  if (!has_format) input.fail(Status::malformed_mesh, "the PLY header has no 'format' line");
  header.body = lines.at();
  check_elements(input, header);
  check_corners(input, header);
  return header;
}

}  // namespace nif::mesh::detail
