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
#include "kernels/cpu/triangles/rays-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace nif::kernels::cpu::HWY_NAMESPACE {

/// Leaves in a vector: one in each block of 16 bytes.
constexpr uint32_t kLeaves = kLanes / kBvhLeafTriangles;

/// Four floats from each of several 16-byte aligned addresses, `offset` bytes on.
HWY_INLINE hn::Vec<Floats> load_rows(const char* const (&from)[kLeaves], size_t offset) {
  const auto row = [&](uint32_t i) HWY_ATTR { return reinterpret_cast<const float*>(from[i] + offset); };
#if HWY_TARGET == HWY_AVX3
  __m512 rows = _mm512_castps128_ps512(_mm_load_ps(row(0)));
  rows = _mm512_insertf32x4(rows, _mm_load_ps(row(1)), 1);
  rows = _mm512_insertf32x4(rows, _mm_load_ps(row(2)), 2);
  return hn::Vec<Floats>{_mm512_insertf32x4(rows, _mm_load_ps(row(3)), 3)};
#elif HWY_TARGET == HWY_AVX2
  return hn::Vec<Floats>{
      _mm256_insertf128_ps(_mm256_castps128_ps256(_mm_load_ps(row(0))), _mm_load_ps(row(1)), 1)};
#else
  return hn::Load(Floats(), row(0));
#endif
}

/// Leaves and the rays that meet them.
struct LeavesAndRays {
  const char* leaves[kLeaves];
  const char* rays[kLeaves];  ///< ReadyRay

  HWY_INLINE void set(uint32_t i, const DecodedLeaf& leaf, const ReadyRay& ray) {
    leaves[i] = reinterpret_cast<const char*>(&leaf);
    rays[i] = reinterpret_cast<const char*>(&ray);
  }
};

/// The corners of triangles, sheared: seen along the ray, which is the origin. And on which sides of the edges the
/// ray passes.
struct SeenLeaves {
  hn::Vec<Floats> z[3];     ///< by corner
  hn::Vec<Floats> side[3];  ///< by the corner across the edge
  hn::Vec<Floats> error;    ///< of sides, at most
  hn::Vec<Floats> padding;
  hn::Mask<Floats> missed, inside;  ///< surely
};

HWY_INLINE SeenLeaves see(const LeavesAndRays& at) {
  const Floats d;
  const char* rows[3][kLeaves];
  for (uint32_t i = 0; i < kLeaves; ++i) {
    const auto& ray = *reinterpret_cast<const ReadyRay*>(at.rays[i]);
    const float order[3] = {ray.inverse[3], ray.near[3], ray.far[3]};
    for (uint32_t a = 0; a < 3; ++a) rows[a][i] = at.leaves[i] + bits_as<uint32_t>(order[a]);
  }
  const auto origins = load_rows(at.rays, offsetof(ReadyRay, origin));
  const auto shears = load_rows(at.rays, offsetof(ReadyRay, shear));
  const auto origin_x = hn::Broadcast<0>(origins), origin_y = hn::Broadcast<1>(origins);
  const auto origin_z = hn::Broadcast<2>(origins);
  const auto shear_x = hn::Broadcast<0>(shears), shear_y = hn::Broadcast<1>(shears);
  SeenLeaves seen;
  hn::Vec<Floats> x[3], y[3];
  for (uint32_t k = 0; k < 3; ++k) {
    const size_t corner = k * sizeof(DecodedLeaf::corners[0]);
    const auto z = hn::Sub(load_rows(rows[2], corner), origin_z);
    x[k] = hn::NegMulAdd(z, shear_x, hn::Sub(load_rows(rows[0], corner), origin_x));
    y[k] = hn::NegMulAdd(z, shear_y, hn::Sub(load_rows(rows[1], corner), origin_y));
    seen.z[k] = z;
  }
  const auto u = hn::NegMulAdd(y[2], x[1], hn::Mul(x[2], y[1]));
  const auto v = hn::NegMulAdd(y[0], x[2], hn::Mul(x[0], y[2]));
  const auto w = hn::NegMulAdd(y[1], x[0], hn::Mul(x[1], y[0]));
  const auto size_of = [&](uint32_t k) HWY_ATTR { return hn::Add(hn::Abs(x[k]), hn::Abs(y[k])); };
  const auto size = hn::Add(hn::Add(size_of(0), size_of(1)), size_of(2));
  const auto error = hn::MulAdd(size, hn::Broadcast<2>(shears), hn::Broadcast<3>(shears));
  const auto least = hn::Min(hn::Min(u, v), w), most = hn::Max(hn::Max(u, v), w);
  const auto other = hn::Neg(error);
  seen.side[0] = u;
  seen.side[1] = v;
  seen.side[2] = w;
  seen.error = error;
  seen.padding = hn::Broadcast<3>(origins);
  seen.missed = hn::And(hn::Lt(least, other), hn::Gt(most, error));
  seen.inside = hn::Or(hn::Gt(least, error), hn::Lt(most, other));
  return seen;
}

