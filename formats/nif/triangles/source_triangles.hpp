// The numbers of an object's triangles in the source mesh, in a .nif file: optional, for objects that have
// triangles.
#pragma once

#include <cstdint>
#include <memory_resource>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "formats/nif/records.hpp"
#include "formats/nif/sections.hpp"
#include "kernels/reference/triangles/source_triangles.hpp"

namespace nif::format {

/// Optional: both, or neither.
enum SourceSection : uint32_t {
  kSourceRecords = fourcc("SRCT"),  ///< SourceRecord[]
  kSourceNumbers = fourcc("SNUM"),  ///< each record's payload
};

/// Maps the triangles of an object to those of the source mesh.
struct SourceRecord {    // 32 bytes
  uint32_t object;       ///< index into kObjects; records are in the order of their objects
  uint32_t triangles;    ///< of the source mesh, before cleaning
  uint32_t reserved[2];  ///< 0
  Payload numbers;       ///< of each triangle, packed: kernels::SourceTriangles
};
static_assert(sizeof(SourceRecord) == 32);

struct SourceTriangles {
  uint32_t triangles = 0;         ///< of the source mesh, before cleaning
  std::vector<uint32_t> numbers;  ///< of each triangle of the object, in its order; below `triangles`
};

/// Size of the payload for this many numbers.
uint64_t source_bytes(uint64_t numbers, uint32_t triangles);

struct SourceTrianglesView {
  uint32_t object = 0;             ///< index into AssetView::objects
  uint32_t triangles = 0;          ///< of the source mesh, before cleaning
  uint32_t count = 0;              ///< of the object, each with a number
  kernels::SourceTriangles field;  ///< into the file
  uint64_t bytes = 0;
};

/// Reads all of a file's, in the order of their objects. `counts` has the number of triangles that each
/// object stores, or nothing if it has no triangles.
void read_source_triangles(const SectionTable& sections, bool present, std::string_view file,
                           std::span<const std::optional<uint32_t>> counts,
                           std::pmr::vector<SourceTrianglesView>& views);

class SourceTrianglesWriter {
 public:
  explicit SourceTrianglesWriter(Sections& sections);
  void add(const SourceTriangles& source, uint32_t object);

 private:
  Section *records_, *numbers_;
};

SourceTriangles to_source_triangles(const SourceTrianglesView& view);

}  // namespace nif::format
