// Reads grids with planes from a file: of any encoding that has one.
#pragma once

#include "formats/nif/proof/coded_occupancy.hpp"
#include "formats/nif/proof/data.hpp"
#include "formats/nif/records.hpp"

namespace nif::format {

/// Checks the numbers of a grid, and sets those of `field`.
template <class Record>
void read_grid_numbers(const Record& record, const Place& place, kernels::ProofField& field) {
  place.require(all_finite(record.origin), Rule::origin_not_finite);
  place.require(std::isfinite(record.voxels_per_unit) && record.voxels_per_unit > 0, Rule::voxels_per_unit);
  std::copy_n(record.origin, 3, field.origin);
  place.within(record.levels, 0, kernels::kMaxLevels, "levels", Rule::levels_range);
  set_scales(record.voxels_per_unit, record.levels, field);
  place.require(std::isfinite(field.cells_per_unit), Rule::voxels_per_unit_large);
  for (int a = 0; a < 3; ++a) {
    place.within(record.voxels[a], 1, std::min(kernels::kMaxVoxels, kernels::kMaxCells >> record.levels),
                 "voxels", Rule::voxels_range);
    field.voxels[a] = record.voxels[a];
    field.bricks[a] = bricks_for(record.voxels[a]);
  }
  // The table's entries have 16 bits, which limits the mixed bricks and with them the corners.
  place.within(record.mixed_bricks, 0, 0xffff - kernels::kFirstMixedBrick + 1, "mixed_bricks",
               Rule::mixed_bricks_range);
  place.within(record.part_count, 0, kernels::kMaxParts, "part_count", Rule::part_count_range);
  field.mixed_bricks = record.mixed_bricks;
  field.surface_voxels = record.surface_voxels;
  field.part_count = record.part_count;
}

/// The next payload, of which an object's `forms` say whether it is coded. `bytes`: uncoded.
Bytes take_payload(Payloads& payloads, const Payload& payload, uint32_t forms, PayloadForm form,
                   uint64_t bytes, const char* name, const Place& place);

/// Payloads of one object on their way to be usable.
struct PayloadPlace {
  uint32_t forms;  ///< PayloadForm
  const Place& place;
  DecodedPayloads& decoded;

  /// Where the payload is as a field uses it: in the file, or in memory that decode(memory) has filled.
  /// `bytes` is how many it has there.
  template <class Decode>
  const std::byte* usable(Bytes payload, PayloadForm form, uint64_t bytes, const char* name,
                          PayloadBytes& taken, const Decode& decode) const {
    taken.file = payload.size();
    if ((forms & form) == 0) return payload.data();
    std::byte* const to = decoded.add(bytes, taken);
    if (!decode(to))
      place.damaged(Rule::not_as_encoded, std::string(name) + " payload is not what an encoder makes");
    return to;
  }
};

/// Sets the arrays of `field`; its numbers are set. `bytes`: of the whole payload where it is not coded;
/// `corners`: whether features have some, which are the caller's to look at in what it returns.
OccupancyArrays<const std::byte> read_occupancy(Bytes payload, Corners corners, uint64_t bytes,
                                                const PayloadPlace& at, PayloadBytes& taken,
                                                kernels::ProofField& field);
/// Sets the words of `field`; its occupancy is set and checked.
void read_cells(Bytes payload, const PayloadPlace& at, PayloadBytes& taken, kernels::ProofField& field);

/// A grid without features on its way from a file: its payloads are taken before there is memory for what
/// they decode to.
class GridReading {
 public:
  /// Checks the numbers of a grid, and sets those of `field`.
  template <class Record>
  GridReading(const Record& record, Payloads& occupancy, Payloads& cells, const Place& place,
              kernels::ProofField& field)
      : forms_(record.forms), uncoded_(record), place_(place), field_(field) {
    place.require((forms_ & ~kProofForms) == 0, Rule::unknown_forms);
    place.require((forms_ & kCodedCells) != 0 || (forms_ & kStatedKinds) == 0, Rule::kinds_not_coded);
    read_grid_numbers(record, place, field);
    occupancy_ = take_payload(occupancy, record.occupancy, forms_, kCodedOccupancy, uncoded_.occupancy,
                              "occupancy", place);
    cells_ = take_payload(cells, record.cells, forms_, kCodedCells, uncoded_.cells, "cells", place);
    place.require(coded() == 0 || uncoded_.may_take(occupancy_.size() + cells_.size()), Rule::decoded_size);
  }

  uint32_t coded() const { return forms_ & kCodedPayloads; }
  /// Sets the arrays of the field.
  void read(DecodedPayloads& decoded, PayloadBytes& occupancy, PayloadBytes& cells) const {
    const PayloadPlace at{forms_, place_, decoded};
    read_occupancy(occupancy_, Corners::none, uncoded_.occupancy, at, occupancy, field_);
    read_cells(cells_, at, cells, field_);
  }

 private:
  uint32_t forms_;
  UncodedGrid uncoded_;
  const Place& place_;
  kernels::ProofField& field_;
  Bytes occupancy_, cells_;
};

}  // namespace nif::format
