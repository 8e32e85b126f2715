// A case that is drawn as a whole, because its mesh, its transform and its rays must fit each other.
#pragma once

#include <vector>

#include "tests/exact/generators.hpp"

namespace nif::test {

/// A sheet thousands of cells from the origin of its space, skewed about it as far as certain answers allow.
/// Rays start at that origin and end slightly behind the sheet. Of many rays, these are the ones that
/// rounding shortens most on the way back to object space, so that they end before the sheet.
struct SkewedSheet {
  HostileMesh hostile;
  Transform transform;
  std::vector<NifRay> rays;
};
/// `cell`: size of the finest cells, as a fraction of the sheet's.
SkewedSheet draw_skewed_sheet(double cell, uint32_t rays, Random& random);

}  // namespace nif::test
