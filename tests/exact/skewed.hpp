// A case that is drawn as a whole, because its mesh, its transform and its rays must fit each other.
#pragma once

#include <vector>

#include "tests/exact/generators.hpp"

namespace nif::test {

/// A sheet thousands of cells from the origin of its space, about which it is skewed as far as answers may be
/// certain. Rays come from that origin and end a little behind the sheet. They are those, of many, that the
/// way back to object space shortens most by rounding, so that they end before it.
struct SkewedSheet {
  HostileMesh hostile;
  Transform transform;
  std::vector<NifRay> rays;
};
/// `cell`: how large the finest cells are, as a part of the sheet.
SkewedSheet draw_skewed_sheet(double cell, uint32_t rays, Random& random);

}  // namespace nif::test
