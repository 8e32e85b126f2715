// Paints maps of where on a surface answers are wrong.
#pragma once

#include <algorithm>
#include <cmath>

namespace nif::render {

/// A pixel of such a map, encoded: grey by how much the surface faces the camera (0..1), and yellow to red by
/// the share of wrong answers.
inline void paint_errors(float* pixel, double facing, double wrong) {
  const double grey = 0.35 + 0.5 * facing, strength = wrong > 0 ? std::min(1.0, 0.45 + std::sqrt(wrong)) : 0;
  const double warm[3] = {0.95, 0.75 * (1 - std::sqrt(std::min(1.0, 2 * wrong))), 0.05};
  for (int c = 0; c < 3; ++c) pixel[c] = float(grey + (warm[c] - grey) * strength);
}

/// Value of pixels without surface.
inline constexpr float kErrorMapGround = 0.1f;

}  // namespace nif::render
