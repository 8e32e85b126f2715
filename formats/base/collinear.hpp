// Decides exactly whether three points lie on one line. Rounding must not decide it: dropping a thin triangle
// that has an area opens the surface, and keeping one without an area divides by zero later.
#pragma once

#include <array>

namespace nif {

/// Finite points only.
bool collinear(const std::array<float, 3>& a, const std::array<float, 3>& b, const std::array<float, 3>& c);

}  // namespace nif
