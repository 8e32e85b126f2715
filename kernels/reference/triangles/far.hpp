// Moves rays that start far away along themselves to the object.
//
// Boxes grow by a fraction of the ray's largest coordinate, because rounding may move the ray by that much.
// From far away they would grow until the ray met all of them. So boxes and planes see a ray that starts near
// the object, computed in double precision. Triangles see the original ray: they decide the answer, which
// stays the same (docs/encodings/bvh.md, "Rays from far away").
#pragma once

#include "kernels/reference/hit.hpp"
#include "kernels/reference/ray.hpp"
#include "kernels/reference/triangles/triangles_field.hpp"

namespace nif::kernels {

/// Rays that start more extents away than this are moved.
inline constexpr float kBvhMovedFrom = 64;
/// Rays that start more extents away than this meet nothing: rounding in double precision would be as large
/// as the boxes.
inline constexpr float kBvhFarthest = 0x1p32f;
/// What counts as the reach of a moved ray: more than its own, because its origin and ends are rounded too,
/// plus this fraction of its original reach. The padding is then twice the error of triangles in double
/// precision at that distance.
inline constexpr float kMovedReach = 1.5f, kFarReach = 0x1p-21f;

NIF_HOST_DEVICE inline float largest_of(const float v[3]) {
  return max_of(magnitude(v[2]), max_of(magnitude(v[1]), magnitude(v[0])));
}

/// The next float above x; infinity stays infinity.
NIF_HOST_DEVICE inline float next_above(float x) {
  if (!(x < kNoHit)) return x;
  const uint32_t bits = bits_as<uint32_t>(x);
  return bits_as<float>(x < 0 ? bits - 1 : (bits & 0x7fffffff) + 1);
}

/// t counted from `start`, rounded down and up. If start is 0 it is t.
NIF_HOST_DEVICE inline float from_start_down(float t, float start) {
  return start == 0 ? t : -next_above(-(t - start));
}
NIF_HOST_DEVICE inline float from_start_up(float t, float start) {
  return start == 0 ? t : next_above(t - start);
}

/// Approximately the t at which a ray from far away is nearest to the origin of object space; 0 if it is not
/// far away. Undefined for invalid rays.
NIF_HOST_DEVICE NIF_RARE_PART_OF_KERNEL float start_of(const TrianglesField& field, const Segment& segment) {
  if (!(largest_of(segment.origin) > field.extent * kBvhMovedFrom)) return 0;
  float along = 0, square = 0;
  NIF_UNROLL
  for (int a = 0; a < 3; ++a) {
    along += segment.origin[a] * segment.direction[a];
    square += segment.direction[a] * segment.direction[a];
  }
  return -along / square;
}

/// A ray's position at `start` along an axis. The product is exact in double precision, so only the sum is
/// rounded, and the result once more.
NIF_HOST_DEVICE inline float moved_origin(const Segment& segment, int axis, float start) {
  return static_cast<float>(static_cast<double>(segment.origin[axis]) +
                            static_cast<double>(start) * static_cast<double>(segment.direction[axis]));
}

/// The same points with t counted from `start`, extended a little at both ends.
NIF_HOST_DEVICE NIF_RARE_PART_OF_KERNEL Segment moved_to(float start, const Segment& segment) {
  Segment near = segment;
  NIF_UNROLL
  for (int a = 0; a < 3; ++a) near.origin[a] = moved_origin(segment, a, start);
  near.tmin = from_start_down(segment.tmin, start);
  near.tmax = from_start_up(segment.tmax, start);
  return near;
}

/// Replaces the larger of the ray's largest origin coordinate and the extent: `reach` after the move, `far`
/// before it.
NIF_HOST_DEVICE inline float moved_reach(float reach, float far) {
  return reach * kMovedReach + far * kFarReach;
}

}  // namespace nif::kernels
