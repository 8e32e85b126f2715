// Answers a query of one `bvh` object: does the segment meet one of its triangles?
//
// Triangles decide, in double precision, each alone; boxes only save time, because they grow by more than all
// rounding (docs/encodings/bvh.md, "Boxes never change an answer"). So neither the order of traversal nor the
// number of boxes tested at a time can change the bit.
#pragma once

#include "kernels/reference/hit.hpp"
#include "kernels/reference/ray.hpp"
#include "kernels/reference/triangles/far.hpp"
#include "kernels/reference/triangles/triangles_field.hpp"

namespace nif::kernels {

/// Boxes grow by this fraction of the largest coordinate of the ray's origin or the root's frame: 16 units in
/// its last place, while rounding of the box test comes to at most 7.
inline constexpr float kBvhPadding = 0x1p-20f;
/// Box tests raise components of the direction below this fraction of the largest to this fraction, which
/// moves a ray by less than a hundredth of the padding.
inline constexpr float kBvhFlattest = 0x1p-30f;
/// For origins farther away than this many extents, answers are not called certain.
inline constexpr float kBvhReach = 0x1p20f;

/// A triangle is seen nearly edge-on if twice its area is a smaller fraction than this of its larger extent
/// squared.
inline constexpr float kEdgeOn = 0x1p-2f;
/// Bound of the rounding error of a sheared coordinate, as a fraction of the largest coordinate of the ray's
/// origin or the root's frame: 16 units in the last place.
template <class Real>
inline constexpr Real kShearError = static_cast<Real>(sizeof(Real) == 8 ? 0x1p-49 : 0x1p-20);
/// Times the square of that error: bounds the error of a side, however large the triangle is.
template <class Real>
inline constexpr Real kSurelyApart = 128 / kShearError<Real>;

/// v[axis], without indexing an array by a variable.
NIF_HOST_DEVICE constexpr float component(const float v[3], int axis) {
  return axis == 0 ? v[0] : axis == 1 ? v[1] : v[2];
}

/// A segment prepared for triangle tests. Real: the precision of the tests; double, except in measurements of
/// its cost. The longest axis comes last; the others keep their cyclic order.
template <class Real>
struct TriangleRayOf {
  int axis[3];
  Real origin[3];  ///< by `axis`
  Real shear[2];   ///< slopes of the other two axes against the longest
  Real length;     ///< the direction's longest component, with its sign
  Real error;      ///< bounds the rounding error of a sheared coordinate
  Real tmin, tmax;
};
using TriangleRay = TriangleRayOf<double>;

/// A segment prepared for box tests, too.
template <class Real>
struct BvhRayOf : TriangleRayOf<Real> {
  // Boxes, in single precision. Entry planes count from `near`, exit planes from `far`, which makes boxes
  // larger. Their t counts from `start`, which is 0 unless the ray comes from far away.
  float near[3], far[3], inverse[3];
  float enter, leave;
  float start;
  bool negative[3];
};
using BvhRay = BvhRayOf<double>;

/// For a segment that prepare_ray() accepts.
template <class Real>
NIF_HOST_DEVICE NIF_PART_OF_KERNEL void prepare_for_triangles(const TrianglesField& field,
                                                              const Segment& segment,
                                                              TriangleRayOf<Real>& ray) {
  const float* d = segment.direction;
  int z = magnitude(d[1]) > magnitude(d[0]) ? 1 : 0;
  if (magnitude(d[2]) > magnitude(component(d, z))) z = 2;
  NIF_UNROLL
  for (int i = 0; i < 3; ++i) {
    ray.axis[i] = (z + 1 + i) % 3;
    ray.origin[i] = static_cast<Real>(component(segment.origin, ray.axis[i]));
  }
  ray.length = static_cast<Real>(component(d, z));
  NIF_UNROLL
  for (int i = 0; i < 2; ++i) ray.shear[i] = static_cast<Real>(component(d, ray.axis[i])) / ray.length;
  ray.error = static_cast<Real>(max_of(largest_of(segment.origin), field.extent)) * kShearError<Real>;
  ray.tmin = static_cast<Real>(segment.tmin);
  ray.tmax = static_cast<Real>(segment.tmax);
}

/// Boxes see a ray that starts near them.
template <class Real>
NIF_HOST_DEVICE NIF_RARE_PART_OF_KERNEL void move_boxes(const TrianglesField& field, const Segment& segment,
                                                        float far, float steepest, BvhRayOf<Real>& ray) {
  float reach = field.extent;
  NIF_UNROLL
  for (int a = 0; a < 3; ++a) {
    ray.near[a] = moved_origin(segment, a, ray.start);
    reach = max_of(magnitude(ray.near[a]), reach);
  }
  reach = moved_reach(reach, far);
  const float padding = reach * kBvhPadding, farthest = 4 * reach / steepest;
  NIF_UNROLL
  for (int a = 0; a < 3; ++a) {
    const float outward = ray.negative[a] ? -padding : padding;
    ray.far[a] = ray.near[a] - outward;
    ray.near[a] += outward;
  }
  ray.enter = max_of(from_start_down(segment.tmin, ray.start), -farthest);
  ray.leave = min_of(from_start_up(segment.tmax, ray.start), farthest);
}

/// Returns false if the segment is invalid (docs/model.md); its answer is then visible.
template <class Real>
NIF_HOST_DEVICE bool prepare_ray(const TrianglesField& field, const Segment& segment, BvhRayOf<Real>& ray) {
  const float* d = segment.direction;
  float far = 0, steepest = 0;
  bool finite = true;
  NIF_UNROLL
  for (int a = 0; a < 3; ++a) {
    finite = finite && is_finite(segment.origin[a]) && is_finite(d[a]);
    far = max_of(magnitude(segment.origin[a]), far);
    steepest = max_of(magnitude(d[a]), steepest);
  }
  float reach = max_of(far, field.extent);
  if (!finite || !(reach <= kMaxBvhCoordinate) || !(far <= field.extent * kBvhFarthest) ||
      !(steepest >= kMinDirection) || !(steepest <= kMaxDirection))
    return false;
  if (!(segment.tmin <= segment.tmax)) return false;

  const float padding = reach * kBvhPadding, flattest = steepest * kBvhFlattest;
  NIF_UNROLL
  for (int a = 0; a < 3; ++a) {
    ray.negative[a] = d[a] < 0;
    const float outward = ray.negative[a] ? -padding : padding, size = max_of(magnitude(d[a]), flattest);
    ray.near[a] = segment.origin[a] + outward;
    ray.far[a] = segment.origin[a] - outward;
    ray.inverse[a] = 1.0f / (ray.negative[a] ? -size : size);
  }
  const float farthest = 4 * reach / steepest;  // no triangle is met beyond
  ray.enter = max_of(segment.tmin, -farthest);
  ray.leave = min_of(segment.tmax, farthest);
  ray.start = start_of(field, segment);
  if (ray.start != 0) move_boxes(field, segment, far, steepest, ray);

  prepare_for_triangles(field, segment, ray);
  return true;
}

/// May the ray meet something in a box between these planes, in a node with this frame?
template <class Real>
NIF_HOST_DEVICE bool meets_planes(const BvhRayOf<Real>& ray, const uint32_t frame[3], const uint8_t low[3],
                                  const uint8_t high[3]) {
  float enter = ray.enter, leave = ray.leave;
  NIF_UNROLL
  for (int a = 0; a < 3; ++a) {
    const float below = frame_plane(frame[a], low[a]), above = frame_plane(frame[a], high[a]);
    enter = max_of(((ray.negative[a] ? above : below) - ray.near[a]) * ray.inverse[a], enter);
    leave = min_of(((ray.negative[a] ? below : above) - ray.far[a]) * ray.inverse[a], leave);
  }
  return enter <= leave;
}

/// May the ray meet something in the slot's box?
NIF_HOST_DEVICE inline bool meets_box(const BvhRay& ray, const BvhNode& node, uint32_t slot) {
  const uint8_t low[3] = {node.low[0][slot], node.low[1][slot], node.low[2][slot]};
  const uint8_t high[3] = {node.high[0][slot], node.high[1][slot], node.high[2][slot]};
  return meets_planes(ray, node.frame, low, high);
}

/// Where a ray meets the plane of a triangle, as weights of its vertices and the sum of the weights.
template <class Real>
struct TriangleCrossing {
  Real t, weight[3], sum;
};

template <class Real>
NIF_HOST_DEVICE constexpr Real least_of(const Real a[3]) {
  const Real low = a[0] < a[1] ? a[0] : a[1];
  return a[2] < low ? a[2] : low;
}
template <class Real>
NIF_HOST_DEVICE constexpr Real most_of(const Real a[3]) {
  const Real high = a[0] > a[1] ? a[0] : a[1];
  return a[2] > high ? a[2] : high;
}
template <class Real>
NIF_HOST_DEVICE constexpr Real extent_of(const Real a[3]) {
  return most_of(a) - least_of(a);
}
template <class Real>
NIF_HOST_DEVICE constexpr Real size_of(Real x) {
  return x < 0 ? -x : x;
}
template <class Real>
NIF_HOST_DEVICE constexpr Real largest_of_two(Real x, Real y) {
  return size_of(x) > size_of(y) ? size_of(x) : size_of(y);
}

/// A vertex seen from the ray's origin and sheared so that the ray runs along z.
template <class Real>
struct SeenVertex {
  Real x, y, z;
};
template <class Real>
NIF_HOST_DEVICE NIF_PART_OF_KERNEL SeenVertex<Real> see(const TriangleRayOf<Real>& ray, const float* vertex) {
  const Real z = static_cast<Real>(vertex[ray.axis[2]]) - ray.origin[2];
  return {(static_cast<Real>(vertex[ray.axis[0]]) - ray.origin[0]) - ray.shear[0] * z,
          (static_cast<Real>(vertex[ray.axis[1]]) - ray.origin[1]) - ray.shear[1] * z, z};
}
/// How often weights are corrected, and how near their point must come to the ray, in errors of a sheared
/// coordinate.
inline constexpr int kCorrections = 16;
inline constexpr float kPointNear = 4;
/// If a triangle appears narrower than this many errors, its nearest edge counts as met.
inline constexpr float kEdgeNear = 128;

/// Where a ray passes a triangle for which sides in double precision are not accurate enough: the depth, and
/// weights of the vertices p, q, r, which start as the sides. Returns false if it does not.
///
/// Weights are corrected by the distance between their point and the ray, which is known accurately. So they
/// become right unless the triangle appears so narrow that its nearest edge will do. The edge also serves for
/// a ray that passes beside the triangle by no more than rounding may have moved it. Rarely needed code is in
/// loops, and vertices are sheared again in each, so that it takes few registers of GPU kernels.
template <class Real>
NIF_HOST_DEVICE NIF_RARE_PART_OF_KERNEL bool passes_close(const TriangleRayOf<Real>& ray, const float* p,
                                                          const float* q, const float* r, Real& a, Real& b,
                                                          Real& c, Real& depth) {
  // The three rotate: each loop leaves them in their original order.
  const auto turn = [](auto& first, auto& second, auto& third) {
    const auto was = first;
    first = second;
    second = third;
    third = was;
  };
  if (a == 0 && b == 0 && c == 0) return false;  // the ray lies in its plane
  const Real sum = (a + b) + c;
  bool found = false;
  if (sum != 0) {
    NIF_NO_UNROLL
    for (int n = 0; n < kCorrections && !found; ++n) {
      const Real whole = (a + b) + c;
      a /= whole;
      b /= whole;
      c /= whole;
      SeenVertex<Real> mean{0, 0, 0};
      NIF_NO_UNROLL
      for (int i = 0; i < 3; ++i) {
        const SeenVertex<Real> seen = see(ray, p);
        mean.x += a * seen.x;
        mean.y += a * seen.y;
        mean.z += a * seen.z;
        turn(p, q, r);
        turn(a, b, c);
      }
      found = largest_of_two(mean.x, mean.y) <= static_cast<Real>(kPointNear) * ray.error;
      depth = mean.z;
      NIF_NO_UNROLL
      for (int i = 0; i < 3 && !found; ++i) {
        const SeenVertex<Real> from = see(ray, q), to = see(ray, r);
        a -= (mean.x * (to.y - from.y) - mean.y * (to.x - from.x)) / sum;
        turn(p, q, r);
        turn(a, b, c);
      }
    }
    found = found && a >= 0 && b >= 0 && c >= 0;
  }
  if (found) return true;
  Real nearest = static_cast<Real>(kEdgeNear) * ray.error;
  NIF_NO_UNROLL
  for (int i = 0; i < 3; ++i) {
    const SeenVertex<Real> from = see(ray, p), to = see(ray, q);
    const Real along_x = to.x - from.x, along_y = to.y - from.y;
    const Real square = along_x * along_x + along_y * along_y;
    Real part = square > 0 ? -(from.x * along_x + from.y * along_y) / square : 0;
    part = part < 0 ? 0 : part > 1 ? 1 : part;
    const Real distance = largest_of_two(from.x + part * along_x, from.y + part * along_y);
    if (distance <= nearest) {
      nearest = distance;
      found = true;
      depth = from.z + part * (to.z - from.z);
      a = 1 - part;
      b = part;
      c = 0;
    }
    turn(p, q, r);
    turn(a, b, c);
  }
  return found;
}

/// Does the ray meet the triangle? After Woop, Benthin and Wald, "Watertight Ray/Triangle Intersection" (JCGT
/// 2013): vertices are sheared so that the ray runs along one axis, and the signs of three edge functions
/// decide. A triangle seen exactly edge-on is not met.
///
/// Sides have rounding errors. If those may decide, or if the triangle is seen so nearly edge-on that the
/// mean of the depths would be noise, passes_close() decides instead: no ray that meets a triangle misses it,
/// so none slips through where triangles touch, whether or not they share an edge (docs/encodings/bvh.md,
/// "Close to an edge").
template <class Real>
NIF_HOST_DEVICE NIF_PART_OF_KERNEL bool meets_triangle(const TriangleRayOf<Real>& ray,
                                                       const float* const vertices[3],
                                                       TriangleCrossing<Real>& crossing) {
  Real x[3], y[3], z[3];
  NIF_UNROLL
  for (int i = 0; i < 3; ++i) {
    const SeenVertex<Real> seen = see(ray, vertices[i]);
    x[i] = seen.x;
    y[i] = seen.y;
    z[i] = seen.z;
  }
  Real side[3] = {x[2] * y[1] - y[2] * x[1], x[0] * y[2] - y[0] * x[2], x[1] * y[0] - y[1] * x[0]};
  // The least distance from 0 of sides of both signs; not above 0 if all have one sign.
  const Real below = -least_of(side), above = most_of(side), apart = below < above ? below : above;
  if (apart > kSurelyApart<Real> * ray.error * ray.error) return false;
  const Real width = extent_of(x), height = extent_of(y), larger = height > width ? height : width;
  if (apart > 4 * ray.error * ((width + height) + 8 * ray.error)) return false;
  Real sum = (side[0] + side[1]) + side[2], depth = 0;
  if (apart > 0 || size_of(sum) < static_cast<Real>(kEdgeOn) * larger * larger) {
    if (!passes_close(ray, vertices[0], vertices[1], vertices[2], side[0], side[1], side[2], depth))
      return false;
    sum = 1;
  } else {
    if (sum == 0) return false;
    depth = ((side[0] * z[0] + side[1] * z[1]) + side[2] * z[2]) / sum;
  }
  crossing = {depth / ray.length, {side[0], side[1], side[2]}, sum};
  return ray.tmin <= crossing.t && crossing.t <= ray.tmax;
}

/// Which of the triangles that a ray meets block it, for the functions below: all. Objects with holes have their own
/// (kernels/reference/holes/holes_field.hpp).
struct AllTriangles {
  template <class Real>
  NIF_HOST_DEVICE constexpr bool operator()(uint32_t, const TriangleCrossing<Real>&) const {
    return true;
  }
};

/// Does one of the triangles of a leaf slot block the ray? `blocks(triangle, crossing)`: see AllTriangles.
template <class Real, class Blocks = AllTriangles>
NIF_HOST_DEVICE bool meets_leaf(const TrianglesField& field, const BvhRayOf<Real>& ray, const BvhNode& node,
                                uint8_t slot, const Blocks& blocks = {}) {
  const uint32_t first = node.first_triangle + slot_rank(slot), count = slot_kind(slot);
  TriangleCrossing<Real> crossing;
  for (uint32_t i = first; i < first + count; ++i) {
    const float* vertices[3];
    NIF_UNROLL
    for (int k = 0; k < 3; ++k) vertices[k] = field.vertices[node.first_vertex + field.triangles[i][k]];
    if (meets_triangle(ray, vertices, crossing) && blocks(i, crossing)) return true;
  }
  return false;
}

/// Adds the nodes that it visits to `nodes`, if not null: the baker counts them.
template <class Blocks = AllTriangles>
inline bool meets_bvh(const TrianglesField& field, const BvhRay& ray, uint64_t* nodes = nullptr,
                      const Blocks& blocks = {}) {
  uint32_t stack[kBvhStack], size = 0;
  stack[size++] = 0;
  while (size > 0) {
    const BvhNode& node = field.nodes[stack[--size]];
    if (nodes) ++*nodes;
    // From the last slot on, so that the first is visited next: bakers put first what is likely to block.
    for (uint32_t s = kBvhWidth; s-- > 0;) {
      if (node.slots[s] == 0 || !meets_box(ray, node, s)) continue;
      if (slot_kind(node.slots[s]) == kInnerSlot) {
        stack[size++] = node.first_node + slot_rank(node.slots[s]);
        continue;
      }
      if (meets_leaf(field, ray, node, node.slots[s], blocks)) return true;
    }
  }
  return false;
}

/// The answer for a segment that prepare_ray() rejected.
NIF_HOST_DEVICE inline Answer answer_no_ray(const Segment& segment) {
  return {true, segment.tmin > segment.tmax, kCertainLogit};
}

/// Is an answer exact enough to be called certain?
NIF_HOST_DEVICE inline bool certain_bvh(const TrianglesField& field, const Segment& segment) {
  float reach = 0;
  for (int a = 0; a < 3; ++a) reach = max_of(magnitude(segment.origin[a]), reach);
  return reach <= field.extent * kBvhReach;
}

inline Answer query(const TrianglesField& field, const Segment& segment) {
  BvhRay ray;
  if (!prepare_ray(field, segment, ray)) return answer_no_ray(segment);
  const bool visible = !meets_bvh(field, ray);
  return {visible, certain_bvh(field, segment), visible ? kCertainLogit : -kCertainLogit};
}

}  // namespace nif::kernels
