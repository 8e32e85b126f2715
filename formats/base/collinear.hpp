// Decides exactly whether three points lie on one line. Rounding must not decide it: dropping a thin triangle
// that has an area opens the surface, and keeping one without an area divides by zero later.
#pragma once

#include <array>
#include <cstddef>

namespace nif {

/// Points must be finite.
bool collinear(const std::array<float, 3>& a, const std::array<float, 3>& b, const std::array<float, 3>& c);

/// Which way the path from a over b to c turns at b, seen in the plane of the axes `x` and `y`: 1 to the
/// left, -1 to the right, 0 not at all. Exact for finite points.
int turn(const std::array<float, 3>& a, const std::array<float, 3>& b, const std::array<float, 3>& c,
         size_t x, size_t y);

}  // namespace nif
