// Computes transforms of instances: inverses, products and boxes, in double precision, rounded to float once.
#include "scene/instance.hpp"

#include <cmath>
#include <limits>

#include "api/error.hpp"
#include "formats/base/rounding.hpp"
#include "query/float_environment.hpp"

namespace nif::runtime {

NIF_COMPUTES Instance make_instance(const Placement& placement) {
  const Transform& to_world = placement.to_world;
  for (const float value : to_world)
    if (!std::isfinite(value)) refuse_argument("the transform is not finite");
  Instance instance{};
  bool well_conditioned;
  if (!kernels::invert(to_world.data(), instance.to_object, well_conditioned, placement.remainder.data()))
    throw Failure(NIF_ERROR_SINGULAR_TRANSFORM, "the transform has no inverse: it flattens space");
  instance.identity = to_world == kIdentity && placement.remainder == Remainder{};
  instance.well_conditioned = well_conditioned;
  return instance;
}

NIF_COMPUTES Placement placement_of(const InstanceSettings& settings, const Origin& from) {
  Placement placement{settings.transform, settings.remainder};
  if (settings.origin == Origin{} && from == Origin{}) return placement;
  for (size_t a = 0; a < 3; ++a) {
    float& translation = placement.to_world[4 * a + 3];
    const double at = (double(translation) + double(settings.remainder[a])) + (settings.origin[a] - from[a]);
    translation = static_cast<float>(at);
    placement.remainder[a] = static_cast<float>(lost_to_float(at));
  }
  return placement;
}

NIF_COMPUTES Placement combine(const Transform& second, const Placement& first) {
  Placement result;
  const bool remains = first.remainder != Remainder{};
  for (size_t row = 0; row < 3; ++row)
    for (size_t column = 0; column < 4; ++column) {
      double sum = column == 3 ? double(second[4 * row + 3]) : 0.0;
      for (size_t k = 0; k < 3; ++k)
        sum += double(second[4 * row + k]) *
               (double(first.to_world[4 * k + column]) + (column == 3 ? double(first.remainder[k]) : 0.0));
      result.to_world[4 * row + column] = static_cast<float>(sum);
      if (remains && column == 3) result.remainder[row] = static_cast<float>(lost_to_float(sum));
    }
  return result;
}

NIF_COMPUTES kernels::WorldBox world_box(const kernels::ObjectBox& object, const Placement& placement) {
  return kernels::world_box(object, placement.to_world.data(), placement.remainder.data());
}

kernels::WorldBox empty_box() {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  return {{kInfinity, kInfinity, kInfinity}, {-kInfinity, -kInfinity, -kInfinity}};
}

}  // namespace nif::runtime
