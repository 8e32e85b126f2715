// Transforms of instances: inverses and products in double, rounded to float once.
#include "instance.hpp"

#include <cmath>
#include <limits>

#include "error.hpp"
#include "float_environment.hpp"

namespace nif::runtime {
namespace {

/// Beyond this product of norms (a scale of 1 : 4096) the inverse's own error may show in float.
constexpr double kGoodCondition = 4096.0 * 3;

double norm(const double m[9]) {
  double sum = 0;
  for (int i = 0; i < 9; ++i) sum += m[i] * m[i];
  return std::sqrt(sum);
}

}  // namespace

NIF_COMPUTES Instance make_instance(const format::ObjectView& object, const kernels::ObjectKernel& kernel,
                                    const Transform& to_world) {
  Instance instance{&object, &kernel, to_world, {}, to_world == kIdentity, true};
  for (const float value : to_world)
    if (!std::isfinite(value)) refuse_argument("the transform is not finite");
  double m[9], inverse[9];
  for (size_t i = 0; i < 9; ++i) m[i] = double(to_world[i / 3 * 4 + i % 3]);
  for (size_t row = 0; row < 3; ++row)
    for (size_t column = 0; column < 3; ++column) {
      const size_t r1 = (column + 1) % 3, r2 = (column + 2) % 3, c1 = (row + 1) % 3, c2 = (row + 2) % 3;
      inverse[3 * row + column] = m[3 * r1 + c1] * m[3 * r2 + c2] - m[3 * r1 + c2] * m[3 * r2 + c1];
    }
  const double determinant = m[0] * inverse[0] + m[1] * inverse[3] + m[2] * inverse[6];
  for (size_t i = 0; i < 9; ++i) {
    inverse[i] /= determinant;
    instance.inverse[i] = static_cast<float>(inverse[i]);
    if (!std::isfinite(instance.inverse[i]))
      throw Failure(NIF_ERROR_SINGULAR_TRANSFORM, "the transform flattens space and has no inverse");
  }
  instance.well_conditioned = norm(m) * norm(inverse) <= kGoodCondition;
  return instance;
}

NIF_COMPUTES Transform combine(const Transform& second, const Transform& first) {
  Transform result;
  for (size_t row = 0; row < 3; ++row)
    for (size_t column = 0; column < 4; ++column) {
      double sum = column == 3 ? double(second[4 * row + 3]) : 0.0;
      for (size_t k = 0; k < 3; ++k) sum += double(second[4 * row + k]) * double(first[4 * k + column]);
      result[4 * row + column] = static_cast<float>(sum);
    }
  return result;
}

NIF_COMPUTES Box world_bounds(const Instance& instance) {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  Box box{{kInfinity, kInfinity, kInfinity}, {-kInfinity, -kInfinity, -kInfinity}};
  for (size_t corner = 0; corner < 8; ++corner)
    for (size_t row = 0; row < 3; ++row) {
      double at = double(instance.to_world[4 * row + 3]);
      for (size_t a = 0; a < 3; ++a) {
        const float end = (corner >> a) & 1 ? instance.object->aabb_max[a] : instance.object->aabb_min[a];
        at += double(instance.to_world[4 * row + a]) * double(end);
      }
      box.min[row] = std::min(box.min[row], std::nextafter(static_cast<float>(at), -kInfinity));
      box.max[row] = std::max(box.max[row], std::nextafter(static_cast<float>(at), kInfinity));
    }
  return box;
}

}  // namespace nif::runtime
