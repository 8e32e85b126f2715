// The planes part as files store it: an occupancy grid, and what is known within its surface voxels.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "formats/nif/layout.hpp"
#include "formats/nif/part_bytes.hpp"
#include "formats/nif/records.hpp"
#include "formats/nif/sections.hpp"
#include "kernels/reference/planes/planes_field.hpp"

namespace nif::format {

struct Asset;
struct AssetView;
struct Object;
struct ObjectView;

inline constexpr uint32_t kPlanes = fourcc("PLAN");  ///< PlanesRecord[]

/// How the payloads are stored, as bits. Coded payloads (docs/format.md) are decoded to their uncoded form
/// when a file is read.
enum PlanesForm : uint32_t {
  kCodedOccupancy = 1,
  kCodedCells = 2,
  kCodedPlanes = 3,  ///< both
  kStatedKinds = 4,  ///< with kCodedCells: kinds do not say all that is proven of sides
  kPlanesForms = 7   ///< all bits
};

struct PlanesRecord {  // 96 bytes: the members of kernels::PlanesField with the same names
  float origin[3];
  float voxels_per_unit;
  uint32_t voxels[3];
  uint32_t levels;
  uint32_t mixed_bricks;
  uint32_t surface_voxels;
  uint32_t child_count;
  uint32_t forms;     ///< PlanesForm
  Payload occupancy;  ///< brick_states, voxel_base, brick_table, in that order, without gaps
  Payload cells;      ///< voxel_records, children, in that order, without gaps
};
static_assert(sizeof(PlanesRecord) == 96);

/// The planes of one object; members as in kernels::PlanesField.
struct PlanesData {
  std::array<float, 3> origin{};
  float voxels_per_unit = 0;
  uint32_t levels = 0;
  std::array<uint32_t, 3> voxels{};
  std::vector<uint16_t> brick_table;
  std::vector<kernels::BrickStates> brick_states;
  std::vector<uint32_t> voxel_base;
  std::vector<uint32_t> voxel_records;
  std::vector<uint32_t> children;
  uint32_t coded = 0;  ///< PlanesForm: payloads to code in a file, if that makes them smaller
};

/// Bricks along one axis that cover voxels + 1 corners.
constexpr uint32_t bricks_for(uint32_t voxels) { return voxels / kernels::kBrickSide + 1; }

/// Bytes of the payloads if none is coded.
struct UncodedPlanes {
  uint64_t bricks, occupancy, cells;

  /// From a record, or anything else with such members.
  template <class Record>
  explicit UncodedPlanes(const Record& r)
      : bricks(uint64_t{bricks_for(r.voxels[0])} * bricks_for(r.voxels[1]) * bricks_for(r.voxels[2])),
        occupancy(uint64_t{r.mixed_bricks} * (sizeof(kernels::BrickStates) + sizeof(uint32_t)) +
                  bricks * sizeof(uint16_t)),
        cells((uint64_t{r.surface_voxels} + r.child_count) * sizeof(uint32_t)) {}

  /// Whether a file may have them coded in this many bytes together: an uncoded table takes kBytesPerBrick.
  bool may_take(uint64_t bytes) const {
    constexpr uint64_t kBytesPerBrick = 2;
    return occupancy + cells <= kMostExpansion * bytes && kBytesPerBrick * bricks <= bytes;
  }
};

/// Gives every surface voxel planes that prove nothing: fills voxel_base and voxel_records from brick_states.
void leave_bare(PlanesData& data);

/// The kernels' view; valid while the data lives and does not change.
kernels::PlanesField field_of(const PlanesData& data);

/// Whether a reader would accept the numbers and the bricks.
bool in_order(const PlanesData& data);

struct PlanesView {
  kernels::PlanesField field;  ///< ready to be queried
  PayloadBytes occupancy, cells;
  uint32_t coded = 0;  ///< as in PlanesData

  std::array<PartBytes, 2> parts() const {
    return {{{"occupancy", occupancy.file, occupancy.decoded}, {"planes", cells.file, cells.decoded}}};
  }
  /// Afterwards nothing points into the file, and the field cannot be queried; its numbers stay.
  void drop_bytes();
};

/// As formats/nif/parts.hpp requires.
struct PlanesPart {
  static constexpr const char* kName = "planes";
  static constexpr uint32_t kRecords = kPlanes;
  using Record = PlanesRecord;
  using Data = PlanesData;
  using View = PlanesView;

  template <class Held>
  struct Member {
    Held planes{};
  };

  /// The member of an object's record, data or view.
  template <class Object>
  static auto& of(Object& object) {
    return object.planes;
  }
};

PlanesView read_record(const PlanesRecord& record, const ObjectView& object, const Reading& reading);
PlanesRecord write_record(const PlanesData& data, const Object& object, Section& payloads);
PlanesData to_data(const PlanesView& view);

}  // namespace nif::format
