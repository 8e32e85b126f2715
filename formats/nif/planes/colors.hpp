// Colours of surface voxels in a .nif file: optional, for objects with planes.
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

/// Optional: both, or neither.
enum ColorSection : uint32_t {
  kColorRecords = fourcc("COLR"),  ///< ColorsRecord[]
  kColorValues = fourcc("CVAL"),   ///< each record's payload
};

/// The mean base colours of an object's surface, voxel by voxel.
struct ColorsRecord {       // 32 bytes
  uint32_t object;          ///< index into kObjects; records are in the order of their objects
  uint32_t surface_voxels;  ///< of the object
  uint32_t reserved[2];     ///< 0
  Payload values;           ///< 16 bits for each surface voxel: kernels::VoxelColors
};
static_assert(sizeof(ColorsRecord) == 32);

/// [surface voxel, in the order of PlanesData::voxel_records] as in kernels::VoxelColors.
using Colors = std::vector<uint16_t>;

struct ColorsView {
  uint32_t object = 0;               ///< index into AssetView::objects
  uint32_t count = 0;                ///< of the object's surface voxels
  const uint16_t* values = nullptr;  ///< into the file

  uint64_t bytes() const { return uint64_t{count} * sizeof(*values); }
};

/// Reads all colours of a file, in the order of their objects. `counts` has the surface voxels of each
/// object, or nothing if it has no planes.
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
