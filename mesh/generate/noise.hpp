// Gradient noise (Perlin 2002) and sums of its octaves.
//
// Our own code, because Debian's noise library, libnoise, is orphaned there, and needs a graph of virtual
// calls for each value.
#pragma once

#include <cmath>
#include <cstdint>

#include "formats/base/vector.hpp"

namespace nif::generate {

class Noise {
 public:
  /// Noises with different seeds or purposes are unrelated.
  Noise(uint64_t seed, uint32_t purpose) {
    uint64_t mixed = (seed + 0x9e3779b97f4a7c15ull * (purpose + uint64_t{1})) ^ (seed >> 31);
    mixed = (mixed ^ (mixed >> 30)) * 0xbf58476d1ce4e5b9ull;
    mixed = (mixed ^ (mixed >> 27)) * 0x94d049bb133111ebull;
    key_ = uint32_t(mixed ^ (mixed >> 31));
  }

  /// Smooth, around 0, seldom outside -1..1, with features of size 1. Coordinates must be below 2^31.
  double operator()(const Double3& p) const {
    const double fx = std::floor(p[0]), fy = std::floor(p[1]), fz = std::floor(p[2]);
    const double x = p[0] - fx, y = p[1] - fy, z = p[2] - fz;
    const uint32_t ix = cell(fx), iy = cell(fy), iz = cell(fz);
    const double u = fade(x), v = fade(y), w = fade(z);
    const auto along_x = [&](uint32_t dy, uint32_t dz) {
      const double a = slope(ix, iy + dy, iz + dz, x, y - dy, z - dz);
      const double b = slope(ix + 1, iy + dy, iz + dz, x - 1, y - dy, z - dz);
      return a + u * (b - a);
    };
    const double y0 = along_x(0, 0), y1 = along_x(1, 0), z0 = y0 + v * (y1 - y0);
    const double y2 = along_x(0, 1), y3 = along_x(1, 1), z1 = y2 + v * (y3 - y2);
    return 1.6 * (z0 + w * (z1 - z0));
  }

  /// Sums octaves, each with half the size and `gain` times the height of the one before.
  double octaves(Double3 p, int count, double gain) const {
    double sum = 0;
    for (double height = 1; count > 0; --count, height *= gain, p = next(p)) sum += height * (*this)(p);
    return sum;
  }

  /// Like octaves(), with ridges: each is between 0 and 1, sharp at 1, and rough only where the previous
  /// octave is high.
  double ridges(Double3 p, int count, double gain) const {
    double sum = 0, weight = 1;
    for (double height = 1; count > 0; --count, height *= gain, p = next(p)) {
      const double ridge = 1 - std::fmin(1, std::fabs((*this)(p)));
      sum += height * weight * ridge * ridge;
      weight = ridge * ridge;
    }
    return sum;
  }

  /// Moves the point by up to about `distance` along each axis.
  Double3 warp(const Double3& p, double distance) const {
    return p + Double3{(*this)(p + Double3{31.7, 0, 0}), (*this)(p + Double3{0, 47.3, 0}),
                       (*this)(p + Double3{0, 0, 59.1})} *
                   distance;
  }

 private:
  /// Not quite twice as fine and shifted, so that the lattices of two octaves share no corner.
  static Double3 next(const Double3& p) { return p * 1.97 + Double3{13.3, 7.7, 21.1}; }
  static uint32_t cell(double floor) { return uint32_t(int32_t(floor)); }
  static double fade(double t) { return t * t * t * (t * (t * 6 - 15) + 10); }

  /// The dot product of a random gradient at a corner of the lattice with the offset from that corner.
  double slope(uint32_t ix, uint32_t iy, uint32_t iz, double x, double y, double z) const {
    uint32_t h = key_ ^ (ix * 0x8da6b343u) ^ (iy * 0xd8163841u) ^ (iz * 0xcb1ab31fu);
    h = (h ^ (h >> 16)) * 0x7feb352du;
    h = (h ^ (h >> 15)) * 0x846ca68bu;
    h ^= h >> 16;
    constexpr double kScale = 2.0 / 1023;
    return ((h & 1023) * kScale - 1) * x + ((h >> 10 & 1023) * kScale - 1) * y +
           ((h >> 20 & 1023) * kScale - 1) * z;
  }

  uint32_t key_;
};

/// 0 below `low`, 1 above `high`, smooth in between.
inline double smoothstep(double low, double high, double x) {
  const double t = std::fmin(1, std::fmax(0, (x - low) / (high - low)));
  return t * t * (3 - 2 * t);
}

}  // namespace nif::generate
