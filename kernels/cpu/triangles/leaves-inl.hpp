// Tests the triangles of decoded leaves, each with a ray of its own: one triangle in a lane, in single precision, if
// that surely gives the reference's answer.
//
// Bounds of rounding are those of docs/encodings/bvh.md, "Triangles in single precision".
//
// Compiled once for each target.
#if defined(NIF_BVH_LEAVES_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef NIF_BVH_LEAVES_INL
#undef NIF_BVH_LEAVES_INL
#else
#define NIF_BVH_LEAVES_INL
#endif

#include <hwy/highway.h>

#include "kernels/cpu/triangles/decoded_tree.hpp"
#include "kernels/cpu/triangles/exact_hits-inl.hpp"
#include "kernels/cpu/triangles/sides-inl.hpp"
#include "kernels/cpu/triangles/triangles-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace nif::kernels::cpu::HWY_NAMESPACE {

/// A ray as leaves see it, prepared once: pairs of rows, of the first and the second axis.
struct alignas(32) DecodedRay {
  float origin[8], shear[8];     ///< four times the first, four times the second
  float origin_z, padding;       ///< origin along the third axis; ReadyRay's padding
  float error[2];                ///< the two factors of sides' error bounds
  uint32_t rows[3];              ///< bytes from a corner of a DecodedLeaf to the rows of the axes
  uint32_t sign;                 ///< of the direction's longest component, in the upper bit
  float begin, end;              ///< third coordinates surely inside the ray's range
  float first, last;             ///< beyond these, third coordinates are surely outside
  float depth_begin, depth_end;  ///< as `begin` and `end`, but in the direction of the ray
};

HWY_INLINE void make_decoded_ray(const ReadyRay& ray, DecodedRay& to) {
  [[maybe_unused]] const Four d;
  const uint32_t axis = ray.exit[3];
  const float slack = 4 * ray.origin[3];
#if HWY_TARGET == HWY_AVX3 || HWY_TARGET == HWY_AVX2
  // As they are read: a load of two stores would wait for both.
  const auto pair = [](const float* of)
                        HWY_ATTR { return _mm256_set_m128(_mm_set1_ps(of[1]), _mm_set1_ps(of[0])); };
  _mm256_store_ps(to.origin, pair(ray.origin));
  _mm256_store_ps(to.shear, pair(ray.shear));
#else
  for (uint32_t i = 0; i < 2; ++i) {
    hn::Store(hn::Set(d, ray.origin[i]), d, to.origin + 4 * i);
    hn::Store(hn::Set(d, ray.shear[i]), d, to.shear + 4 * i);
  }
#endif
  for (uint32_t i = 0; i < 2; ++i) to.error[i] = ray.shear[2 + i];
  to.origin_z = ray.origin[2];
  to.padding = ray.origin[3];
  constexpr uint32_t kRow = sizeof(DecodedLeaf::corners[0][0]);
  for (uint32_t i = 0; i < 3; ++i) to.rows[i] = kAxisOrder[axis][i] * kRow;
  to.begin = ray.limits[2];
  to.end = ray.limits[3];
  to.first = to.begin - slack;
  to.last = to.end + slack;
  const bool backward = ray.inverse[axis] < 0;
  to.sign = backward ? 0x80000000u : 0;
  to.depth_begin = backward ? -to.end : to.begin;
  to.depth_end = backward ? -to.begin : to.end;
}

/// Triangles behind this depth are not asked for any more.
HWY_INLINE void shorten(DecodedRay& ray, float depth) {
  if (ray.sign != 0)
    ray.first = max_of(-depth, ray.first);
  else
    ray.last = min_of(depth, ray.last);
}

/// A triangle of a leaf.
HWY_INLINE TriangleCorners corners_of(const DecodedLeaf& leaf, uint32_t i) {
  TriangleCorners triangle;
  triangle.triangle = leaf.triangles[i];
  for (uint32_t k = 0; k < 3; ++k)
    for (uint32_t a = 0; a < 3; ++a) triangle.corners[k][a] = leaf.corners[k][a][i];
  return triangle;
}

