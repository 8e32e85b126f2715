// Decides in single precision whether a triangle with holes blocks a ray, if that surely gives the reference's answer:
// if the texel is known in spite of rounding (docs/encodings/cutout.md, "Texels in single precision").
//
// Compiled once for each target.
#if defined(NIF_TEXELS_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef NIF_TEXELS_INL
#undef NIF_TEXELS_INL
#else
#define NIF_TEXELS_INL
#endif

#include <hwy/highway.h>

#include "kernels/reference/holes/holes_field.hpp"

HWY_BEFORE_NAMESPACE();
namespace nif::kernels::cpu::HWY_NAMESPACE {

/// Whether a triangle blocks a ray that passes through it.
enum class Blocks { no, yes, perhaps };

/// floor(x), for |x| below 2^31.
HWY_INLINE int32_t floor_in_single(float x) {
  const auto toward_zero = int32_t(x);
  return toward_zero - (float(toward_zero) > x);
}

/// `side`: on which sides of the edges across the three corners the ray surely passes, with errors of at most `error`.
HWY_INLINE Blocks blocks_in_single(const HolesField& holes, const AlphaPatch& patch, const float side[3],
                                   float error) {
  const float sum = (side[0] + side[1]) + side[2];
  if (!(magnitude(sum) > 16 * error)) return Blocks::perhaps;
  const float inverse = 1 / sum, second = side[1] * inverse, third = side[2] * inverse;
  const float of_weights = 8 * (error * magnitude(inverse));
  const float unit = bits_as<float>((127 - kAlphaFraction + patch.shift) << 23);
  int32_t texel[2];
  for (int a = 0; a < 2; ++a) {
    const float p = float(patch.places[0][a]) * unit, q = float(patch.places[1][a]) * unit - p,
                r = float(patch.places[2][a]) * unit - p;
    const float spread = magnitude(q) + magnitude(r), size = magnitude(p) + spread;
    if (!(size < 0x1p19f)) return Blocks::perhaps;  // farther away the slack is a texel or more
    const float at = p + (second * q + third * r), slack = spread * of_weights + size * 0x1p-19f;
    if (!(slack < 1)) return Blocks::perhaps;
    texel[a] = floor_in_single(at - slack);
    if (texel[a] != floor_in_single(at + slack)) return Blocks::perhaps;
  }
  return blocks_light(holes.maps[patch.map], texel[0], texel[1]) ? Blocks::yes : Blocks::no;
}

}  // namespace nif::kernels::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
