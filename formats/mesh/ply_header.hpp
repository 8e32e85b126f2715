// Parses the header of a PLY file: the elements that follow, their number, and their layout.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "formats/mesh/input.hpp"

namespace nif::mesh::detail {

enum class PlyType : uint8_t { i8, u8, i16, u16, i32, u32, f32, f64 };

uint32_t ply_size(PlyType type);

struct PlyProperty {
  enum class Role : uint8_t { skip, x, y, z, red, green, blue, corners };
  Role role = Role::skip;
  PlyType type = PlyType::f32;
  bool is_list = false;
  PlyType count_type = PlyType::u8;  ///< of a list
};

struct PlyElement {
  enum class Kind : uint8_t { vertex, face, strip, other };
  Kind kind = Kind::other;
  std::string name;
  uint64_t count = 0;
  std::vector<PlyProperty> properties;
  std::vector<std::string> lists;  ///< names of the properties that are lists
  uint64_t min_bytes = 0;          ///< of one element: exact in binary files without lists
};

struct PlyHeader {
  enum class Format : uint8_t { text, little_endian, big_endian };
  Format format = Format::text;
  std::vector<PlyElement> elements;
  size_t body = 0;  ///< byte offset of the elements
};

/// Throws not_a_mesh, file_truncated, malformed_mesh or too_large. The counts are checked against the bytes
/// that follow, so that memory for them can be reserved safely.
PlyHeader read_ply_header(const Input& input);

}  // namespace nif::mesh::detail
