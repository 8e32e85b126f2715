// Colours of surface voxels in a .nif file: optional, for objects with planes.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "formats/nif/records.hpp"
#include "formats/nif/sections.hpp"

namespace nif::format {

struct Object;
struct ObjectView;

/// Optional: both, or neither.
enum ColorSection : uint32_t {
  kColorRecords = fourcc("COLR"),  ///< ColorsRecord[]
  kColorValues = fourcc("CVAL"),   ///< each record's payload
};

/// The mean base colours of an object's surface, voxel by voxel.
struct ColorsRecord {       // 40 bytes
  uint32_t object;          ///< index into kObjects; records are in the order of their objects
  uint32_t surface_voxels;  ///< of the object
  uint32_t reserved[2];     ///< 0
  Payload values;           ///< 16 bits for each surface voxel: kernels::VoxelColors
};
static_assert(sizeof(ColorsRecord) == 40);

/// [surface voxel, in the order of PlanesData::voxel_records] as in kernels::VoxelColors.
using Colors = std::vector<uint16_t>;

struct ColorsView {
  uint32_t object = 0;               ///< index into AssetView::objects
  uint32_t count = 0;                ///< of the object's surface voxels
  const uint16_t* values = nullptr;  ///< into the file

  uint64_t bytes() const { return uint64_t{count} * sizeof(*values); }
};

std::optional<ColorsView> read_record(const ColorsRecord& record, const ObjectView& object,
                                      const Reading& reading);
inline Colors to_colors(const ColorsView& view) { return {view.values, view.values + view.count}; }

/// As formats/nif/optional.hpp requires.
struct ColorsRecords {
  static constexpr uint32_t kRecords = kColorRecords, kValues = kColorValues;
  static constexpr Rule kOrder = Rule::optional_order;
  using Record = ColorsRecord;

  static uint64_t rank(const Record& record) { return record.object; }
  template <class Asset>
  static auto& of(Asset& asset) {
    return asset.colors;
  }
  static bool has(const Object& object);
  static std::vector<Record> write(const Object& object, uint32_t number, Section& payloads);
};

}  // namespace nif::format
