// The shader's rays, answered once more by nifQuery on the CPU.
#pragma once

#include <array>
#include <span>

#include "view.hpp"

/// As light.comp writes it.
struct Light {
  uint32_t sun, sky, asked, proven;
};

/// Counts the pixels whose light differs from the CPU's: rays to the sun or to the sky that nothing blocks. `directions`: as
/// light.comp gets them, `half` of the sun and `half` of the sphere.
size_t count_differences(const nifkit::Scene& scene, std::span<const Pixel> pixels,
                         std::span<const std::array<float, 4>> directions, uint32_t samples, int up,
                         std::span<const Light> light);
