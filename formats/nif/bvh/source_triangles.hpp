// The numbers that an object's triangles have in the source mesh, in a .nif file: optional, for objects with
// a BVH, of any encoding.
#pragma once

#include <cstdint>
#include <memory_resource>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "formats/nif/records.hpp"
#include "formats/nif/sections.hpp"
#include "kernels/reference/bvh/source_triangles.hpp"

namespace nif::format {

struct SourceTriangles {
  uint32_t triangles = 0;         ///< of the source mesh, before cleaning
  std::vector<uint32_t> numbers;  ///< of each triangle of the object, in its order; below `triangles`
};

/// Of the payload that holds so many numbers in a file.
uint64_t source_bytes(uint64_t numbers, uint32_t triangles);

struct SourceTrianglesView {
  uint32_t object = 0;             ///< index into AssetView::objects
  uint32_t triangles = 0;          ///< of the source mesh, before cleaning
  uint32_t count = 0;              ///< of the object, each with a number
  kernels::SourceTriangles field;  ///< into the file
  uint64_t bytes = 0;
};

/// Reads all of a file's, in the order of their objects. `counts` has the triangles that each object stores;
/// none where its encoding has no BVH.
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
