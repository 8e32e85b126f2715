// Whether the tables of a field fit together, and whether its sides are proven. The reader refuses a file
// where they do not; the writer codes nothing then.
#pragma once

#include <cstdint>
#include <optional>

#include "formats/nif/planes/sides.hpp"
#include "formats/nif/rules.hpp"
#include "kernels/reference/planes/cells.hpp"

namespace nif::format {

// Each returns the first rule that is broken, if one is.

/// Of the bricks. Their numbers must be in range, and the arrays as long as these say.
std::optional<Rule> fault_of_bricks(const kernels::PlanesField& field);
/// Of the words of cells, where nothing is wrong with the bricks.
std::optional<Rule> fault_of_words(const kernels::PlanesField& field);
/// Of the sides of cells, where nothing is wrong with the words.
std::optional<Rule> fault_of_sides(const kernels::PlanesField& field, const SideRegions& sides);

/// No path leads through a cell of this kind from above its planes to below: it is a wall, or the sides are
/// not the same.
constexpr bool separates(uint32_t kind) {
  const kernels::CellKind& known = kernels::kCellKinds[kind];
  return known.wall || (known.above | known.below) == kernels::kSeenBoth;
}

/// The kind that says all that is proven of a cell with planes, by its record's number and whether it
/// separates; kPlaneKinds where that contradicts what is proven. Files need not store more than that.
uint32_t proven_kind(const SideRegions& sides, uint32_t record, bool separating);

}  // namespace nif::format
