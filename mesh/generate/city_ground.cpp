// Builds the ground of the city: streets, crossings, and the blocks between them.
#include <algorithm>
#include <cmath>

#include "mesh/generate/city_objects.hpp"
#include "mesh/generate/noise.hpp"

namespace nif::generate {
namespace {

constexpr double kBelow = -0.6;   ///< bottom of the ground
constexpr double kCamber = 0.09;  ///< height of a street's middle above its sides
constexpr double kPaint = 0.012;  ///< height of markings
constexpr double kWalk = 3;       ///< width of the pavement

/// Height of a street at a distance from its middle.
double camber(double aside) {
  const double part = aside / (kStreet / 2);
  return -kCamber * part * part;
}

/// A marking on a street along x.
void add_marking(Assembly& assembly, double x, double z, double length, double width) {
  assembly.block({x - length / 2, camber(z) - 0.05, z - width / 2},
                 {x + length / 2, camber(z) + kPaint, z + width / 2});
}

/// The lid of a manhole, with a pattern.
void add_manhole(Assembly& assembly, double x, double z) {
  const Double3 foot{x, camber(z) - 0.05, z};
  assembly.lathe(foot, {{0.34, 0}, {0.34, 0.06}, {0.3, 0.06}, {0.29, 0.045}, {0.2, 0.05}, {0.19, 0.04}}, 24);
}

/// A street along x, from crossing to crossing.
void add_street_between(Assembly& assembly, Random& random, double pitch) {
  const double half = (pitch - kStreet) / 2 - 0.005, side = kStreet / 2 - 0.005;
  assembly.slab({-half, -side}, {half, side}, 24, 16, kBelow, [](double, double z) { return camber(z); });
  for (double x = -half + 4; x < half - 3; x += 6) add_marking(assembly, x, 0, 3, 0.12);
  for (const double aside : {-1.0, 1.0}) {
    add_marking(assembly, 0, aside * (side - 2.3), 2 * half - 6, 0.1);
    // Parking bays and gutters.
    for (double x = -half + 6; x < half - 5; x += 5.6)
      assembly.block({x - 0.05, camber(side) - 0.1, aside > 0 ? side - 2.2 : -side + 0.3},
                     {x + 0.05, camber(side - 2.2) + kPaint, aside > 0 ? side - 0.3 : -side + 2.2});
    for (double x = -half + 9; x < half - 5; x += 17)
      for (uint32_t bar = 0; bar < 6; ++bar)
        assembly.block({x + 0.1 * bar, camber(side) - 0.05, aside * (side - 0.2) - 0.14},
                       {x + 0.1 * bar + 0.05, camber(side) + 0.025, aside * (side - 0.2) + 0.14});
  }
  add_manhole(assembly, random.uniform(-half, half) / 2, random.uniform(1, 2));
}

/// The slab of a block with kerbs around it; `lawn` gives the height of its interior above the pavement.
void add_kerbed_block(Assembly& assembly, const std::function<double(double x, double z)>& lawn) {
  const Ground half = kBlockHalf;
  assembly.slab({-half.x, -half.z}, {half.x, half.z}, 42, 34, kBelow, [&](double x, double z) {
    const double inside = std::min(half.x - std::fabs(x), half.z - std::fabs(z)) - kWalk;
    return kPavement + (inside > 0 ? smoothstep(0, 1.5, inside) * lawn(x, z) : 0);
  });
  const auto kerb = [&](double length, double aside, bool along_x) {
    const auto stones = uint32_t(2 * length / 1.6);
    const double reach = (length - 0.2) / stones;
    for (uint32_t i = 0; i < stones; ++i)
      for (const double side : {-1.0, 1.0}) {
        const double at = reach * (2 * i + 1) - length + 0.2, out = side * (aside - 0.11);
        const Double3 centre = along_x ? Double3{at, 0, out} : Double3{out, 0, at};
        const Double3 stone = along_x ? Double3{reach - 0.01, 0, 0.12} : Double3{0.12, 0, reach - 0.01};
        assembly.block(centre - stone - Double3{0, 0.3, 0}, centre + stone + Double3{0, kPavement + 0.02, 0});
      }
  };
  kerb(half.x, half.z, true);
  kerb(half.z, half.x, false);
}

}  // namespace

void add_street(Assembly& assembly, Random& random, uint32_t) {
  add_street_between(assembly, random, kPitch.x);
}

void add_side_street(Assembly& assembly, Random& random, uint32_t) {
  add_street_between(assembly, random, kPitch.z);
  assembly.change([](const Double3& p) { return Double3{p[2], p[1], -p[0]}; });
}

void add_crossing(Assembly& assembly, Random& random, uint32_t) {
  const double half = kStreet / 2 - 0.01;
  assembly.slab({-half, -half}, {half, half}, 16, 16, kBelow,
                [](double, double) { return camber(kStreet / 2); });
  const double low = camber(kStreet / 2) - 0.05, high = camber(kStreet / 2) + kPaint;
  for (double at = -half + 1; at < half - 0.9; at += 0.95)
    for (const double end : {-1.0, 1.0}) {
      const double from = std::min(end * (half - 0.2), end * (half - 2.6)), to = from + 2.4;
      if (at > -half + 2.7 && at < half - 3.1) {
        assembly.block({at, low, from}, {at + 0.45, high, to});
        assembly.block({from, low - 0.01, at}, {to, high + 0.001, at + 0.45});
      }
    }
  assembly.lathe({random.uniform(-1.5, 1.5), low, random.uniform(-1.5, 1.5)},
                 {{0.34, 0}, {0.34, 0.07}, {0.3, 0.07}, {0.29, 0.055}, {0.2, 0.06}, {0.19, 0.05}}, 24);
}

void add_lawn(Assembly& assembly, Random& random, uint32_t) {
  const Noise noise(random.bits(), 7);
  add_kerbed_block(assembly, [&](double x, double z) {
    return 0.12 * std::clamp(0.5 + 0.5 * noise.octaves(Double3{x * 0.2, 0, z * 0.2}, 4, 0.55), 0.0, 1.0);
  });
}

void add_square(Assembly& assembly, Random& random, uint32_t) {
  add_kerbed_block(assembly, [](double, double) { return 0.0; });
  // Rows of plates, some of them missing.
  const Ground half{kBlockHalf.x - kWalk, kBlockHalf.z - kWalk};
  for (double x = 0.6 - half.x; x < half.x - 2; x += 3)
    for (const double z : {0.9 - half.z, half.z - 0.9})
      if (random.below(8) != 0) assembly.block({x, 0, z - 0.6}, {x + 2.2, kPavement + 0.015, z + 0.6});
}

}  // namespace nif::generate
