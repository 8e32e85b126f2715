// Reads `exact` objects: a grid as `proof` has it, and a BVH. Each is checked by itself first, then both
// together: the tree must lie near the grid, and neither too far out for the arithmetic of the walk.
#include "formats/nif/bvh/read.hpp"
#include "formats/nif/exact/encoding.hpp"
#include "formats/nif/proof/read.hpp"

namespace nif::format {
namespace {

/// Is the BVH within the grid, and both where the walk and the BVH take the same rays?
std::optional<Rule> fault_of(const kernels::ExactField& field) {
  const kernels::ProofField& grid = field.proof;
  const kernels::BvhNode& root = field.bvh.nodes[0];
  if (!(field.bvh.extent <= 2 * kernels::kMaxExactCoordinate)) return Rule::tree_far;
  const float cell = 1 / grid.cells_per_unit;
  for (int a = 0; a < 3; ++a) {
    const float side = static_cast<float>(grid.voxels[a]) / grid.voxels_per_unit;
    const float low = grid.origin[a], high = low + side;
    if (!(low >= -2 * kernels::kMaxExactCoordinate && high <= 2 * kernels::kMaxExactCoordinate))
      return Rule::grid_far;
    for (uint32_t s = 0; s < kernels::kBvhWidth && root.slots[s] != 0; ++s)
      if (!(kernels::frame_plane(root.frame[a], root.low[a][s]) >= low - side - cell) ||
          !(kernels::frame_plane(root.frame[a], root.high[a][s]) <= high + side + cell))
        return Rule::tree_and_grid;
  }
  return std::nullopt;
}

}  // namespace

ExactReader::ExactReader(const SectionTable& sections, std::string_view file, ExactSharedView& shared)
    : file_(file),
      shared_(shared),
      records_(sections[kExactRecords], "EXCT", file),
      occupancy_(sections[kExactOccupancy]),
      cells_(sections[kExactCells]),
      trees_(sections[kExactTrees]) {}

ExactView ExactReader::read(uint32_t index, const Bounds&) {
  const ExactRecord record = records_[index];
  const Place place{file_, "EXCT", index};
  ExactView view;
  place.require(record.reserved == 0, Rule::reserved_not_zero);
  const GridReading grid(record, occupancy_, cells_, place, view.field.proof);
  view.coded = grid.coded();
  view.field.bvh = take_bvh(record, trees_, place, view.tree_bytes);
  grid.read(shared_.decoded_grids, view.occupancy, view.cells);
  if (const auto fault = fault_of(view.field)) place.damaged(*fault);
  return view;
}

void ExactReader::finish() const {
  occupancy_.finish("EOCC", file_);
  cells_.finish("ECEL", file_);
  trees_.finish("EBVH", file_);
}

}  // namespace nif::format