/// Triangles as bits, those of a leaf in four.
struct LeafTest {
  uint32_t open;  ///< the ray may meet them
  uint32_t met;   ///< it surely does
};

HWY_INLINE LeafTest test_leaves(const LeavesAndRays& at) {
  const SeenLeaves seen = see(at);
  const auto limits = load_rows(at.rays, offsetof(ReadyRay, limits));
  const auto begin = hn::Broadcast<2>(limits), end = hn::Broadcast<3>(limits);
  const auto least = hn::Min(hn::Min(seen.z[0], seen.z[1]), seen.z[2]);
  const auto most = hn::Max(hn::Max(seen.z[0], seen.z[1]), seen.z[2]);
  const auto slack = hn::Mul(seen.padding, hn::Set(Floats(), 4.0f));
  const auto outside = hn::Or(hn::Lt(hn::Add(most, slack), begin), hn::Gt(hn::Sub(least, slack), end));
  const auto within = hn::And(hn::Le(begin, least), hn::Le(most, end));
  return {bits_of(hn::Or(seen.missed, outside)) ^ kAllLanes, bits_of(hn::And(seen.inside, within))};
}

/// Depths along a ray, in its direction, between which triangles count. In a row of its own.
struct alignas(16) DepthLimits {
  float begin, end;  ///< surely inside the ray's range
  uint32_t sign;     ///< of the direction's longest component, in the upper bit
  uint32_t unused;
};
HWY_INLINE DepthLimits depth_limits(const ReadyRay& ray) {
  if (ray.inverse[ray.exit[3]] < 0) return {-ray.limits[3], -ray.limits[2], 0x80000000u, 0};
  return {ray.limits[2], ray.limits[3], 0, 0};
}

/// The depths at which rays pass triangles.
struct LeafDepths {
  alignas(64) float low[kLanes];  ///< at least
  float high[kLanes];             ///< at most
  uint32_t open, met;             ///< as LeafTest's
};

/// `limits`: a DepthLimits for each leaf.
HWY_INLINE LeafDepths depths_of(const LeavesAndRays& at, const char* const (&limits)[kLeaves]) {
  const Floats d;
  const SeenLeaves seen = see(at);
  const auto row = load_rows(limits, 0);
  const auto begin = hn::Broadcast<0>(row), end = hn::Broadcast<1>(row), sign = hn::Broadcast<2>(row);
  const auto z0 = hn::Xor(seen.z[0], sign), z1 = hn::Xor(seen.z[1], sign), z2 = hn::Xor(seen.z[2], sign);
  const auto least = hn::Min(hn::Min(z0, z1), z2), most = hn::Max(hn::Max(z0, z1), z2);
  const auto padding = seen.padding, slack = hn::Mul(padding, hn::Set(d, 4.0f));
  const auto sum = hn::Add(hn::Add(seen.side[0], seen.side[1]), seen.side[2]);
  const auto inverse = hn::Div(hn::Set(d, 1.0f), sum);
  const auto wide = hn::And(seen.inside, hn::Gt(hn::Abs(sum), hn::Mul(hn::Set(d, 16.0f), seen.error)));
  // Weights first, which are 0 to 1: sides times depths may be too small or too large for a float.
  const auto mean =
      hn::MulAdd(hn::Mul(seen.side[0], inverse), z0,
                 hn::MulAdd(hn::Mul(seen.side[1], inverse), z1, hn::Mul(hn::Mul(seen.side[2], inverse), z2)));
  const auto error = hn::MulAdd(hn::Mul(hn::Mul(hn::Set(d, 8.0f), seen.error), hn::Abs(inverse)),
                                hn::Sub(most, least), hn::Add(padding, padding));
  const auto low = hn::IfThenElse(wide, hn::Sub(mean, error), hn::Sub(least, slack));
  const auto high = hn::IfThenElse(wide, hn::Add(mean, error), hn::Add(most, slack));
  LeafDepths depths;
  hn::Store(low, d, depths.low);
  hn::Store(high, d, depths.high);
  const auto outside = hn::Or(hn::Lt(hn::Add(high, slack), begin), hn::Gt(hn::Sub(low, slack), end));
  const auto within = hn::And(hn::Le(begin, low), hn::Le(high, end));
  depths.open = bits_of(hn::Or(seen.missed, outside)) ^ kAllLanes;
  depths.met = bits_of(hn::And(seen.inside, within));
  return depths;
}

}  // namespace nif::kernels::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
