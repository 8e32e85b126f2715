// Of thousands of skews and rays, takes those that rounding shortens most.
#include "tests/exact/skewed.hpp"

#include <cmath>
#include <limits>

#include "tests/support/to_world.hpp"

namespace nif::test {
namespace {

/// Object to world: z becomes `side * (x + y) - down * z`. The inverse: z = slope * (x + y) - steep * z.
struct Skew {
  float side, down;

  double slope() const { return double(side) / double(down); }
  double steep() const { return 1 / double(down); }
  Transform transform() const { return {1, 0, 0, 0, 0, 1, 0, 0, side, side, -down, 0}; }
  /// How much shorter a typical direction becomes because these two are rounded to floats.
  double shortened() const {
    const double a = slope(), b = steep();
    return 2.5 * (a - double(float(a))) + 1.5 * (double(float(b)) - b);
  }
};

Skew draw_skew(Random& random) {
  Skew worst{2, 0.97f};
  for (int i = 0; i < 20000; ++i) {
    const Skew skew{float(random.uniform(1.97, 2.05)), float(random.uniform(0.94, 0.995))};
    if (skew.shortened() > worst.shortened()) worst = skew;
  }
  return worst;
}

}  // namespace

SkewedSheet draw_skewed_sheet(double cell, uint32_t rays, Random& random) {
  constexpr double kSize = 10;
  // Planes give certain answers to rays from up to 16,384 cells away.
  const double far = kSize * cell * random.uniform(14000, 16300), beside = 0.59 * far;
  // Triangles above and below make the box higher, so that the sheet lies anywhere in its cells.
  const float low = float(beside), high = float(beside + kSize), level = float(far + random.uniform(0, 1));
  const float bottom = level - float(random.uniform(0.1, 1)), top = level + float(random.uniform(0.1, 1));
  const float near = low + 0.1f;
  SkewedSheet out;
  mesh::Mesh& mesh = out.hostile.mesh;
  mesh.positions = {{low, low, level},  {high, low, level},  {high, high, level}, {low, high, level},
                    {low, low, bottom}, {near, low, bottom}, {low, near, bottom}, {low, low, top},
                    {near, low, top},   {low, near, top}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}, {4, 5, 6}, {7, 8, 9}};

  const Skew skew = draw_skew(random);
  out.transform = skew.transform();
  const float slope = float(skew.slope()), steep = float(skew.steep());
  for (uint32_t i = 0; i < rays; ++i) {
    NifRay worst{};
    double most = -1;
    for (int k = 0; k < 2000; ++k) {
      NifRay ray{{0, 0, float(random.uniform(-1, 1))}, 0, {}, std::numeric_limits<float>::infinity()};
      const double times = random.uniform(1, 2) / far;
      ray.direction[0] = float((random.uniform(0.05, 0.95) * kSize + double(low)) * times);
      ray.direction[1] = float((random.uniform(0.05, 0.95) * kSize + double(low)) * times);
      ray.direction[2] = float((double(level) - double(ray.origin[2])) * times);
      const NifRay world = to_world(ray, out.transform);
      const float *d = world.direction, *o = world.origin;
      const double exact = skew.slope() * (double(d[0]) + double(d[1])) - skew.steep() * double(d[2]);
      const float rounded = (slope * d[0] + slope * d[1]) + -steep * d[2];
      if (!(exact - double(rounded) > most)) continue;
      most = exact - double(rounded);
      const double from = skew.slope() * (double(o[0]) + double(o[1])) - skew.steep() * double(o[2]);
      ray.tmax = float((double(level) - from) / exact);
      for (uint32_t more = 1 + random.below(3); more > 0; --more)
        ray.tmax = std::nextafter(ray.tmax, std::numeric_limits<float>::infinity());
      worst = ray;
    }
    out.rays.push_back(worst);
  }
  return out;
}

}  // namespace nif::test
