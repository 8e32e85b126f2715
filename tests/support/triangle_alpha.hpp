// Short names for what triangles let through, for tests that list many.
#pragma once

#include <vector>

#include "formats/mesh/alpha.hpp"

namespace nif::test {

using Alphas = std::vector<mesh::TriangleAlpha>;

inline constexpr mesh::TriangleAlpha kSolid = mesh::TriangleAlpha::solid, kCut = mesh::TriangleAlpha::cut,
                                     kClear = mesh::TriangleAlpha::clear;

}  // namespace nif::test
