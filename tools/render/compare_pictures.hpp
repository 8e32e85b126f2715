// Measures how much pictures differ, and makes sheets of several of them.
#pragma once

#include "tools/render/image_file.hpp"

namespace nif::render {

/// Peak signal to noise ratio in dB over all values, with a peak of 1; infinite if the pictures are equal.
/// Both must have the same size.
double psnr(const Image& a, const Image& b);

/// Structural similarity of the luma (Wang et al. 2004): mean over all pixels, with their Gaussian window of
/// 11 pixels (sigma 1.5), cut off at the picture's edge; 1 if the pictures are equal.
double ssim(const Image& a, const Image& b);

/// |a - b| times a factor.
Image difference(const Image& a, const Image& b, float factor);

/// Pictures of one height side by side, with a few white pixels between them.
Image side_by_side(const std::vector<const Image*>& images);

/// Scales to this width (at most the picture's own) in proportion; each pixel is the mean of those that it
/// covers, in linear light. Values are encoded, like those of the functions above.
Image scaled_down(const Image& encoded, uint32_t width);

/// Pictures in rows of `columns`, white where there is none.
Image contact_sheet(const std::vector<const Image*>& images, uint32_t columns);

}  // namespace nif::render
