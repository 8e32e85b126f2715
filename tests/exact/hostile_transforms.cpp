// Transforms that rays may not survive: each says what it attacks.
#include <array>

#include "formats/mesh/transform.hpp"
#include "tests/exact/draws.hpp"
#include "tests/exact/generators.hpp"

namespace nif::test {
namespace {

Transform transform_of(const std::array<Double3, 3>& rows, const Double3& translation = {}) {
  Transform t;
  for (size_t r = 0; r < 3; ++r) {
    for (size_t c = 0; c < 3; ++c) t[4 * r + c] = float(rows[r][c]);
    t[4 * r + 3] = float(translation[r]);
  }
  return t;
}
std::array<Double3, 3> diagonal(double x, double y, double z) {
  return {Double3{x, 0, 0}, Double3{0, y, 0}, Double3{0, 0, z}};
}
Double3 any_translation(const mesh::Box& box, nif::Random& random) {
  return random.below(2) ? Double3{} : arrow(random, 0.1, 10) * size_of(box);
}

/// Leaves rays as they are, to the bit.
Transform identity(const mesh::Box&, nif::Random&) { return mesh::kIdentity; }

/// Often exact.
Transform translation(const mesh::Box& box, nif::Random& random) {
  const double step = random.below(2) ? 1 : step_of(box, random);
  return transform_of(diagonal(1, 1, 1), whole_vector(random, 16) * step);
}

/// So far that rounding the origin moves a ray by more than what may be called certain.
Transform large_translation(const mesh::Box& box, nif::Random& random) {
  return transform_of(diagonal(1, 1, 1), arrow(random, 1e3, 1e6) * extent_of(box));
}

/// Rounded: it moves rays by little.
Transform rotation(const mesh::Box& box, nif::Random& random) {
  const auto rows = random_rotation(random);
  return transform_of(rows, any_translation(box, random));
}

/// Swaps axes, and mirrors some: exact.
Transform quarter_turn(const mesh::Box&, nif::Random& random) {
  std::array<Double3, 3> rows{};
  const size_t first = random.below(3), step = 1 + random.below(2);
  for (size_t r = 0; r < 3; ++r) rows[r][(first + step * r) % 3] = sign(random);
  return transform_of(rows);
}

/// Turns triangles around: what is inside stays so.
Transform mirror(const mesh::Box& box, nif::Random& random) {
  const Double3 n = random.direction();
  std::array<Double3, 3> rows = diagonal(1, 1, 1);
  for (size_t r = 0; r < 3; ++r) rows[r] = rows[r] - n * (2 * n[r]);
  if (random.below(2)) {
    const double x = sign(random), y = sign(random);
    rows = diagonal(x, y, -1);
  }
  return transform_of(rows, any_translation(box, random));
}

Transform uniform_scale(const mesh::Box& box, nif::Random& random) {
  const double scale = random.below(2) ? spread(random, 1e-3, 1e3) : power(random, -10, 10);
  return transform_of(diagonal(scale, scale, scale), any_translation(box, random));
}

/// Directions turn: what was long may become short.
Transform uneven_scale(const mesh::Box& box, nif::Random& random) {
  const double most = random.below(2) ? 4 : 100;
  const auto scale = [&] {
    const double size = spread(random, 1 / most, most);
    return size * sign(random);
  };
  const double x = scale(), y = scale(), z = scale();
  return transform_of(diagonal(x, y, z), any_translation(box, random));
}

/// Up to the condition number of 3 * 4096 at which answers are no more certain, close to it, and beyond. That
/// of a shear by s is s * s + 3.
Transform shear(const mesh::Box& box, nif::Random& random) {
  constexpr double kLimit = 110.837;
  const uint32_t kind = random.below(4);
  const double by = kind == 0   ? kLimit + arrow(random, 1e-4, 1)[0]
                    : kind == 1 ? kLimit * random.uniform(1, 1.1)
                                : spread(random, 0.01, kLimit);
  std::array<Double3, 3> rows = diagonal(1, 1, 1);
  const size_t row = random.below(3);
  rows[row][(row + 1 + random.below(2)) % 3] = by * sign(random);
  if (random.below(2)) {  // turned, which changes no condition number
    const auto turn = random_rotation(random);
    std::array<Double3, 3> turned{};
    for (size_t r = 0; r < 3; ++r)
      for (size_t k = 0; k < 3; ++k) turned[r] = turned[r] + rows[k] * turn[r][k];
    rows = turned;
  }
  return transform_of(rows, any_translation(box, random));
}

/// Lengths of directions in object space come close to the ends of what is valid.
Transform extreme_scale(const mesh::Box& box, nif::Random& random) {
  const double scale = chance(random, 3) ? power(random, -40, 30) : random.below(2) ? 0x1p-40 : 0x1p30;
  return transform_of(diagonal(scale, scale, scale), any_translation(box, random) * scale);
}

/// One after the other, as hierarchies of scenes make them.
Transform combined(const mesh::Box& box, nif::Random& random) {
  constexpr Transform (*kParts[])(const mesh::Box&, nif::Random&) = {
      translation, rotation, quarter_turn, mirror, uniform_scale, uneven_scale, shear, large_translation};
  for (;;) {
    Transform t = mesh::kIdentity;
    for (int count = between(random, 2, 3); count > 0; --count) {
      const size_t part = random.below(chance(random, 4) ? 8 : 6);  // most stay certain
      t = mesh::compose(kParts[part](box, random), t);
    }
    if (!mesh::flattens(t)) return t;
  }
}

constexpr TransformGenerator kTransforms[] = {
    {"identity", identity},
    {"translation", translation},
    {"large translation", large_translation},
    {"rotation", rotation},
    {"quarter turn", quarter_turn},
    {"mirror", mirror},
    {"uniform scale", uniform_scale},
    {"uneven scale", uneven_scale},
    {"shear", shear},
    {"extreme scale", extreme_scale},
    {"combined", combined},
};

}  // namespace

std::span<const TransformGenerator> transform_generators() { return kTransforms; }

}  // namespace nif::test
