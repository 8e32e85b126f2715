// Checks that the tables of a field fit together, and that its sides are proven. If not, the reader refuses
// the file, and the writer codes nothing.
#pragma once

#include <cstdint>
#include <optional>

#include "formats/nif/planes/cell_sides.hpp"
#include "formats/nif/rules.hpp"
#include "kernels/reference/planes/cells.hpp"

namespace nif::format {

// Each returns the first broken rule, if any.

/// Checks the bricks. Their numbers must be in range, and the arrays as long as these say.
std::optional<Rule> fault_of_bricks(const kernels::PlanesField& field);
/// Checks the words of cells. The bricks must be valid.
std::optional<Rule> fault_of_words(const kernels::PlanesField& field);
/// Checks the sides of cells. The words must be valid.
std::optional<Rule> fault_of_sides(const kernels::PlanesField& field, const SideRegions& sides);

/// No path leads through a cell of this kind from above its planes to below: it is a wall, or the sides
/// differ.
constexpr bool separates(uint32_t kind) {
  const kernels::CellKind& known = kernels::kCellKinds[kind];
  return known.wall || (known.above | known.below) == kernels::kSeenBoth;
}

/// The kind that says everything proven about a cell with planes, by its record's number and whether it
/// separates. Files need not store more than that.
uint32_t proven_kind(const SideRegions& sides, uint32_t record, bool separating);

}  // namespace nif::format
