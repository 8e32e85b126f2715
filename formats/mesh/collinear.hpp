// Decides exactly whether three points lie on one line. Rounding must not decide it: dropping a thin triangle
// that has an area opens the surface, and keeping one without an area divides by zero later.
#pragma once

#include "formats/mesh/scene.hpp"

namespace nif::mesh {

/// Finite points only.
bool collinear(const Float3& a, const Float3& b, const Float3& c);

}  // namespace nif::mesh