/// Triangles seen along the ray, from its origin.
struct SeenLeaf {
  hn::Vec<Four> z[3];  ///< of the corners
  EdgeSides<hn::Vec<Four>> sides;
};

HWY_INLINE SeenLeaf see(const DecodedLeaf& leaf, const DecodedRay& ray) {
  const Four d;
  const auto row = [&](uint32_t k, uint32_t i) HWY_ATTR {
    return reinterpret_cast<const float*>(reinterpret_cast<const char*>(leaf.corners[k]) + ray.rows[i]);
  };
  hn::Vec<Four> x[3], y[3], depth[3], size;
#if HWY_TARGET == HWY_AVX3 || HWY_TARGET == HWY_AVX2
  const __m256 origin = _mm256_load_ps(ray.origin), shear = _mm256_load_ps(ray.shear);
  const __m256 origin_z = _mm256_broadcast_ss(&ray.origin_z);
  const __m256 magnitude = _mm256_castsi256_ps(_mm256_set1_epi32(0x7fffffff));
  __m256 sizes = _mm256_setzero_ps();
  for (uint32_t k = 0; k < 3; ++k) {
    const __m256 z = _mm256_sub_ps(_mm256_broadcast_ps(reinterpret_cast<const __m128*>(row(k, 2))), origin_z);
    const __m256 xy =
        _mm256_insertf128_ps(_mm256_castps128_ps256(_mm_load_ps(row(k, 0))), _mm_load_ps(row(k, 1)), 1);
    const __m256 sheared = _mm256_fnmadd_ps(z, shear, _mm256_sub_ps(xy, origin));
    sizes = _mm256_add_ps(sizes, _mm256_and_ps(sheared, magnitude));
    x[k] = hn::Vec<Four>{_mm256_castps256_ps128(sheared)};
    y[k] = hn::Vec<Four>{_mm256_extractf128_ps(sheared, 1)};
    depth[k] = hn::Vec<Four>{_mm256_castps256_ps128(z)};
  }
  size = hn::Vec<Four>{_mm_add_ps(_mm256_castps256_ps128(sizes), _mm256_extractf128_ps(sizes, 1))};
#else
  size = hn::Zero(d);
  for (uint32_t k = 0; k < 3; ++k) {
    depth[k] = hn::Sub(hn::Load(d, row(k, 2)), hn::Set(d, ray.origin_z));
    x[k] = hn::NegMulAdd(depth[k], hn::Load(d, ray.shear),
                         hn::Sub(hn::Load(d, row(k, 0)), hn::Load(d, ray.origin)));
    y[k] = hn::NegMulAdd(depth[k], hn::Load(d, ray.shear + 4),
                         hn::Sub(hn::Load(d, row(k, 1)), hn::Load(d, ray.origin + 4)));
    size = hn::Add(size, hn::Add(hn::Abs(x[k]), hn::Abs(y[k])));
  }
#endif
  return {{depth[0], depth[1], depth[2]},
          edge_sides(x, y, size, hn::Set(d, ray.error[0]), hn::Set(d, ray.error[1]))};
}

/// Triangles of a leaf as bits.
struct LeafTest {
  uint32_t open;  ///< the ray may meet them
  uint32_t met;   ///< it surely does
};

HWY_INLINE LeafTest test_leaf(const DecodedLeaf& leaf, const DecodedRay& ray) {
  const Four d;
  const SeenLeaf seen = see(leaf, ray);
  const auto least = hn::Min(hn::Min(seen.z[0], seen.z[1]), seen.z[2]);
  const auto most = hn::Max(hn::Max(seen.z[0], seen.z[1]), seen.z[2]);
  const auto outside = hn::Or(hn::Lt(most, hn::Set(d, ray.first)), hn::Gt(least, hn::Set(d, ray.last)));
  const auto within = hn::And(hn::Ge(least, hn::Set(d, ray.begin)), hn::Le(most, hn::Set(d, ray.end)));
  return {bits_of_mask(Four(), hn::Or(seen.sides.missed, outside)) ^ 15,
          bits_of_mask(Four(), hn::And(seen.sides.inside, within))};
}

