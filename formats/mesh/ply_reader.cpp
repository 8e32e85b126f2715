// PLY, text and binary, in any layout of properties that the header describes.
//
// This is our own code, because the reader of OpenMesh 9 cannot be made safe from outside. It assumes that
// the list of corners is a face's first and only list: the "texcoord" list that MeshLab adds silently shifts
// everything after it. It loses the first byte of binary data if the header ends in a comment, crashes if a
// property precedes the first element, reads for ever if 'end_header' is missing, and keeps its state in
// globals.
#include <fmt/format.h>

#include <bit>
#include <cstring>
#include <limits>

#include "formats/mesh/chooser.hpp"
#include "formats/mesh/far_from_origin.hpp"
#include "formats/mesh/ply_header.hpp"
#include "formats/mesh/readers.hpp"
#include "formats/mesh/text_cursor.hpp"

namespace nif::mesh::detail {
namespace {

/// Reports the element at which a body ends early or is inconsistent.
struct Place {
  const Input& input;
  const PlyElement* element = nullptr;
  uint64_t index = 0;

  [[noreturn]] void fail(Status status, const std::string& reason) const {
    input.fail(status, fmt::format("'{}' {} of {} {}", element->name, index, element->count, reason));
  }
  [[noreturn]] void fail_truncated() const {
    fail(Status::file_truncated, "is cut off: the file ends there");
  }
};

class TextBody {
 public:
  explicit TextBody(const Place& place, size_t start)
      : place_(place), words_(place.input.bytes.substr(start)) {}

  /// If `exact` is not null, it receives the value before rounding.
  float real(PlyType, double* exact = nullptr) {
    float value = 0;
    const std::string_view word = next();
    if (!parse_float(word, value)) fail_word(word);
    if (exact) parse_double(word, *exact);
    return value;
  }
  int64_t integer(PlyType) {
    int64_t value = 0;
    const std::string_view word = next();
    if (!parse_integer(word, value)) fail_word(word);
    return value;
  }
  void skip(PlyType, uint64_t count) {
    for (; count != 0; --count) next();
  }
  /// An upper bound of the number of values that can follow.
  uint64_t values_left(PlyType) const { return words_.bytes_left(); }

 private:
  std::string_view next() {
    const std::string_view word = words_.word();
    if (word.empty()) place_.fail_truncated();
    return word;
  }
  [[noreturn]] void fail_word(std::string_view word) const {
    if (words_.at_end()) place_.fail_truncated();  // within a word
    place_.fail(Status::malformed_mesh,
                fmt::format("has '{}' where a number is expected", word.substr(0, 40)));
  }

  const Place& place_;
  TextCursor words_;
};

template <bool kSwap>
class BinaryBody {
 public:
  explicit BinaryBody(const Place& place, size_t start)
      : place_(place),
        at_(place.input.bytes.data() + start),
        end_(place.input.bytes.data() + place.input.bytes.size()) {}

  float real(PlyType type, double* exact = nullptr) {
    switch (type) {
      case PlyType::f32:
        return round_to_float(take<float>(), exact);
      case PlyType::f64:
        return round_to_float(take<double>(), exact);
      default:
        return round_to_float(integer(type), exact);
    }
  }
  int64_t integer(PlyType type) {
    switch (type) {
      case PlyType::i8:
        return take<int8_t>();
      case PlyType::u8:
        return take<uint8_t>();
      case PlyType::i16:
        return take<int16_t>();
      case PlyType::u16:
        return take<uint16_t>();
      case PlyType::i32:
        return take<int32_t>();
      case PlyType::u32:
        return take<uint32_t>();
      default:
        place_.fail(Status::malformed_mesh, "has a real number where an integer is expected");
    }
  }
  void skip(PlyType type, uint64_t count) {
    if (values_left(type) < count) place_.fail_truncated();
    at_ += count * ply_size(type);
  }
  uint64_t values_left(PlyType type) const { return static_cast<uint64_t>(end_ - at_) / ply_size(type); }

 private:
  template <class T>
  static float round_to_float(T value, double* exact) {
    if (exact) *exact = static_cast<double>(value);
    return static_cast<float>(value);
  }
  template <class T>
  T take() {
    if (static_cast<size_t>(end_ - at_) < sizeof(T)) place_.fail_truncated();
    std::array<char, sizeof(T)> raw;
    for (size_t i = 0; i < sizeof(T); ++i) raw[kSwap ? sizeof(T) - 1 - i : i] = at_[i];
    at_ += sizeof(T);
    return std::bit_cast<T>(raw);
  }

  const Place& place_;
  const char* at_;
  const char* end_;
};

class BodyReader {
 public:
  BodyReader(Place& place, Mesh& mesh, FaceSink& faces, uint64_t vertices)
      : place_(place), mesh_(mesh), faces_(faces), vertices_(vertices), exact_(place.input.exact) {}

  template <class Body>
  void read(Body body, const std::vector<PlyElement>& elements) {
    for (const PlyElement& element : elements) {
      if (element.properties.empty()) continue;  // takes no bytes, whatever its count
      place_.element = &element;
      for (place_.index = 0; place_.index < element.count; ++place_.index) read_element(body, element);
    }
  }

