// Tests the large triangles of a decoded object, which are not in its tree: a ray in each lane, in single precision, if
// that surely gives the reference's answer.
//
// Depths come from the triangle's plane: docs/encodings/bvh.md, "Large
// triangles", derives their bounds.
//
// Compiled once for each target.
#if defined(NIF_BVH_LARGE_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef NIF_BVH_LARGE_INL
#undef NIF_BVH_LARGE_INL
#else
#define NIF_BVH_LARGE_INL
#endif

#include <hwy/highway.h>

#include "kernels/cpu/triangles/decoded_tree.hpp"
#include "kernels/cpu/triangles/rays-inl.hpp"
#include "kernels/cpu/triangles/sides-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace nif::kernels::cpu::HWY_NAMESPACE {

/// Times its depth, how far off the depth is at which a ray passes a plane, by its slope and by rounding.
constexpr float kDepthError = 24 * 0x1p-24f;

/// Which rays of a vector meet a triangle.
struct LargeTest {
  hn::Mask<Floats> open;  ///< they may meet it
  hn::Mask<Floats> met;   ///< they surely do
};
/// The depths at which they do, in their directions.
struct LargeDepths {
  HWY_INLINE LargeDepths() {}  // as BoxRays
  hn::Vec<Floats> low, high;
};

/// Brings coordinates of a vertex to lanes, in the order of the axes of each lane's ray.
class LargeOrder {
 public:
  HWY_INLINE explicit LargeOrder(hn::Vec<Ints> axis) {
    const Ints di;
    // Bytes of x, y and z.
    const hn::Vec<Ints> of[3] = {hn::Set(di, 0x03020100), hn::Set(di, 0x07060504), hn::Set(di, 0x0b0a0908)};
    const auto second = hn::Eq(axis, hn::Set(di, 1)), third = hn::Eq(axis, hn::Set(di, 2));
    for (uint32_t i = 0; i < 3; ++i)
      order_[i] = hn::IfThenElse(third, of[kAxisOrder[2][i]],
                                 hn::IfThenElse(second, of[kAxisOrder[1][i]], of[kAxisOrder[0][i]]));
  }
  /// The coordinate along the ray's axis `i`.
  HWY_INLINE hn::Vec<Floats> operator()(hn::Vec<Floats> vertex, uint32_t i) const {
    return floats(hn::TableLookupBytes(ints(vertex), order_[i]));
  }

 private:
  hn::Vec<Ints> order_[3];
};

/// The large triangles in whose boxes any of the rays `asked`, as bits, may meet something; as bits.
HWY_INLINE uint32_t large_in_boxes(const DecodedTree& tree, const BoxRays& boxes, uint32_t asked) {
  uint32_t met = 0;
  for (const LargeBox& box : tree.large_boxes) {
    if (box.triangles == 0) break;
    if ((bits_of(boxes.meet(box.low, box.high)) & asked) != 0) met |= box.triangles;
  }
  return met;
}

/// Tests a triangle: first where rays pass its plane, then on which sides of its edges. Depths of rays that do not meet it
/// mean nothing.
HWY_INLINE LargeTest test_large(const LargeTriangle& triangle, const SeenRays& rays, const LargeOrder& order,
                                LargeDepths& depths) {
  const Floats d;
  const auto sign = hn::IfThenElseZero(rays.backward, hn::Set(d, -0.0f));
  const auto vertical = hn::LoadDup128(d, triangle.normal);
  const hn::Vec<Floats> normal[3] = {order(vertical, 0), order(vertical, 1), order(vertical, 2)};
  auto distance = hn::Set(d, triangle.offset);
  for (uint32_t i = 0; i < 3; ++i) distance = hn::NegMulAdd(normal[i], rays.origin[i], distance);
  const auto slope = hn::MulAdd(normal[0], rays.shear[0], hn::MulAdd(normal[1], rays.shear[1], normal[2]));
  const auto inverse = hn::Div(hn::Set(d, 1.0f), hn::Xor(slope, sign));
  const auto middle = hn::Mul(distance, inverse);
  const auto twice = hn::Add(rays.padding, rays.padding);
  const auto off = hn::Mul(
      hn::MulAdd(hn::Abs(middle), hn::Set(d, kDepthError), hn::Add(twice, hn::Set(d, triangle.flatness))),
      hn::Abs(inverse));
  // Else the plane says too little: the reference's sides may add up to nothing.
  const auto steep =
      hn::Gt(hn::Abs(slope), hn::Mul(hn::Mul(rays.padding, hn::Set(d, triangle.steepness)), rays.padding));
  const auto farthest = hn::Mul(rays.padding, hn::Set(d, 1 / kBvhPadding * 4));
  const auto low = hn::IfThenElse(steep, hn::Max(hn::Sub(middle, off), hn::Neg(farthest)), hn::Neg(farthest));
  const auto high = hn::IfThenElse(steep, hn::Min(hn::Add(middle, off), farthest), farthest);
  depths.low = low;
  depths.high = high;
  // The range's true ends are one padding farther out, and another is for rounding.
  const auto outside =
      hn::Or(hn::Lt(high, hn::Sub(rays.begin, twice)), hn::Gt(low, hn::Add(rays.end, twice)));
  if ((bits_of(hn::Not(outside)) & rays.asked) == 0) {
    const auto none = hn::Gt(rays.padding, rays.padding);
    return {none, none};
  }

  hn::Vec<Floats> x[3], y[3];
  auto size = hn::Zero(d);
  for (uint32_t k = 0; k < 3; ++k) {
    const auto vertex = hn::LoadDup128(d, triangle.corners[k]);
    const auto z = hn::Sub(order(vertex, 2), rays.origin[2]);
    x[k] = hn::NegMulAdd(z, rays.shear[0], hn::Sub(order(vertex, 0), rays.origin[0]));
    y[k] = hn::NegMulAdd(z, rays.shear[1], hn::Sub(order(vertex, 1), rays.origin[1]));
    size = hn::Add(size, hn::Add(hn::Abs(x[k]), hn::Abs(y[k])));
  }
  const auto sides = edge_sides(x, y, size, rays.error[0], rays.error[1]);
  const auto within = hn::And(hn::Le(rays.begin, low), hn::Le(high, rays.end));
  return {hn::Not(hn::Or(sides.missed, outside)), hn::And(sides.inside, within)};
}

}  // namespace nif::kernels::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
