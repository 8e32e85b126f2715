// The first hit of one `bvh` object: the nearest of the triangles that a segment meets.
//
// Each triangle alone is tested in double precision (triangles_query.hpp). Of several at the same t the first
// in the object's order counts. So the order of traversal cannot change the hit.
#pragma once

#include "kernels/reference/hit.hpp"
#include "kernels/reference/triangles/triangles_query.hpp"

namespace nif::kernels {

/// The nearest triangle so far.
struct NearestTriangle {
  TriangleCrossing<double> crossing{};
  uint32_t triangle = kNoTriangle;
  uint32_t first_vertex = 0;  ///< base of its indices

  NIF_HOST_DEVICE bool is_beaten_by(double t, uint32_t other) const {
    return triangle == kNoTriangle || t < crossing.t || (t == crossing.t && other < triangle);
  }
};

/// Tests one triangle. Returns true if it is the nearest so far. `blocks`: see AllTriangles.
template <class Blocks = AllTriangles>
NIF_HOST_DEVICE inline bool look_at_triangle(const TrianglesField& field, const TriangleRay& ray,
                                             uint32_t first_vertex, uint32_t triangle,
                                             NearestTriangle& nearest, const Blocks& blocks = {}) {
  const float* vertices[3];
  NIF_UNROLL
  for (int k = 0; k < 3; ++k)
    vertices[k] = field.vertices[size_t(first_vertex) + field.triangles[triangle][k]];
  TriangleCrossing<double> crossing;
  if (!meets_triangle(ray, vertices, crossing) || !nearest.is_beaten_by(crossing.t, triangle) ||
      !blocks(triangle, crossing))
    return false;
  nearest = {crossing, triangle, first_vertex};
  return true;
}

/// Tests the triangles of a leaf slot.
template <class Blocks = AllTriangles>
NIF_HOST_DEVICE inline void look_at_leaf(const TrianglesField& field, const BvhRay& ray, const BvhNode& node,
                                         uint8_t slot, NearestTriangle& nearest, const Blocks& blocks = {}) {
  const uint32_t first = node.first_triangle + slot_rank(slot), count = slot_kind(slot);
  for (uint32_t i = first; i < first + count; ++i)
    look_at_triangle(field, ray, node.first_vertex, i, nearest, blocks);
}

/// Skips boxes behind the nearest triangle from now on, but none that may hold a triangle at the same t.
NIF_HOST_DEVICE inline void leave_at(const NearestTriangle& nearest, BvhRay& ray) {
  if (nearest.triangle != kNoTriangle)
    ray.leave = min_of(next_above(static_cast<float>(nearest.crossing.t - static_cast<double>(ray.start))),
                       ray.leave);
}

/// Skips boxes beyond `ray.leave`, which moves to the nearest triangle.
template <class Blocks = AllTriangles>
inline void find_nearest(const TrianglesField& field, BvhRay& ray, NearestTriangle& nearest,
                         const Blocks& blocks = {}) {
  uint32_t stack[kBvhStack], size = 0;
  stack[size++] = 0;
  while (size > 0) {
    const BvhNode& node = field.nodes[stack[--size]];
    for (uint32_t s = kBvhWidth; s-- > 0;) {
      if (node.slots[s] == 0 || !meets_box(ray, node, s)) continue;
      if (slot_kind(node.slots[s]) == kInnerSlot) {
        stack[size++] = node.first_node + slot_rank(node.slots[s]);
        continue;
      }
      look_at_leaf(field, ray, node, node.slots[s], nearest, blocks);
      leave_at(nearest, ray);
    }
  }
}

/// Describes a triangle with these corners as a hit.
NIF_HOST_DEVICE inline Hit hit_at(const TriangleCrossing<double>& crossing, uint32_t triangle,
                                  const float* const corners[3], bool certain) {
  Hit hit;
  hit.t = static_cast<float>(crossing.t);
  if (certain) hit.low = hit.high = hit.t;
  hit.u = static_cast<float>(crossing.weight[1] / crossing.sum);
  hit.v = static_cast<float>(crossing.weight[2] / crossing.sum);
  hit.triangle = triangle;
  double edge[2][3], normal[3], largest = 0;
  NIF_UNROLL
  for (int a = 0; a < 3; ++a) {
    const double from = static_cast<double>(corners[0][a]);
    NIF_UNROLL
    for (int e = 0; e < 2; ++e) edge[e][a] = static_cast<double>(corners[e + 1][a]) - from;
  }
  NIF_UNROLL
  for (int a = 0; a < 3; ++a) {
    const int b = (a + 1) % 3, c = (a + 2) % 3;
    normal[a] = edge[0][b] * edge[1][c] - edge[0][c] * edge[1][b];
    const double size = normal[a] < 0 ? -normal[a] : normal[a];
    largest = size > largest ? size : largest;
  }
  NIF_UNROLL
  for (int a = 0; a < 3; ++a) hit.normal[a] = largest > 0 ? static_cast<float>(normal[a] / largest) : 0.0f;
  return hit;
}

NIF_HOST_DEVICE inline Hit hit_of(const TrianglesField& field, const NearestTriangle& nearest, bool certain) {
  if (nearest.triangle == kNoTriangle) return no_hit(certain);
  const uint8_t* const indices = field.triangles[nearest.triangle];
  const float* corners[3];
  NIF_UNROLL
  for (int k = 0; k < 3; ++k) corners[k] = field.vertices[nearest.first_vertex + indices[k]];
  return hit_at(nearest.crossing, nearest.triangle, corners, certain);
}

/// Skips boxes beyond the limit. A hit a little beyond it may round to the limit itself.
NIF_HOST_DEVICE inline void leave_at(float limit, BvhRay& ray) {
  ray.leave = min_of(from_start_up(next_above(limit), ray.start), ray.leave);
}

/// The first hit of a prepared segment, whose boxes may be culled. `limit` as for intersect().
template <class Blocks = AllTriangles>
inline Hit nearest_hit(const TrianglesField& field, const Segment& segment, float limit, BvhRay& ray,
                       const Blocks& blocks = {}) {
  leave_at(limit, ray);
  NearestTriangle nearest;
  find_nearest(field, ray, nearest, blocks);
  return hit_of(field, nearest, certain_bvh(field, segment));
}

inline Hit intersect(const TrianglesField& field, const Segment& segment, float limit = kNoHit) {
  BvhRay ray;
  if (!prepare_ray(field, segment, ray)) return no_hit(answer_no_ray(segment).certain);
  return nearest_hit(field, segment, limit, ray);
}

}  // namespace nif::kernels
