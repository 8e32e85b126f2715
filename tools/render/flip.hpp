// FLIP: how different two pictures look when one is shown in the place of the other.
#pragma once

#include "tools/render/image.hpp"

namespace nif::render {

/// Pixels per degree of the eye at which FLIP looks: a screen of 3,840 pixels and 0.7 m width from 0.7 m
/// away, the paper's default.
inline constexpr double kPixelsPerDegree = 67.02;

/// Mean over all pixels of LDR-FLIP (Andersson, Nilsson, Akenine-Moeller, Oskarsson, Astroem, Fairchild:
/// "FLIP: A Difference Evaluator for Alternating Images", HPG 2020), from 0, equal, to 1. Of encoded (sRGB)
/// values, which are cut off at 0 and 1; pictures of one size. Symmetric. In parallel, and the same for any
/// number of threads.
double flip(const Image& a, const Image& b);

}  // namespace nif::render
