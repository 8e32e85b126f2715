// One placed object: how a ray gets from world to object space, when a proof there also holds in the world,
// and which rays can skip the object. As everywhere in kernels/reference, the order of operations defines the
// answer.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "kernels/reference/arithmetic.hpp"
#include "kernels/reference/ray.hpp"

namespace nif::kernels {

/// Transform from world to object space: p -> inverse ((p - translation) - remainder).
struct WorldToObject {
  float inverse[9];      ///< of the transform's linear part, row-major, computed in double
  float translation[3];  ///< rounded to float
  float remainder[3];    ///< what rounding took from the translation; 0 if it is exact
};

/// Transforms are row-major 3x4, object to world. Returns false if there is no inverse in single precision.
/// well_conditioned: the inverse is as good as its rounding to float, up to a scale of 1 : 4096. `remainder`,
/// if not null, is added to the translation; it is at most half a unit in the translation's last place.
inline bool invert(const float to_world[12], WorldToObject& transform, bool& well_conditioned,
                   const float* remainder = nullptr) {
  double m[9], inverse[9], norm = 0, inverse_norm = 0;
  for (int i = 0; i < 9; ++i) m[i] = double(to_world[i / 3 * 4 + i % 3]);
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 3; ++column) {
      const int r1 = (column + 1) % 3, r2 = (column + 2) % 3, c1 = (row + 1) % 3, c2 = (row + 2) % 3;
      inverse[3 * row + column] = m[3 * r1 + c1] * m[3 * r2 + c2] - m[3 * r1 + c2] * m[3 * r2 + c1];
    }
  const double determinant = m[0] * inverse[0] + m[1] * inverse[3] + m[2] * inverse[6];
  for (int i = 0; i < 9; ++i) {
    inverse[i] /= determinant;
    transform.inverse[i] = static_cast<float>(inverse[i]);
    if (!is_finite(transform.inverse[i])) return false;
    norm += m[i] * m[i];
    inverse_norm += inverse[i] * inverse[i];
  }
  for (int row = 0; row < 3; ++row) {
    transform.translation[row] = to_world[4 * row + 3];
    transform.remainder[row] = remainder ? remainder[row] : 0;
  }
  well_conditioned = std::sqrt(norm) * std::sqrt(inverse_norm) <= 4096.0 * 3;
  return true;
}

/// A coordinate relative to the instance's origin. Either the first difference is exact, or the remainder is
/// less than 2^-22 of it; so the second difference rounds no worse than the first would alone.
NIF_HOST_DEVICE inline float from_instance(const WorldToObject& transform, int axis, float coordinate) {
  return (coordinate - transform.translation[axis]) - transform.remainder[axis];
}

/// Transforms the ray to object space. Subtracts the translation first, which costs no precision near the
/// instance, then applies the linear part. Not for identity transforms, which leave rays as they are.
NIF_HOST_DEVICE inline Segment to_object(const WorldToObject& transform, const Segment& world) {
  const float* m = transform.inverse;
  const float o[3] = {from_instance(transform, 0, world.origin[0]),
                      from_instance(transform, 1, world.origin[1]),
                      from_instance(transform, 2, world.origin[2])};
  const float* d = world.direction;
  Segment local;
  for (int a = 0; a < 3; ++a) {
    local.origin[a] = (m[3 * a] * o[0] + m[3 * a + 1] * o[1]) + m[3 * a + 2] * o[2];
    local.direction[a] = (m[3 * a] * d[0] + m[3 * a + 1] * d[1]) + m[3 * a + 2] * d[2];
  }
  local.tmin = world.tmin;
  local.tmax = world.tmax;
  return local;
}

/// How far the corners of an object's box may lie from the origin of its space, in units of kCertainReach.
inline constexpr float kMostOffset = 0x1p+11f;

/// Does an answer that is certain for the ray in object space also hold for the ray in world space? Yes if
/// rounding on the way moved the ray by less than 1/218 of a finest cell, a third of the padding of cells:
/// - origin: at most 5 roundings of 2^-24, each of the sum of magnitudes, which is kept below 2^11 cells; at
///   most 6 if the translation has a remainder, of a sum that is kept below 2^11 / 1.25;
/// - direction: at most 4, each of the sum of magnitudes, kept below 4 times the direction itself, over the
///   at most 2^11 + kMostOffset cells that the ray travels along any axis until it leaves the grid.
/// The rounding of the traversal itself, at less than a third of its allowed reach, takes at most another
/// third of the padding, and both together less than the margin of planes (docs/encodings/segment.md,
/// "Instances").
///
/// A `bvh` object counts units instead of cells, kBvhUnits to its extent: nothing pads its triangles, and its
/// answer is that of a ray moved by less than 2^-14 of the extent (whose corners are at most 64 units away).
/// A `spherical` object counts kSphericalUnits to its diagonal, with kSphericalMargin.
///
/// Assumes that the inverse is as good as its rounding to float. Not for identity transforms, where the
/// answer is always yes.
NIF_HOST_DEVICE inline bool stays_certain(const WorldToObject& transform, float reach_scale,
                                          const Segment& world, const Segment& local) {
  const float* m = transform.inverse;
  float reach = 0, spread = 0, steepest = 0;
  bool remains = false;
  for (int a = 0; a < 3; ++a) {
    float origin = 0, direction = 0;
    remains = remains || transform.remainder[a] != 0;
    for (int b = 0; b < 3; ++b) {
      origin += magnitude(m[3 * a + b]) * magnitude(from_instance(transform, b, world.origin[b]));
      direction += magnitude(m[3 * a + b]) * magnitude(world.direction[b]);
    }
    reach = max_of(origin, reach);
    spread = max_of(direction, spread);
    steepest = max_of(magnitude(local.direction[a]), steepest);
  }
  if (remains) reach *= 1.25f;
  return world.tmin > world.tmax || (reach * reach_scale <= kCertainReach / 8 && spread <= 4 * steepest);
}

