// Constants have the names of the paper. Each of its filters is a sum of products of a filter along x and one
// along y, over a square.
#include "tools/render/flip.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "formats/base/vector.hpp"

namespace nif::render {
namespace {

using Plane = std::vector<double>;
using Planes = std::array<Plane, 3>;  ///< one for each component of a colour
using Taps = std::vector<double>;     ///< [2 * radius + 1]

constexpr double kQc = 0.7, kPc = 0.4, kPt = 0.95;  // for colours
constexpr double kQf = 0.5, kWidth = 0.082;         // for features: degrees

// Rows of sRGB's primaries in XYZ; white is their sum.
constexpr std::array<Double3, 3> kToXyz{
    {{10135552.0 / 24577794, 8788810.0 / 24577794, 4435075.0 / 24577794},
     {2613072.0 / 12288897, 8788810.0 / 12288897, 887015.0 / 12288897},
     {1425312.0 / 73733382, 8788810.0 / 73733382, 70074185.0 / 73733382}}};
constexpr double white(size_t axis) { return kToXyz[axis][0] + kToXyz[axis][1] + kToXyz[axis][2]; }

/// XYZ relative to white.
Double3 relative_xyz(const Double3& rgb) {
  Double3 xyz;
  for (size_t a = 0; a < 3; ++a) xyz[a] = dot(kToXyz[a], rgb) / white(a);
  return xyz;
}

Double3 rgb_of_relative(Double3 xyz) {
  for (size_t a = 0; a < 3; ++a) xyz[a] *= white(a);
  const auto& [r0, r1, r2] = kToXyz;
  const std::array<Double3, 3> adjugate{cross(r1, r2), cross(r2, r0), cross(r0, r1)};  // columns
  const double determinant = dot(r0, adjugate[0]);
  return (adjugate[0] * xyz[0] + adjugate[1] * xyz[1] + adjugate[2] * xyz[2]) * (1 / determinant);
}

/// YCxCz: opponent colours that are linear in light.
Double3 opponent(const Double3& rgb) {
  const Double3 xyz = relative_xyz(rgb);
  return {116 * xyz[1] - 16, 500 * (xyz[0] - xyz[1]), 200 * (xyz[1] - xyz[2])};
}

Double3 rgb_of_opponent(const Double3& colour) {
  const double y = (colour[0] + 16) / 116;
  return rgb_of_relative({y + colour[1] / 500, y, y - colour[2] / 200});
}

/// CIELAB with less colour where it is dark (Hunt effect).
Double3 hunt_lab(const Double3& rgb) {
  constexpr double kKnee = 6.0 / 29;
  Double3 f = relative_xyz(rgb);
  for (double& value : f)
    value = value > kKnee * kKnee * kKnee ? std::cbrt(value) : value / (3 * kKnee * kKnee) + 4.0 / 29;
  const double lightness = 116 * f[1] - 16;
  return {lightness, 0.01 * lightness * 500 * (f[0] - f[1]), 0.01 * lightness * 200 * (f[1] - f[2])};
}

/// HyAB, a distance for colours that are far apart.
double colour_distance(const Double3& a, const Double3& b) {
  return std::abs(a[0] - b[0]) + std::hypot(a[1] - b[1], a[2] - b[2]);
}

/// Maps a distance to 0..1, with most of the range for small distances.
double redistributed(double distance) {
  static const double kMost = std::pow(colour_distance(hunt_lab({0, 1, 0}), hunt_lab({0, 0, 1})), kQc);
  const double powered = std::pow(distance, kQc), knee = kPc * kMost;
  return powered < knee ? kPt / knee * powered : kPt + (powered - knee) / (kMost - knee) * (1 - kPt);
}

Taps gaussian(int radius, double sigma) {
  Taps taps;
  for (int k = -radius; k <= radius; ++k) taps.push_back(std::exp(-k * k / (2 * sigma * sigma)));
  return taps;
}
double sum_of(const Taps& taps) {
  double sum = 0;
  for (const double tap : taps) sum += tap;
  return sum;
}
Taps scaled(Taps taps, double factor) {
  for (double& tap : taps) tap *= factor;
  return taps;
}
/// Scales positive taps to a sum of 1, and negative ones to a sum of -1.
Taps balanced(Taps taps) {
  double positive = 0, negative = 0;
  for (const double tap : taps) (tap > 0 ? positive : negative) += tap;
  for (double& tap : taps) tap /= tap > 0 ? positive : -negative;
  return taps;
}

/// Filters along x, then along y; beyond the edge, the last pixel is repeated.
Plane filtered(const Plane& plane, int width, int height, const Taps& along_x, const Taps& along_y) {
  const auto pass = [&](const Plane& from, int length, int step, int line_step, const Taps& taps, int lines) {
    Plane to(from.size());
    const int radius = int(taps.size() / 2);
    tbb::parallel_for(0, lines, [&](int line) {
      const double* in = &from[size_t(line) * size_t(line_step)];
      for (int i = 0; i < length; ++i) {
        double sum = 0;
        for (int k = -radius; k <= radius; ++k)
          sum += taps[size_t(k + radius)] * in[size_t(std::clamp(i + k, 0, length - 1)) * size_t(step)];
        to[size_t(line) * size_t(line_step) + size_t(i) * size_t(step)] = sum;
      }
    });
    return to;
  };
  return pass(pass(plane, width, 1, width, along_x, height), height, width, 1, along_y, width);
}

/// The contrast sensitivity of the eye: for each opponent colour, a sum of Gaussians of the angle in degrees,
/// each with a weight and a width.
Plane seen(const Plane& plane, int width, int height, size_t channel) {
  struct Term {
    double a, b;
  };
  constexpr Term kTerms[3][2] = {
      {{1, 0.0047}, {0, 1e-5}}, {{1, 0.0053}, {0, 1e-5}}, {{34.1, 0.04}, {13.5, 0.025}}};
  constexpr double kWidest = 0.04, pi = std::numbers::pi;
  const auto sigma = [](double b) { return std::sqrt(b / (2 * pi * pi)) * kPixelsPerDegree; };
  const int radius = int(std::ceil(3 * sigma(kWidest)));
  Plane all(plane.size());
  double weights = 0;
  for (const Term& term : kTerms[channel]) {
    if (term.a == 0) continue;
    const Taps taps = gaussian(radius, sigma(term.b));
    const double height_of = term.a * std::sqrt(pi / term.b);
    const Plane part = filtered(plane, width, height, scaled(taps, height_of), taps);
    for (size_t i = 0; i < all.size(); ++i) all[i] += part[i];
    weights += height_of * sum_of(taps) * sum_of(taps);
  }
  for (double& value : all) value /= weights;
  return all;
}

/// Strength of edges and points at each pixel.
struct Features {
  Plane edges, points;
};
Features features_of(const Plane& opponent_y, int width, int height) {
  Plane light(opponent_y.size());
  std::transform(opponent_y.begin(), opponent_y.end(), light.begin(),
                 [](double y) { return (y + 16) / 116; });
  const double sigma = 0.5 * kWidth * kPixelsPerDegree;
  const int radius = int(std::ceil(3 * sigma));
  const Taps bell = gaussian(radius, sigma), across = scaled(bell, 1 / sum_of(bell));
  Taps first = bell, second = bell;
  for (int k = -radius; k <= radius; ++k) {
    first[size_t(k + radius)] *= -k;
    second[size_t(k + radius)] *= k * k / (sigma * sigma) - 1;
  }
  const auto strength = [&](const Taps& along) {
    const Taps taps = balanced(along);
    Plane x = filtered(light, width, height, taps, across);
    const Plane y = filtered(light, width, height, across, taps);
    for (size_t i = 0; i < x.size(); ++i) x[i] = std::hypot(x[i], y[i]);
    return x;
  };
  return {strength(first), strength(second)};
}

/// The parts of a picture that are compared.
struct Seen {
  std::vector<Double3> colours;  ///< hunt_lab()
  Features features;
};
Seen look_at(const Image& image) {
  const int width = int(image.width), height = int(image.height);
  const size_t pixels = size_t(image.width) * image.height;
  Planes planes;
  for (Plane& plane : planes) plane.resize(pixels);
  for (size_t i = 0; i < pixels; ++i) {
    Double3 rgb;
    for (size_t c = 0; c < 3; ++c)
      rgb[c] = double(srgb_decode(std::clamp(image.values[3 * i + c], 0.0f, 1.0f)));
    const Double3 colour = opponent(rgb);
    for (size_t c = 0; c < 3; ++c) planes[c][i] = colour[c];
  }
  Seen result;
  result.features = features_of(planes[0], width, height);
  for (size_t c = 0; c < 3; ++c) planes[c] = seen(planes[c], width, height, c);
  for (size_t i = 0; i < pixels; ++i) {
    Double3 rgb = rgb_of_opponent({planes[0][i], planes[1][i], planes[2][i]});
    for (double& value : rgb) value = std::clamp(value, 0.0, 1.0);
    result.colours.push_back(hunt_lab(rgb));
  }
  return result;
}

}  // namespace

double flip(const Image& a, const Image& b) {
  const Seen one = look_at(a), other = look_at(b);
  double sum = 0;
  for (size_t i = 0; i < one.colours.size(); ++i) {
    const double colour = redistributed(colour_distance(one.colours[i], other.colours[i]));
    const double edge = std::abs(one.features.edges[i] - other.features.edges[i]),
                 point = std::abs(one.features.points[i] - other.features.points[i]);
    const double feature = std::pow(std::max(edge, point) / std::numbers::sqrt2, kQf);
    sum += std::pow(colour, 1 - feature);
  }
  return one.colours.empty() ? 0 : sum / double(one.colours.size());
}

}  // namespace nif::render