 private:
  template <class Body>
  void read_element(Body& body, const PlyElement& element) {
    Float3 position{}, color{};
    Double3 exact{};
    bool colored = false;
    for (const PlyProperty& p : element.properties) {
      if (p.is_list) {
        const int64_t count = body.integer(p.count_type);
        if (count < 0) place_.fail(Status::malformed_mesh, fmt::format("has a list of {} entries", count));
        if (p.role == PlyProperty::Role::corners) {
          read_corners(body, p.type, static_cast<uint64_t>(count), element.kind);
        } else {
          body.skip(p.type, static_cast<uint64_t>(count));
        }
      } else if (p.role == PlyProperty::Role::skip) {
        body.skip(p.type, 1);
      } else if (p.role >= PlyProperty::Role::red) {
        const float value = body.real(p.type) / largest_of(p.type);
        color[static_cast<size_t>(p.role) - static_cast<size_t>(PlyProperty::Role::red)] =
            static_cast<float>(linear_of(double(value)));
        colored = true;
      } else {
        const size_t axis = static_cast<size_t>(p.role) - static_cast<size_t>(PlyProperty::Role::x);
        position[axis] = body.real(p.type, exact_ ? &exact[axis] : nullptr);
      }
    }
    if (element.kind != PlyElement::Kind::vertex) return;
    if (colored) mesh_.look.set_color(mesh_.positions.size(), color);
    mesh_.positions.push_back(position);
    if (exact_) mesh_.exact.push_back(exact);
  }

  /// The value of a full colour component; colours are sRGB, as programs write them.
  static float largest_of(PlyType type) {
    switch (type) {
      case PlyType::i8:
      case PlyType::u8:
        return 255;
      case PlyType::i16:
      case PlyType::u16:
        return 65535;
      case PlyType::i32:
      case PlyType::u32:
        return 4294967295.0f;
      default:
        return 1;
    }
  }

  template <class Body>
  void read_corners(Body& body, PlyType type, uint64_t count, PlyElement::Kind kind) {
    if (body.values_left(type) < count) place_.fail_truncated();
    corners_.clear();
    for (; count != 0; --count) {
      const int64_t v = body.integer(type);
      if (kind == PlyElement::Kind::strip && v == -1) {
        add_strip();
        continue;
      }
      if (v < 0 || static_cast<uint64_t>(v) >= vertices_) {
        place_.fail(Status::index_out_of_range,
                    fmt::format("uses vertex {}, but there are only {}", v, vertices_));
      }
      corners_.push_back(static_cast<uint32_t>(v));
    }
    kind == PlyElement::Kind::strip ? add_strip() : faces_.polygon(corners_);
  }

  /// A strip is a sequence of triangles, every second of them reversed; -1 starts a new one.
  void add_strip() {
    for (size_t i = 2; i < corners_.size(); ++i) {
      const std::array<uint32_t, 3> triangle{corners_[i - 2 + i % 2], corners_[i - 1 - i % 2], corners_[i]};
      // Strips are connected by triangles that use a vertex twice; these are not part of the surface.
      if (triangle[0] == triangle[1] || triangle[1] == triangle[2] || triangle[2] == triangle[0]) continue;
      faces_.polygon(triangle);
    }
    corners_.clear();
  }

  Place& place_;
  Mesh& mesh_;
  FaceSink& faces_;
  uint64_t vertices_;
  bool exact_;
  std::vector<uint32_t> corners_;
};

/// Whether positions may be numbers that are not floats.
bool rounds(const PlyHeader& header) {
  if (header.format == PlyHeader::Format::text) return true;
  for (const PlyElement& element : header.elements)
    for (const PlyProperty& p : element.properties)
      if (p.role >= PlyProperty::Role::x && p.role <= PlyProperty::Role::z && p.type >= PlyType::i32 &&
          p.type != PlyType::f32)
        return true;
  return false;
}

Scene read_body(const Input& input, const PlyHeader& header) {
  Mesh mesh;
  mesh.name = input.stem;
  uint64_t vertices = 0;
  for (const PlyElement& element : header.elements) {
    if (element.kind == PlyElement::Kind::vertex) {
      vertices = element.count;
      mesh.positions.reserve(element.count);
    } else if (element.kind == PlyElement::Kind::face) {
      check_triangle_limit(input, element.count);
      mesh.triangles.reserve(element.count);
    }
  }

  Place place{input};
  FaceSink faces(input, mesh);
  BodyReader reader(place, mesh, faces, vertices);
  static_assert(std::endian::native == std::endian::little);
  switch (header.format) {
    case PlyHeader::Format::text:
      reader.read(TextBody(place, header.body), header.elements);
      break;
    case PlyHeader::Format::little_endian:
      reader.read(BinaryBody<false>(place, header.body), header.elements);
      break;
    case PlyHeader::Format::big_endian:
      reader.read(BinaryBody<true>(place, header.body), header.elements);
      break;
  }

  Scene scene;
  faces.settle(scene, [&](uint64_t) { return std::string_view(mesh.name); });
  std::vector<Mesh> meshes;
  meshes.push_back(std::move(mesh));
  return scene_of(std::move(meshes), std::move(scene));
}

}  // namespace

Scene read_ply(const Input& input) {
  refuse_choice(input);
  const PlyHeader header = read_ply_header(input);
  const auto read = [&](const Input& given) { return read_body(given, header); };
  return rounds(header) ? read_exactly(input, read) : read(input);
}

}  // namespace nif::mesh::detail