// ---- The box test: in a scene of several instances an object sees only the rays that may meet its box.
//
// The box contains the object's whole grid and kBoxMargin more voxels (or its BVH and as large a margin),
// computed in double and rounded outward. The test below may pass rays that miss the box but never stops one
// that meets it: each t carries at most 3 roundings, 3 * 2^-24 of itself, and the slack is 2^-16. So a ray
// that is stopped certainly misses the object, however far away it starts. And a ray that is in reach of the
// object's proofs and meets its grid in object space is never stopped, because rounding on the way to object
// space moves it by less than the margin.
//
// If t is too small for that slack, kLeastSlack covers underflow. A t beyond kMostT counts as kMostT, because
// it may overflow although tmax is finite.
//
// If the direction is 0 along an axis, the distances to the box's planes are infinities whose sign tells on
// which side the origin lies, so the ray is always inside or always outside. If the origin lies on a plane,
// the distance is NaN, and the order in min_of and max_of makes the ray a miss, as it misses all boxes
// within. (Such a ray with a tmin or tmax beyond kMostT may pass the box but miss a box around it; it misses
// the object.) A component smaller than kLeastComponent counts as 0. No difference of a plane and an origin
// overflows, because both are limited.

inline constexpr float kBoxSlack = 0x1p-16f;
inline constexpr float kLeastSlack = 0x1p-130f;
inline constexpr float kMostT = 0x1p+127f;
inline constexpr float kLeastComponent = 0x1p-126f;
inline constexpr float kUnlimited = std::numeric_limits<float>::infinity();
inline constexpr float kMostPlane = 0x1p+127f;
inline constexpr float kToOverflow = 4;  ///< times a distance that is too large: 2^126 and more

struct WorldBox {
  float min[3], max[3];
};

inline WorldBox world_box(const ObjectBox& object, const float to_world[12],
                          const float* remainder = nullptr) {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  WorldBox box;
  for (int row = 0; row < 3; ++row) {
    double least = double(to_world[4 * row + 3]) + (remainder ? double(remainder[row]) : 0), most = least;
    for (int a = 0; a < 3; ++a) {
      const double m = double(to_world[4 * row + a]);
      least += m * (m < 0 ? object.high[a] : object.low[a]);
      most += m * (m < 0 ? object.low[a] : object.high[a]);
    }
    // Planes only move outward.
    box.min[row] = std::min(std::nextafter(static_cast<float>(least), -kInfinity), kMostPlane);
    box.max[row] = std::max(std::nextafter(static_cast<float>(most), kInfinity), -kMostPlane);
  }
  return box;
}

/// What the box test needs besides a ray's origin, tmin and tmax: 1 / direction, infinity if that is 0.
struct BoxRay {
  float inverse[3];
};

/// Returns false if the ray is invalid, so that no object sees it: a number is not finite (tmin and tmax may
/// be infinite), the origin is 2^126 or more, the direction is zero or too small or too large to compute
/// with, or tmin > tmax.
NIF_HOST_DEVICE inline bool prepare_box_ray(const Segment& ray, BoxRay& prepared) {
  float steepest = 0;
  bool finite = true;
  for (int a = 0; a < 3; ++a) {
    finite = finite && is_finite(ray.origin[a] * kToOverflow) && is_finite(ray.direction[a]);
    steepest = max_of(magnitude(ray.direction[a]), steepest);
  }
  for (int a = 0; a < 3; ++a) {
    const float d = ray.direction[a];
    prepared.inverse[a] = 1.0f / (magnitude(d) >= kLeastComponent ? d : 0.0f);
  }
  return finite && steepest >= kMinDirection && steepest <= kMaxDirection && ray.tmin <= ray.tmax;
}

/// The interval of t, within the ray's own, in which the ray may be in a box; empty if enter > leave.
struct BoxPassage {
  float enter, leave;
};

/// Each operation is monotone in the box's planes: a ray that passes a box passes each box around it. If one of
/// near and far is NaN, the other is an infinity, and NaN is skipped as if it were the same infinity.
NIF_HOST_DEVICE inline BoxPassage pass_box(const WorldBox& box, const Segment& ray, const BoxRay& prepared) {
  float near[3], far[3];
  for (int a = 0; a < 3; ++a) {
    const float low = (box.min[a] - ray.origin[a]) * prepared.inverse[a];
    const float high = (box.max[a] - ray.origin[a]) * prepared.inverse[a];
    near[a] = min_of(low, high);
    far[a] = max_of(high, low);
  }
  const float enter = max_of(near[2], max_of(near[1], max_of(near[0], -kUnlimited)));
  const float leave = min_of(far[2], min_of(far[1], min_of(far[0], kUnlimited)));
  const float first = min_of(enter * (1 - kBoxSlack), enter * (1 + kBoxSlack)) - kLeastSlack;
  const float last = max_of(leave * (1 - kBoxSlack), leave * (1 + kBoxSlack)) + kLeastSlack;
  return {max_of(min_of(first, kMostT), ray.tmin), min_of(max_of(last, -kMostT), ray.tmax)};
}

NIF_HOST_DEVICE inline bool may_meet(const WorldBox& box, const Segment& ray, const BoxRay& prepared) {
  const BoxPassage passage = pass_box(box, ray, prepared);
  return passage.enter <= passage.leave;
}

}  // namespace nif::kernels
