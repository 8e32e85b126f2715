// Compares pictures: how much one differs from another, and sheets with several of them.
#pragma once

#include "tools/render/image.hpp"

namespace nif::render {

/// Peak signal to noise ratio in dB over all values, the peak being 1; infinite where they are equal.
/// Pictures of one size.
double psnr(const Image& a, const Image& b);

/// Structural similarity of the luma (Wang et al. 2004): mean over all pixels, with their Gaussian window of
/// 11 pixels (sigma 1.5) cut off at the picture's edge; 1 where they are equal.
double ssim(const Image& a, const Image& b);

/// |a - b| times a factor.
Image difference(const Image& a, const Image& b, float factor);

/// Pictures of one height side by side, with a few white pixels between them.
Image side_by_side(const std::vector<const Image*>& images);

/// So many pixels wide (or as wide as it is), in proportion; each is the mean of those that it covers, in
/// linear light. Of encoded values, as the pictures above.
Image scaled_down(const Image& encoded, uint32_t width);

/// Pictures in rows of so many, white where there is none.
Image contact_sheet(const std::vector<const Image*>& images, uint32_t columns);

}  // namespace nif::render
