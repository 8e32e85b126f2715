// On which sides of a triangle's edges a ray passes, in single precision: decides only where rounding cannot matter.
//
// docs/encodings/bvh.md, "Triangles in single precision", derives the bounds.
//
// Compiled once for each target.
#if defined(NIF_BVH_SIDES_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef NIF_BVH_SIDES_INL
#undef NIF_BVH_SIDES_INL
#else
#define NIF_BVH_SIDES_INL
#endif

#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace nif::kernels::cpu::HWY_NAMESPACE {

/// A triangle and a ray in each lane. V: a vector of floats.
template <class V>
struct EdgeSides {
  V side[3];                               ///< by the corner across the edge
  V error;                                 ///< of sides, at most
  hn::Mask<hn::DFromV<V>> missed, inside;  ///< surely
};

/// `x`, `y`: the corners, sheared: the ray is the origin. `size`: the sum of their magnitudes. The error is `size` times
/// `error` plus `least_error`.
template <class V>
HWY_INLINE EdgeSides<V> edge_sides(const V (&x)[3], const V (&y)[3], V size, V error, V least_error) {
  const auto u = hn::NegMulAdd(y[2], x[1], hn::Mul(x[2], y[1]));
  const auto v = hn::NegMulAdd(y[0], x[2], hn::Mul(x[0], y[2]));
  const auto w = hn::NegMulAdd(y[1], x[0], hn::Mul(x[1], y[0]));
  const auto most_off = hn::MulAdd(size, error, least_error), other = hn::Neg(most_off);
  const auto least = hn::Min(hn::Min(u, v), w), most = hn::Max(hn::Max(u, v), w);
  return {{u, v, w},
          most_off,
          hn::And(hn::Lt(least, other), hn::Gt(most, most_off)),
          hn::Or(hn::Gt(least, most_off), hn::Lt(most, other))};
}

}  // namespace nif::kernels::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
