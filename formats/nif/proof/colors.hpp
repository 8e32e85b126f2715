// Colours of surface voxels in a .nif file: optional, for objects with a grid, of any encoding.
#pragma once

#include <cstdint>
#include <memory_resource>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "formats/nif/records.hpp"
#include "formats/nif/sections.hpp"

namespace nif::format {

/// [surface voxel, in the order of ProofData::voxel_records] as kernels::VoxelColors has them.
using Colors = std::vector<uint16_t>;

struct ColorsView {
  uint32_t object = 0;               ///< index into AssetView::objects
  uint32_t count = 0;                ///< of the object's surface voxels
  const uint16_t* values = nullptr;  ///< into the file

  uint64_t bytes() const { return uint64_t{count} * sizeof(*values); }
};

/// Reads all of a file's, in the order of their objects. `counts` has the surface voxels of each object; none
/// where its encoding has no grid.
void read_colors(const SectionTable& sections, bool present, std::string_view file,
                 std::span<const std::optional<uint32_t>> counts, std::pmr::vector<ColorsView>& views);

class ColorsWriter {
 public:
  explicit ColorsWriter(Sections& sections);
  void add(const Colors& colors, uint32_t object);

 private:
  Section *records_, *values_;
};

inline Colors to_colors(const ColorsView& view) { return {view.values, view.values + view.count}; }

}  // namespace nif::format