/// Between which depths rays pass triangles. `z`: of the corners, in the direction of the ray. What is missed means nothing.
template <class V>
struct DepthRange {
  V low, high;
};
template <class V>
HWY_INLINE DepthRange<V> depth_range(const V (&z)[3], const EdgeSides<V>& sides, V padding) {
  const hn::DFromV<V> d;
  const auto least = hn::Min(hn::Min(z[0], z[1]), z[2]), most = hn::Max(hn::Max(z[0], z[1]), z[2]);
  const auto slack = hn::Mul(padding, hn::Set(d, 4.0f));
  const auto sum = hn::Add(hn::Add(sides.side[0], sides.side[1]), sides.side[2]);
  const auto inverse = hn::Div(hn::Set(d, 1.0f), sum);
  const auto wide = hn::And(sides.inside, hn::Gt(hn::Abs(sum), hn::Mul(hn::Set(d, 16.0f), sides.error)));
  // Weights first, which are 0 to 1: sides times depths may be too small or too large for a float.
  const auto mean = hn::MulAdd(
      hn::Mul(sides.side[0], inverse), z[0],
      hn::MulAdd(hn::Mul(sides.side[1], inverse), z[1], hn::Mul(hn::Mul(sides.side[2], inverse), z[2])));
  const auto error = hn::MulAdd(hn::Mul(hn::Mul(hn::Set(d, 8.0f), sides.error), hn::Abs(inverse)),
                                hn::Sub(most, least), hn::Add(padding, padding));
  return {hn::IfThenElse(wide, hn::Sub(mean, error), hn::Sub(least, slack)),
          hn::IfThenElse(wide, hn::Add(mean, error), hn::Add(most, slack))};
}
/// Whether a triangle is certainly out of a ray's range of depths, `begin` to `end`, or certainly within it.
template <class V>
struct RangeTest {
  hn::Mask<hn::DFromV<V>> outside, within;
};
template <class V>
HWY_INLINE RangeTest<V> test_range(const DepthRange<V>& depths, V begin, V end, V padding) {
  const auto slack = hn::Mul(padding, hn::Set(hn::DFromV<V>(), 4.0f));
  return {hn::Or(hn::Lt(hn::Add(depths.high, slack), begin), hn::Gt(hn::Sub(depths.low, slack), end)),
          hn::And(hn::Le(begin, depths.low), hn::Le(depths.high, end))};
}

/// The depths at which a ray passes triangles, in its direction.
struct LeafDepths {
  alignas(16) float low[4];  ///< at least
  float high[4];             ///< at most
  uint32_t open, met;        ///< as LeafTest's
};
HWY_INLINE LeafDepths depths_of(const DecodedLeaf& leaf, const DecodedRay& ray) {
  const Four d;
  const SeenLeaf seen = see(leaf, ray);
  const auto sign = hn::BitCast(d, hn::Set(hn::RebindToUnsigned<Four>(), ray.sign));
  const hn::Vec<Four> z[3] = {hn::Xor(seen.z[0], sign), hn::Xor(seen.z[1], sign), hn::Xor(seen.z[2], sign)};
  const auto padding = hn::Set(d, ray.padding);
  const auto range = depth_range(z, seen.sides, padding);
  const auto test = test_range(range, hn::Set(d, ray.depth_begin), hn::Set(d, ray.depth_end), padding);
  LeafDepths depths;
  hn::Store(range.low, d, depths.low);
  hn::Store(range.high, d, depths.high);
  depths.open = bits_of_mask(Four(), hn::Or(seen.sides.missed, test.outside)) ^ 15;
  depths.met = bits_of_mask(Four(), hn::And(seen.sides.inside, test.within));
  return depths;
}

}  // namespace nif::kernels::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
