// The triangles part as files store it: a compressed wide BVH over exact triangles.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "formats/nif/layout.hpp"
#include "formats/nif/part_bytes.hpp"
#include "formats/nif/records.hpp"
#include "formats/nif/sections.hpp"
#include "kernels/reference/triangles/triangles_field.hpp"

namespace nif::format {

struct Asset;
struct AssetView;
struct Object;
struct ObjectView;

inline constexpr uint32_t kTriangles = fourcc("TRIS");  ///< TrianglesRecord[]

struct TrianglesRecord {  // 40 bytes: the members of kernels::TrianglesField
  uint32_t nodes, vertices, triangles;
  uint32_t reserved;  ///< 0
  Payload tree;       ///< nodes, vertices, triangles, in that order, without gaps
};
static_assert(sizeof(TrianglesRecord) == 40);

/// The triangles of one object; members as in kernels::TrianglesField.
struct TrianglesData {
  std::vector<kernels::BvhNode> nodes;
  std::vector<std::array<float, 3>> vertices;
  std::vector<std::array<uint8_t, 3>> triangles;

  /// Size of the payload in a file.
  uint64_t bytes() const {
    return nodes.size() * sizeof(nodes[0]) + vertices.size() * sizeof(vertices[0]) +
           triangles.size() * sizeof(triangles[0]);
  }
};

/// The kernels' view; valid while the data lives and does not change.
kernels::TrianglesField field_of(const TrianglesData& data);

struct TrianglesView {
  kernels::TrianglesField field;  ///< ready to be queried
  uint64_t tree_bytes = 0;

  std::array<PartBytes, 1> parts() const { return {{{"bvh", tree_bytes}}}; }
  void drop_bytes() { *this = {}; }
};

/// As formats/nif/parts.hpp requires.
struct TrianglesPart {
  static constexpr const char* kName = "triangles";
  static constexpr uint32_t kRecords = kTriangles;
  using Record = TrianglesRecord;
  using Data = TrianglesData;
  using View = TrianglesView;

  template <class Held>
  struct Member {
    Held triangles{};
  };

  template <class Object>
  static auto& of(Object& object) {
    return object.triangles;
  }
};

/// If the object has planes, they must be near the triangles.
TrianglesView read_record(const TrianglesRecord& record, const ObjectView& object, const Reading& reading);
TrianglesRecord write_record(const TrianglesData& data, const Object& object, Section& payloads);
TrianglesData to_data(const TrianglesView& view);

}  // namespace nif::format
