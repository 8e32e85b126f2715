// Writes grids with planes: of any encoding that has one.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <utility>
#include <vector>

#include "formats/nif/proof/coded_occupancy.hpp"
#include "formats/nif/proof/data.hpp"
#include "formats/nif/sections.hpp"

namespace nif::format {

/// A coded payload; without bytes where it has to be uncoded.
using Coded = std::vector<std::byte>;

/// Nothing where it is no smaller than `bytes`.
inline Coded if_smaller(Coded coded, uint64_t bytes) {
  return coded.size() < bytes ? std::move(coded) : Coded();
}

/// Whether a decoded array is what was to be coded.
template <class T>
bool equal(const T* coded, const std::vector<T>& data) {
  return data.empty() || std::memcmp(coded, data.data(), data.size() * sizeof(T)) == 0;
}

/// Whether a reader would take the numbers and the bricks of a grid.
bool grid_in_order(const ProofData& data, const kernels::ProofField& field);

/// Of a grid that is in order; `bytes` has the whole payload uncoded. Nothing unless same(arrays) says of
/// those arrays beyond the grid's own that decoding makes the same.
template <class Same>
Coded encode_occupancy(const ProofData& data, const kernels::ProofField& field, Corners corners,
                       const uint64_t* true_corners, uint64_t bytes, const Same& same) {
  std::vector<uint64_t> memory(memory_size((bytes + 7) / 8));
  const OccupancyArrays<std::byte> to(reinterpret_cast<std::byte*>(memory.data()), field.mixed_bricks,
                                      corners != Corners::none);
  RangeEncoder encoder;
  if (!OccupancyCoder(encoder, field, to).code(&field, corners, true_corners) ||
      !equal(to.brick_states, data.brick_states) || !equal(to.voxel_base, data.voxel_base) ||
      !equal(to.brick_table, data.brick_table) || !same(to))
    return {};
  return if_smaller(encoder.finish(), bytes);
}

/// The payloads of a grid without features, those coded that `data.coded` names, as long as the reader takes
/// them and they become smaller.
struct CodedGrid {
  uint32_t forms = 0;  ///< PayloadForm: which there are, and how
  Coded occupancy, cells;

  explicit CodedGrid(const ProofData& data);
};

/// Writes the payloads of a grid without features, and says in its record what they are.
template <class Record>
void add_grid(const ProofData& grid, Section& occupancy, Section& cells, Record& record) {
  std::copy(grid.origin.begin(), grid.origin.end(), record.origin);
  record.voxels_per_unit = grid.voxels_per_unit;
  std::copy(grid.voxels.begin(), grid.voxels.end(), record.voxels);
  record.levels = grid.levels;
  record.mixed_bricks = uint32_t(grid.brick_states.size());
  record.surface_voxels = uint32_t(grid.voxel_records.size());
  record.part_count = uint32_t(grid.parts.size());

  const CodedGrid coded(grid);
  record.forms = coded.forms;
  record.occupancy = occupancy.begin_payload();
  if (coded.forms & kCodedOccupancy) {
    occupancy.append(coded.occupancy);
  } else {
    occupancy.append(grid.brick_states);
    occupancy.append(grid.voxel_base);
    occupancy.append(grid.brick_table);
  }
  occupancy.end_payload(record.occupancy);
  record.cells = cells.begin_payload();
  if (coded.forms & kCodedCells) {
    cells.append(coded.cells);
  } else {
    cells.append(grid.voxel_records);
    cells.append(grid.parts);
  }
  cells.end_payload(record.cells);
}

/// Of a grid that is in order; nothing where its words are not. `forms` is what a file says of them then.
Coded encode_cells(const kernels::ProofField& field, uint32_t& forms);

}  // namespace nif::format
