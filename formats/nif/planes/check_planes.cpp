// Checks planes in three passes, each relying on the one before: bricks, then the words of cells, then their
// sides. Links must name all children in order, so each child belongs to one cell and there are no cycles.
#include "formats/nif/planes/check_planes.hpp"

#include <bit>

namespace nif::format {
namespace {

/// Bits of a brick's voxels that lie within the grid along one axis: `brick` is the brick's index along it,
/// `stride` the distance in bits to the next voxel.
uint64_t bits_within(uint32_t voxels, uint32_t brick, uint32_t stride) {
  const uint64_t first = stride == 1 ? 0x1111111111111111u : stride == 4 ? 0x000f000f000f000fu : 0xffffu;
  uint64_t bits = 0;
  for (uint32_t v = 0; v < kernels::kBrickSide && brick * kernels::kBrickSide + v < voxels; ++v)
    bits |= first << (v * stride);
  return bits;
}

/// Kernels look up the corners around every surface voxel, and number bricks with surface voxels in 16 bits.
/// So each mixed brick must be in the table exactly once, and be outside wherever it is beyond the grid.
std::optional<Rule> fault_of_table(const kernels::PlanesField& field) {
  uint32_t next = kernels::kFirstMixedBrick;
  const uint16_t* entry = field.brick_table;
  for (uint32_t z = 0; z < field.bricks[2]; ++z)
    for (uint32_t y = 0; y < field.bricks[1]; ++y)
      for (uint32_t x = 0; x < field.bricks[0]; ++x, ++entry) {
        if (*entry < kernels::kFirstMixedBrick) continue;
        if (*entry != next) return Rule::brick_order;
        if (next - kernels::kFirstMixedBrick >= field.mixed_bricks) return Rule::brick_missing;
        const kernels::BrickStates& states = field.brick_states[next++ - kernels::kFirstMixedBrick];
        const uint64_t beyond = ~(bits_within(field.voxels[0], x, 1) & bits_within(field.voxels[1], y, 4) &
                                  bits_within(field.voxels[2], z, 16));
        if (((states.surface | states.aux) & beyond) != 0) return Rule::voxel_beyond_grid;
      }
  if (next - kernels::kFirstMixedBrick != field.mixed_bricks) return Rule::brick_left_out;
  return std::nullopt;
}

/// Checks that planes are such as the baker makes.
std::optional<Rule> fault_of_planes(uint32_t word) {
  if (kernels::word_kind(word) >= kernels::kPlaneKinds) return Rule::cell_kind;
  if ((word >> 4 & 63) > uint32_t(kernels::kNormalSum) || (word >> 10 & 63) > uint32_t(kernels::kNormalSum))
    return Rule::normal_range;
  if (kernels::lower_offset(word) >= kernels::upper_offset(word)) return Rule::plane_order;
  return std::nullopt;
}

}  // namespace

std::optional<Rule> fault_of_bricks(const kernels::PlanesField& field) {
  uint32_t surface_voxels = 0;
  for (uint32_t i = 0; i < field.mixed_bricks; ++i) {
    if (field.voxel_base[i] != surface_voxels) return Rule::voxel_base;
    surface_voxels += uint32_t(std::popcount(field.brick_states[i].surface & ~field.brick_states[i].aux));
  }
  if (surface_voxels != field.surface_voxels) return Rule::surface_voxels;
  return fault_of_table(field);
}

/// Links lead from voxels to children and on to children of these. The links, those of voxels first, must
/// name all children in order, so that each child belongs to one link, and no voxel is cut more often than
/// `levels` says.
std::optional<Rule> fault_of_words(const kernels::PlanesField& field) {
  uint32_t next = 0;
  const auto fault_of = [&](uint32_t word, bool may_link) -> std::optional<Rule> {
    if (kernels::word_kind(word) != kernels::kLink) return fault_of_planes(word);
    if (!may_link) return Rule::cut_too_often;
    if (kernels::link_mask(word) == 0) return Rule::no_children;
    if (kernels::link_first(word) != next) return Rule::child_order;
    next += uint32_t(std::popcount(kernels::link_mask(word)));
    return std::nullopt;
  };
  for (uint32_t i = 0; i < field.surface_voxels; ++i)
    if (const auto fault = fault_of(field.voxel_records[i], field.levels > 0)) return fault;
  // Children of voxels come first, then children of those, and so on.
  uint32_t level_end = next, level = 1;
  for (uint32_t i = 0; i < field.child_count; ++i) {
    if (i == level_end) level_end = next, ++level;
    if (i >= next) return Rule::child_of_no_cell;
    if (const auto fault = fault_of(field.children[i], level < field.levels)) return fault;
  }
  if (next != field.child_count) return Rule::child_count;
  return std::nullopt;
}

/// Sides must be what the planes and voxels around prove, or nothing.
std::optional<Rule> fault_of_sides(const kernels::PlanesField& field, const SideRegions& sides) {
  if (sides.contradictory()) return Rule::sides_joined;
  uint32_t record = 0;
  const auto proven = [&](const uint32_t* words, uint32_t count) {
    for (uint32_t i = 0; i < count; ++i, ++record) {
      const uint32_t kind = kernels::word_kind(words[i]);
      if (kind >= kernels::kPlaneKinds) continue;
      const kernels::CellKind& known = kernels::kCellKinds[kind];
      if ((known.above != 0 && known.above != sides.above(record)) ||
          (known.below != 0 && known.below != sides.below(record)))
        return false;
    }
    return true;
  };
  if (!proven(field.voxel_records, field.surface_voxels) || !proven(field.children, field.child_count))
    return Rule::side_not_proven;
  return std::nullopt;
}

uint32_t proven_kind(const SideRegions& sides, uint32_t record, bool separating) {
  return kernels::kind_of({sides.above(record), sides.below(record), separating});
}

}  // namespace nif::format
