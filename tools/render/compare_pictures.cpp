// SSIM as in Wang et al. 2004, with its Gaussian window applied in two passes; at the picture's edges weights
// are rescaled. Pictures are scaled down in linear light.
#include "tools/render/compare_pictures.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace nif::render {
namespace {

using Plane = std::vector<double>;

constexpr int kRadius = 5;

/// Convolution with the window in both directions; weights are rescaled where the window extends beyond the
/// picture.
Plane blurred(const Plane& plane, int width, int height) {
  std::array<double, 2 * kRadius + 1> window;
  for (int k = -kRadius; k <= kRadius; ++k) window[size_t(k + kRadius)] = std::exp(-k * k / (2 * 1.5 * 1.5));
  const auto pass = [&](const Plane& from, int length, int lines, int step, int line_step) {
    Plane to(from.size());
    for (int line = 0; line < lines; ++line)
      for (int i = 0; i < length; ++i) {
        double sum = 0, weight = 0;
        for (int k = std::max(-kRadius, -i); k <= std::min(kRadius, length - 1 - i); ++k) {
          const double w = window[size_t(k + kRadius)];
          sum += w * from[size_t(line) * size_t(line_step) + size_t(i + k) * size_t(step)];
          weight += w;
        }
        to[size_t(line) * size_t(line_step) + size_t(i) * size_t(step)] = sum / weight;
      }
    return to;
  };
  return pass(pass(plane, width, height, 1, width), height, width, width, 1);
}

Plane luma(const Image& image) {
  Plane plane(size_t(image.width) * image.height);
  for (size_t i = 0; i < plane.size(); ++i) {
    const float* rgb = &image.values[3 * i];
    plane[i] = 0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2];
  }
  return plane;
}

Plane product(const Plane& a, const Plane& b) {
  Plane out(a.size());
  std::transform(a.begin(), a.end(), b.begin(), out.begin(), [](double x, double y) { return x * y; });
  return out;
}

}  // namespace

double psnr(const Image& a, const Image& b) {
  double sum = 0;
  for (size_t i = 0; i < a.values.size(); ++i) {
    const double d = double(a.values[i]) - double(b.values[i]);
    sum += d * d;
  }
  return sum > 0 ? 10 * std::log10(double(a.values.size()) / sum) : std::numeric_limits<double>::infinity();
}

double ssim(const Image& a, const Image& b) {
  const int width = int(a.width), height = int(a.height);
  const Plane x = luma(a), y = luma(b);
  const Plane mean_x = blurred(x, width, height), mean_y = blurred(y, width, height);
  const Plane xx = blurred(product(x, x), width, height), yy = blurred(product(y, y), width, height),
              xy = blurred(product(x, y), width, height);
  constexpr double c1 = 0.01 * 0.01, c2 = 0.03 * 0.03;
  double sum = 0;
  for (size_t i = 0; i < x.size(); ++i) {
    const double mx = mean_x[i], my = mean_y[i];
    const double vx = xx[i] - mx * mx, vy = yy[i] - my * my, cov = xy[i] - mx * my;
    sum += (2 * mx * my + c1) * (2 * cov + c2) / ((mx * mx + my * my + c1) * (vx + vy + c2));
  }
  return sum / double(x.size());
}

Image difference(const Image& a, const Image& b, float factor) {
  Image out(a.width, a.height);
  for (size_t i = 0; i < out.values.size(); ++i) out.values[i] = factor * std::abs(a.values[i] - b.values[i]);
  return out;
}

Image side_by_side(const std::vector<const Image*>& images) {
  return contact_sheet(images, uint32_t(images.size()));
}

Image scaled_down(const Image& encoded, uint32_t width) {
  if (width >= encoded.width) return encoded;
  const uint32_t height = std::max(1u, uint32_t(uint64_t{encoded.height} * width / encoded.width));
  Image out(width, height);
  for (uint32_t y = 0; y < height; ++y)
    for (uint32_t x = 0; x < width; ++x) {
      const uint32_t left = uint32_t(uint64_t{x} * encoded.width / width),
                     right = uint32_t(uint64_t{x + 1} * encoded.width / width);
      const uint32_t top = uint32_t(uint64_t{y} * encoded.height / height),
                     bottom = uint32_t(uint64_t{y + 1} * encoded.height / height);
      for (size_t c = 0; c < 3; ++c) {
        float sum = 0;
        for (uint32_t v = top; v < bottom; ++v)
          for (uint32_t u = left; u < right; ++u)
            sum += srgb_decode(std::clamp(encoded.at(u, v)[c], 0.0f, 1.0f));
        out.at(x, y)[c] = srgb_encode(sum / float((right - left) * (bottom - top)));
      }
    }
  return out;
}

Image contact_sheet(const std::vector<const Image*>& images, uint32_t columns) {
  constexpr uint32_t kGap = 4;
  uint32_t width = 0, height = 0;
  for (const Image* image : images) {
    width = std::max(width, image->width);
    height = std::max(height, image->height);
  }
  columns = std::min(columns, uint32_t(images.size()));
  const uint32_t rows = (uint32_t(images.size()) + columns - 1) / columns;
  Image sheet(columns * (width + kGap) - kGap, rows * (height + kGap) - kGap);
  std::fill(sheet.values.begin(), sheet.values.end(), 1.0f);
  for (uint32_t i = 0; i < images.size(); ++i) {
    const uint32_t left = i % columns * (width + kGap), top = i / columns * (height + kGap);
    for (uint32_t y = 0; y < images[i]->height; ++y)
      std::copy_n(images[i]->at(0, y), 3 * size_t(images[i]->width), sheet.at(left, top + y));
  }
  return sheet;
}

}  // namespace nif::render
