// A ray's numbers are a hash of the seed and the ray's place. So any part of a set can be made alone, in
// any order, and its rays are the same.
#include "proof_ray_sets.hpp"

#include <cmath>
#include <limits>

namespace nif::test {
namespace {

/// Numbers of one ray: a hash of seed, ray and how many were drawn before.
class Numbers {
 public:
  Numbers(uint64_t seed, uint64_t ray) : state_(hash(seed) ^ ray * 0x9e3779b97f4a7c15u) {}
  /// 0 to 1, 1 excluded.
  double unit() { return double(hash(state_++ * 0xd1342543de82ef95u) >> 11) * 0x1p-53; }

 private:
  /// The end of splitmix64.
  static uint64_t hash(uint64_t x) {
    x = (x ^ x >> 30) * 0xbf58476d1ce4e5b9u;
    x = (x ^ x >> 27) * 0x94d049bb133111ebu;
    return x ^ x >> 31;
  }
  uint64_t state_;
};

struct Vector {
  double x, y, z;
};
Vector operator+(Vector a, Vector b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
Vector operator*(double s, Vector a) { return {s * a.x, s * a.y, s * a.z}; }
Vector cross(Vector a, Vector b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
Vector unit(Vector a) { return 1 / std::sqrt(a.x * a.x + a.y * a.y + a.z * a.z) * a; }

Vector any_direction(Numbers& numbers) {
  const double z = 2 * numbers.unit() - 1, angle = 2 * 3.14159265358979 * numbers.unit(),
               r = std::sqrt(1 - z * z);
  return {r * std::cos(angle), r * std::sin(angle), z};
}

/// Two directions across the given one.
void set_across(Vector direction, Vector& u, Vector& v) {
  u = unit(cross(direction, std::fabs(direction.x) < 0.5 ? Vector{1, 0, 0} : Vector{0, 1, 0}));
  v = cross(direction, u);
}

NifRay to_ray(Vector o, Vector d, float tmax) {
  return {{float(o.x), float(o.y), float(o.z)}, 0, {float(d.x), float(d.y), float(d.z)}, tmax};
}

}  // namespace

const char* name_of(BoxRays set) {
  constexpr const char* kNames[] = {"lines", "inner", "segments", "sun"};
  return kNames[size_t(set)];
}

std::vector<NifRay> make_rays(BoxRays set, const float low[3], const float high[3], uint64_t seed,
                              uint64_t first, uint64_t count, uint64_t all) {
  constexpr float kEndless = std::numeric_limits<float>::infinity();
  const Vector corner{low[0], low[1], low[2]},
      size{double(high[0]) - low[0], double(high[1]) - low[1], double(high[2]) - low[2]};
  const Vector centre = corner + 0.5 * size;
  const double diagonal = std::sqrt(size.x * size.x + size.y * size.y + size.z * size.z),
               radius = diagonal / 2;
  const auto columns = uint64_t(std::ceil(std::sqrt(double(all))));
  std::vector<NifRay> rays;
  rays.reserve(count);
  for (uint64_t i = first; i < first + count; ++i) {
    Numbers numbers(seed, i);
    const auto in_box = [&] {
      const double x = numbers.unit(), y = numbers.unit(), z = numbers.unit();
      return corner + Vector{x * size.x, y * size.y, z * size.z};
    };
    Vector u, v;
    switch (set) {
      case BoxRays::lines: {
        const Vector direction = any_direction(numbers);
        set_across(direction, u, v);
        const double r = radius * std::sqrt(numbers.unit()), angle = 2 * 3.14159265358979 * numbers.unit();
        const Vector at = centre + r * std::cos(angle) * u + r * std::sin(angle) * v;
        rays.push_back(to_ray(at + -2 * radius * direction, direction, kEndless));
        break;
      }
      case BoxRays::inner: {
        const Vector at = in_box();
        rays.push_back(to_ray(at, any_direction(numbers), kEndless));
        break;
      }
      case BoxRays::segments: {
        const Vector at = in_box(), direction = any_direction(numbers);
        rays.push_back(to_ray(at, direction, float(diagonal * std::pow(100.0, numbers.unit() - 1))));
        break;
      }
      case BoxRays::sun: {
        const Vector direction = unit({0.3, -0.8, 0.52});
        set_across(direction, u, v);
        const double across = (double(i % columns) + numbers.unit()) / double(columns),
                     down = (double(i / columns) + numbers.unit()) / double(columns);
        const Vector at = centre + radius * (2 * across - 1) * u + radius * (2 * down - 1) * v;
        rays.push_back(to_ray(at + -radius * direction, direction, kEndless));
        break;
      }
    }
  }
  return rays;
}

}  // namespace nif::test
