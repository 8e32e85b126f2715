// FLIP measures how different two pictures look when they are shown in turn.
#pragma once

#include "tools/render/image_file.hpp"

namespace nif::render {

/// Pixels per degree of vision that FLIP assumes: a screen of 3,840 pixels and 0.7 m width seen from 0.7 m,
/// the paper's default.
inline constexpr double kPixelsPerDegree = 67.02;

/// Mean over all pixels of LDR-FLIP (Andersson, Nilsson, Akenine-Moeller, Oskarsson, Astroem, Fairchild:
/// "FLIP: A Difference Evaluator for Alternating Images", HPG 2020), from 0, equal, to 1. Takes encoded
/// (sRGB) values, clamped to 0..1, of pictures of the same size. Symmetric. Runs in parallel, with the same
/// result for any number of threads.
double flip(const Image& a, const Image& b);

}  // namespace nif::render
