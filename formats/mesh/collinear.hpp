// Decides exactly whether three points lie on one line. Rounding must not decide it: dropping a thin triangle
// that has an area opens the surface, and keeping one without an area divides by zero later.
#pragma once

#include <cstddef>

#include "formats/mesh/scene.hpp"

namespace nif::mesh {

/// Finite points only.
bool collinear(const Float3& a, const Float3& b, const Float3& c);

/// Which way a path turns at b that runs from a over b to c, seen in the plane of the axes `x` and `y`: 1 to
/// the left, -1 to the right, 0 not at all. Exact, of finite points.
int turn(const Float3& a, const Float3& b, const Float3& c, size_t x, size_t y);

}  // namespace nif::mesh
