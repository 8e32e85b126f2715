// One placed object: how a ray gets from world to object space, and when an answer is still proven there.
#pragma once

#include <array>

#include "formats/nif/reader.hpp"
#include "kernels/object_kernel.hpp"
#include "kernels/reference/segment.hpp"

namespace nif::runtime {

using Transform = std::array<float, 12>;  ///< row-major 3x4
inline constexpr Transform kIdentity{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};

struct Instance {
  const format::ObjectView* object;
  const kernels::ObjectKernel* kernel;  ///< answers the object
  Transform to_world;
  float inverse[9];       ///< of to_world's linear part, computed in double, row-major
  bool identity;          ///< rays are taken as they are
  bool well_conditioned;  ///< the inverse is as good as its rounding to float
};

/// Throws Failure where the transform is not finite or has no inverse.
Instance make_instance(const format::ObjectView& object, const kernels::ObjectKernel& kernel,
                       const Transform& to_world);

/// first, then second; computed in double.
Transform combine(const Transform& second, const Transform& first);

/// The world box around the object's bounds, grown to the next floats outward.
struct Box {
  float min[3], max[3];
};
Box world_bounds(const Instance& instance);

/// The ray in object space. Like everything in kernels/reference this order of operations defines the answer:
/// the translation is taken off first, where it costs no precision near the instance, then the linear part.
inline kernels::Segment to_object(const Instance& instance, const kernels::Segment& world) {
  if (instance.identity) return world;
  const float* m = instance.inverse;
  const float o[3] = {world.origin[0] - instance.to_world[3], world.origin[1] - instance.to_world[7],
                      world.origin[2] - instance.to_world[11]};
  const float* d = world.direction;
  kernels::Segment local;
  for (int a = 0; a < 3; ++a) {
    local.origin[a] = (m[3 * a] * o[0] + m[3 * a + 1] * o[1]) + m[3 * a + 2] * o[2];
    local.direction[a] = (m[3 * a] * d[0] + m[3 * a + 1] * d[1]) + m[3 * a + 2] * d[2];
  }
  local.tmin = world.tmin;
  local.tmax = world.tmax;
  return local;
}

/// Does an answer that is certain for the ray in object space hold for the ray in world space? Yes where
/// rounding on the way moved it by less than 1/256 voxel, a quarter of what voxels are padded by:
/// - origin: at most 5 roundings of 2^-24, each of the sum of magnitudes, which is kept below 2^11 voxels;
/// - direction: at most 4, each of the sum of magnitudes, kept below 4 times the direction itself, over the
///   at most 2^11 + 512 voxels that the ray travels along any axis until it leaves the grid.
/// The walk's own rounding, at an eighth of its allowed reach, takes at most an eighth of the padding.
inline bool stays_certain(const Instance& instance, const kernels::Segment& world,
                          const kernels::Segment& local) {
  if (instance.identity || world.tmin > world.tmax) return true;
  const float* m = instance.inverse;
  float reach = 0, spread = 0, steepest = 0;
  for (int a = 0; a < 3; ++a) {
    float origin = 0, direction = 0;
    for (int b = 0; b < 3; ++b) {
      origin += kernels::magnitude(m[3 * a + b]) *
                kernels::magnitude(world.origin[b] - instance.to_world[size_t(4 * b + 3)]);
      direction += kernels::magnitude(m[3 * a + b]) * kernels::magnitude(world.direction[b]);
    }
    reach = kernels::max_of(origin, reach);
    spread = kernels::max_of(direction, spread);
    steepest = kernels::max_of(kernels::magnitude(local.direction[a]), steepest);
  }
  return instance.well_conditioned &&
         reach * instance.object->field.voxels_per_unit <= kernels::kCertainReach / 8 &&
         spread <= 4 * steepest;
}

}  // namespace nif::runtime
