// Tests the triangles of a decoded leaf, of which some have holes, in double precision: one in a lane, with the
// reference's operations in the reference's order. In single precision a ray's place in a picture of 2048 texels is
// seldom known to a texel.
//
// Compiled once for each target.
#if defined(NIF_LEAF_HOLES_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef NIF_LEAF_HOLES_INL
#undef NIF_LEAF_HOLES_INL
#else
#define NIF_LEAF_HOLES_INL
#endif

#include <hwy/highway.h>

#include "kernels/cpu/holes/holes.hpp"
#include "kernels/cpu/triangles/exact_hits-inl.hpp"
#include "kernels/cpu/triangles/leaves-inl.hpp"
#include "kernels/reference/batch.hpp"

HWY_BEFORE_NAMESPACE();
namespace nif::kernels::cpu::HWY_NAMESPACE {

/// As prepare_for_triangles(), without a branch. `axis`: the longest of the ray's direction.
HWY_INLINE void make_exact_ray(const TrianglesField& field, const SegmentBatch& batch, uint32_t number,
                               uint32_t axis, TriangleRay& ray) {
  const uint8_t* const order = kAxisOrder[axis];
  ray.length = double{batch.direction[axis][number]};
  float far = field.extent;
  for (uint32_t i = 0; i < 3; ++i) {
    const float origin = batch.origin[order[i]][number];
    ray.axis[i] = order[i];
    ray.origin[i] = double{origin};
    far = max_of(magnitude(origin), far);
  }
  for (uint32_t i = 0; i < 2; ++i) ray.shear[i] = double{batch.direction[order[i]][number]} / ray.length;
  ray.error = double{far} * kShearError<double>;
  ray.tmin = double{batch.tmin[number]};
  ray.tmax = double{batch.tmax[number]};
}

/// What a ray in flight keeps for triangles with holes.
template <class Holes>
struct ExactRayFor {
  HWY_INLINE void prepare(const TrianglesField& field, const SegmentBatch& batch, uint32_t number,
                          uint32_t axis) {
    make_exact_ray(field, batch, number, axis, ray);
  }
  TriangleRay ray;
};
#ifndef __wasm__
template <>
struct ExactRayFor<NoHoles> {
  HWY_INLINE void prepare(const TrianglesField&, const SegmentBatch&, uint32_t, uint32_t) {}
};
#endif

/// Does the ray meet this triangle, as the reference defines it, and does the triangle block it there?
template <class Holes>
HWY_INLINE bool blocks_exactly(const Holes& holes, const TriangleRay& ray, const TriangleCorners& triangle) {
  const float* const vertices[3] = {triangle.corners[0], triangle.corners[1], triangle.corners[2]};
  TriangleCrossing<double> crossing;
  return meets_triangle(ray, vertices, crossing) && holes(triangle.triangle, crossing);
}

/// The triangles of a leaf that block the ray, of `lanes`, as bits. `number`: the leaf's. `seen`: the ray.
HWY_NOINLINE inline uint32_t blocking(const SomeHoles& holes, const DecodedLeaf& leaf, uint32_t number,
                                      const DecodedRay& seen, const TriangleRay& ray, uint32_t lanes) {
  const hn::CappedTag<double, kBvhLeafTriangles> d;
  const hn::Rebind<float, decltype(d)> df;
  const hn::Rebind<int32_t, decltype(d)> di;
  using V = hn::Vec<decltype(d)>;
  const LeafHoles& shown = holes.leaves[number];
  alignas(64) double texel[2][kBvhLeafTriangles];
  uint32_t met = 0, close = 0;
  for (uint32_t first = 0; first < kBvhLeafTriangles; first += uint32_t(hn::Lanes(d))) {
    V x[3], y[3], z[3];
    for (uint32_t k = 0; k < 3; ++k) {
      const auto row = [&](uint32_t i) HWY_ATTR {
        const auto* const from =
            reinterpret_cast<const float*>(reinterpret_cast<const char*>(leaf.corners[k]) + seen.rows[i]);
        return hn::Sub(hn::PromoteTo(d, hn::Load(df, from + first)), hn::Set(d, ray.origin[i]));
      };
      z[k] = row(2);
      x[k] = hn::Sub(row(0), hn::Mul(hn::Set(d, ray.shear[0]), z[k]));
      y[k] = hn::Sub(row(1), hn::Mul(hn::Set(d, ray.shear[1]), z[k]));
    }
    const ExactTest<V> test = test_exactly(x, y, z, hn::Set(d, ray.error), hn::Set(d, ray.length),
                                           hn::Set(d, ray.tmin), hn::Set(d, ray.tmax));
    const auto bits = [&](auto mask) HWY_ATTR { return bits_of_mask(d, mask) << first; };
    met |= bits(test.met);
    close |= bits(test.close);
    // As blocks_light().
    const V unit = hn::PromoteTo(d, hn::Load(df, shown.unit + first));
    for (uint32_t a = 0; a < 2; ++a) {
      const auto place = [&](uint32_t k)
                             HWY_ATTR { return hn::PromoteTo(d, hn::Load(di, shown.places[k][a] + first)); };
      const V from = place(0);
      const V at = hn::Add(hn::Add(from, hn::Mul(test.second, hn::Sub(place(1), from))),
                           hn::Mul(test.third, hn::Sub(place(2), from)));
      hn::Store(hn::Floor(hn::Mul(at, unit)), d, texel[a] + first);
    }
  }
  const uint32_t with_holes = holes.in_leaf(number);
  uint32_t blocks = met & lanes & ~with_holes;
  for (uint32_t some = met & lanes & with_holes; some != 0; some &= some - 1) {
    const uint32_t i = lowest_bit(some);
    blocks |=
        uint32_t(blocks_light(holes.holes->maps[shown.maps[i]], int64_t(texel[0][i]), int64_t(texel[1][i])))
        << i;
  }
  for (close &= lanes; HWY_UNLIKELY(close != 0); close &= close - 1) {
    const uint32_t i = lowest_bit(close);
    blocks |= uint32_t(blocks_exactly(holes, ray, corners_of(leaf, i))) << i;
  }
  return blocks;
}

}  // namespace nif::kernels::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
