// Builds the things along the city's streets and in its parks: trees, hedges, lamps, benches, bins, cars,
// statues.
#include <algorithm>
#include <cmath>

#include "mesh/generate/axes.hpp"
#include "mesh/generate/city_objects.hpp"
#include "mesh/generate/noise.hpp"
#include "mesh/generate/shapes.hpp"
#include "mesh/generate/turn.hpp"

namespace nif::generate {
namespace {

/// A point at `turns` on a rectangle with well-rounded corners and half sides of 1.
Ground rounded_square(double turns) {
  const Turn t = turn(turns);
  const double c = t.cos * t.cos, s = t.sin * t.sin, scale = 1 / std::sqrt(std::sqrt(c * c + s * s));
  return {t.cos * scale, t.sin * scale};
}

Double3 between(const Double3& a, const Double3& b, double t) { return a + (b - a) * t; }

void add_straight_rod(Assembly& assembly, const Double3& from, const Double3& to, double radius,
                      uint64_t sides) {
  assembly.rod([&](double t) { return between(from, to, t); }, radius, sides, 2);
}

/// Half of a car's width and height at stations from its tail (0) to its nose (1).
struct CarForm {
  double length, width, bonnet, roof, cabin_from, cabin_to;
};

void add_car_body(Assembly& assembly, const CarForm& car) {
  constexpr uint64_t kSides = 20, kStations = 22;
  constexpr double kSill = 0.24;
  const auto station = [&](double t) { return (t - 0.5) * car.length; };
  const auto top = [&](double t) {
    return car.bonnet - 0.1 * smoothstep(0.62, 1, t) - 0.05 * smoothstep(0.2, 0, t);
  };
  const auto half_width = [&](double t) {
    const double end = 2 * t - 1;
    return car.width / 2 * (1 - 0.16 * end * end * end * end);
  };
  const auto rounded_end = [](double t) {
    return 1 - 0.25 * smoothstep(0.06, 0, t) - 0.25 * smoothstep(0.94, 1, t);
  };
  assembly.tube(kSides, kStations, {station(-0.004), 0.5, 0}, {station(1.004), 0.5, 0},
                [&](uint64_t ring, double turns) {
                  const double t = double(ring) / double(kStations - 1);
                  const Ground section = rounded_square(turns);
                  const double high = (top(t) - kSill) / 2;
                  return Double3{station(t), kSill + high + section.z * high * rounded_end(t),
                                 -section.x * half_width(t) * rounded_end(t)};
                });
  // The cabin: vertical in the middle, sloping at both ends, narrower towards the roof.
  assembly.tube(kSides, kStations, {station(car.cabin_from), car.bonnet - 0.2, 0},
                {station(car.cabin_to), car.bonnet - 0.2, 0}, [&](uint64_t ring, double turns) {
                  const double s = double(ring) / double(kStations - 1);
                  const double t = car.cabin_from + s * (car.cabin_to - car.cabin_from);
                  const double rise = smoothstep(-0.02, 0.3, s) * smoothstep(1.02, 0.55, s);
                  const double low = car.bonnet - 0.25,
                               high = low + 0.15 + (car.roof - car.bonnet + 0.1) * rise;
                  const Ground section = rounded_square(turns);
                  const double y = (low + high) / 2 + section.z * (high - low) / 2;
                  const double narrow = 0.93 - 0.17 * smoothstep(car.bonnet, car.roof, y);
                  return Double3{station(t), y, -section.x * half_width(t) * narrow};
                });
}

void add_wheel(Assembly& assembly, double x, double z) {
  constexpr double kRadius = 0.32, kTyre = 0.1;
  assembly.ring({{x, kRadius, z}, {1, 0, 0}, {0, 1, 0}, kRadius - kTyre, kTyre}, {18, 9});
  add_straight_rod(assembly, {x, kRadius, z - 0.07}, {x, kRadius, z + 0.07}, 0.2, 16);
}

}  // namespace

void add_broadleaf(Assembly& assembly, Random& random, uint32_t variant) {
  const Request request{1'800 + 500 * uint64_t{variant}, random.bits()};
  assembly.add(*make_tree(request), random.uniform(0.85, 1.3), {0, -0.1, 0});
  assembly.ring({{0, 0.03, 0}, {1, 0, 0}, {0, 0, -1}, 0.62, 0.05}, {24, 6});
}

void add_conifer(Assembly& assembly, Random& random, uint32_t variant) {
  const double height = random.uniform(6, 11), width = height * random.uniform(0.2, 0.28);
  assembly.lathe({0, -0.1, 0}, {{0.05 * width + 0.2, 0}, {0.12, 0.3 * height}, {0.05, 0.9 * height}}, 10);
  const uint32_t tiers = 8 + variant % 5;
  constexpr uint64_t kNeedles = 36;
  for (uint32_t tier = 0; tier < tiers; ++tier) {
    const double low = height * (0.1 + 0.86 * tier / tiers), high = low + height * 1.7 / tiers;
    const double reach = width * (1.06 - double(tier) / tiers), twist = random.uniform();
    std::vector<double> ragged(kNeedles);
    for (uint64_t n = 0; n < kNeedles; ++n) ragged[n] = (n % 2 ? 0.68 : 1) * random.uniform(0.85, 1.05);
    assembly.tube(kNeedles, 4, {0, low + 0.1 * reach, 0}, {0, std::min(high, height), 0},
                  [&](uint64_t ring, double turns) {
                    const auto needle = size_t(turns * double(kNeedles) + 0.5);
                    constexpr double kIn[4] = {0.97, 1, 0.62, 0.16}, kUp[4] = {-0.02, 0.02, 0.42, 0.88};
                    const double part =
                        ring == 0 || ring == 1 ? ragged[needle] : 1 - (1 - ragged[needle]) * 0.4;
                    const Turn about = turn(turns + twist);
                    const double r = reach * kIn[ring] * part;
                    const double droop = ring < 2 ? -0.22 * reach * part : 0;
                    return Double3{r * about.cos, low + droop + kUp[ring] * (std::min(high, height) - low),
                                   -r * about.sin};
                  });
  }
}

void add_hedge(Assembly& assembly, Random& random, uint32_t) {
  const Noise leaves(random.bits(), 3);
  const double height = random.uniform(0.9, 1.7), width = random.uniform(0.35, 0.5);
  constexpr uint64_t kRings = 42;
  assembly.tube(24, kRings, {-3.02, height / 2, 0}, {3.02, height / 2, 0}, [&](uint64_t ring, double turns) {
    const double x = -3 + 6 * double(ring) / double(kRings - 1);
    const Ground section = rounded_square(turns);
    const double end = ring == 0 || ring == kRings - 1 ? 0.85 : 1;
    const Double3 p{x, height / 2 + section.z * height / 2 * end, -section.x * width * end};
    const double swell = 0.1 * leaves.octaves(p * 2.7, 3, 0.7);
    return Double3{p[0], p[1] + section.z * swell, p[2] - section.x * swell};
  });
}

void add_lamp(Assembly& assembly, Random& random, uint32_t variant) {
  const double height = random.uniform(4.6, 7.2);
  const bool old = variant % 2 == 0;
  assembly.lathe({0, -0.1, 0},
                 {{0.2, 0},
                  {0.2, 0.3},
                  {0.15, 0.36},
                  {0.16, 0.7},
                  {0.09, 0.85},
                  {0.085, 0.4 * height},
                  {0.11, 0.41 * height},
                  {0.11, 0.43 * height},
                  {0.06, 0.45 * height},
                  {0.05, height},
                  {0.09, height + 0.03},
                  {0.02, height + 0.2}},
                 16);
  const double reach = old ? 0.55 : random.uniform(1.2, 2.2);
  for (const double side : old ? std::vector<double>{-1, 1} : std::vector<double>{1}) {
    const Double3 start{0, height - 0.35, 0}, up{0, height + (old ? 0.25 : 0.35), side * 0.2 * reach},
        end{0, height + (old ? 0.1 : 0.3), side * reach};
    assembly.rod([&](double t) { return between(between(start, up, t), between(up, end, t), t); }, 0.035, 10,
                 12);
    if (old) {
      assembly.lathe(end + Double3{0, -0.5, 0},
                     {{0.1, 0}, {0.2, 0.42}, {0.24, 0.44}, {0.22, 0.5}, {0.08, 0.62}, {0.03, 0.75}}, 6);
      assembly.ring({Double3{0, height - 0.33, side * 0.24}, {0, 1, 0}, {0, 0, 1}, 0.16, 0.02}, {18, 6});
    } else {
      assembly.tube(
          16, 8, end + Double3{0, 0, -0.25}, end + Double3{0, 0, 0.55}, [&](uint64_t ring, double turns) {
            const double t = double(ring) / 7,
                         swell = 0.3 + 0.7 * smoothstep(-0.1, 0.4, t) * smoothstep(1.25, 0.7, t);
            const Ground section = rounded_square(turns);
            return end + Double3{section.x * 0.16 * swell, section.z * 0.06 * swell, -0.25 + 0.8 * t};
          });
    }
  }
}

void add_bench(Assembly& assembly, Random& random, uint32_t variant) {
  const double half = random.uniform(0.75, 1.05);
  const uint32_t seat = 4 + variant % 3, back = 3 + variant % 2;
  const auto slat = [&](double y, double z) {
    assembly.rod([&](double t) { return Double3{(2 * t - 1) * half, y, z}; }, 0.028, 8, 5);
  };
  for (uint32_t i = 0; i < seat; ++i) slat(0.44 + 0.006 * i, 0.24 - 0.46 * i / (seat - 1));
  for (uint32_t i = 0; i < back; ++i) slat(0.6 + 0.13 * i, -0.27 - 0.045 * i);
  for (const double end : {-0.8, 0.8}) {
    const double x = end * half;
    const Double3 foot{x, -0.03, 0.26}, knee{x, 0.47, 0.33}, hip{x, 0.36, -0.22};
    assembly.rod([&](double t) { return between(between(foot, knee, t), between(knee, hip, t), t); }, 0.03, 8,
                 10);
    const Double3 heel{x + 0.002, -0.03, -0.28}, waist{x + 0.002, 0.4, -0.2}, top{x + 0.002, 1.05, -0.44};
    assembly.rod([&](double t) { return between(between(heel, waist, t), between(waist, top, t), t); }, 0.031,
                 8, 10);
  }
}

void add_bin(Assembly& assembly, Random& random, uint32_t) {
  const double height = random.uniform(0.8, 1.0), radius = random.uniform(0.24, 0.3);
  assembly.lathe({0, -0.03, 0},
                 {{radius * 0.8, 0},
                  {radius * 0.82, 0.06},
                  {radius * 0.9, 0.1},
                  {radius, height},
                  {radius + 0.04, height + 0.01},
                  {radius + 0.04, height + 0.05},
                  {radius - 0.03, height + 0.05},
                  {radius - 0.05, 0.3 * height}},
                 24);
  for (uint32_t i = 0; i < 16; ++i) {
    const Turn about = turn(i / 16.0);
    const Double3 out{about.cos, 0, -about.sin};
    assembly.beam(out * (radius * 0.93) + Double3{0, 0.12, 0},
                  out * (radius + 0.03) + Double3{0, height - 0.04, 0}, out, 0.04, 0.02);
  }
}

void add_car(Assembly& assembly, Random& random, uint32_t variant) {
  // Saloons, estates and vans.
  const uint32_t kind = variant % 3;
  CarForm car{random.uniform(3.9, 4.6),
              random.uniform(1.66, 1.84),
              random.uniform(0.86, 0.96),
              random.uniform(1.4, 1.5),
              0.1,
              0.74};
  if (kind == 1) car.cabin_from = 0.01, car.roof += 0.06;
  if (kind == 2) car.cabin_from = 0.01, car.cabin_to = 0.88, car.bonnet += 0.08, car.roof += 0.4;
  add_car_body(assembly, car);
  const double axle = car.length * 0.31, track = car.width / 2 - 0.09;
  for (const double x : {-axle, axle})
    for (const double z : {-track, track}) add_wheel(assembly, x, z);
  for (const double side : {-1.0, 1.0}) {
    const double nose = car.length / 2 - 0.12;
    assembly.box({0.13 * car.length, car.bonnet + 0.05, side * (car.width / 2 + 0.07)}, {0.07, 0, 0},
                 {0, 0.07, 0}, {0, 0, 0.1});
    add_straight_rod(assembly, {nose - 0.25, car.bonnet - 0.24, side * 0.56},
                     {nose + 0.07, car.bonnet - 0.24, side * 0.56}, 0.1, 12);
    assembly.box({-nose - 0.02, car.bonnet - 0.2, side * 0.6}, {0.08, 0, 0}, {0, 0.06, 0}, {0, 0, 0.13});
  }
  for (const double end : {-1.0, 1.0})
    assembly.box({end * (car.length / 2 - 0.04), 0.42, 0}, {0.1, 0, 0}, {0, 0.07, 0},
                 {0, 0, car.width * 0.4});
}

void add_statue(Assembly& assembly, Random& random, uint32_t variant) {
  constexpr double kPlinth = 1.9;
  const Request request{9'000 + 2'000 * uint64_t{variant}, random.bits()};
  assembly.lathe({0, -0.1, 0},
                 {{2.3, 0}, {2.3, 0.25}, {2.0, 0.25}, {2.0, 0.42}, {1.7, 0.42}, {1.7, 0.6}, {1.4, 0.6}}, 48);
  assembly.block({-0.85, 0.4, -0.85}, {0.85, kPlinth, 0.85});
  assembly.block({-1, kPlinth - 0.25, -1}, {1, kPlinth - 0.1, 1});
  constexpr double kScale = 0.8, kFoot = 3 * kScale;
  assembly.add(*make_statue(request), kScale, {0, kPlinth + kFoot - 0.04, 0.1});
}

}  // namespace nif::generate
