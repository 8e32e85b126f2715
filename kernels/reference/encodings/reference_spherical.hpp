// Adds the `spherical` encoding to the list of encodings: its field, its query(), and what a scene must know
// about an object besides its answers.
#pragma once

#include "kernels/reference/encoding.hpp"
#include "kernels/reference/ray.hpp"
#include "kernels/reference/spherical/spherical_field.hpp"
#include "kernels/reference/spherical/spherical_query.hpp"

namespace nif::kernels {

/// The AABB of a `spherical` object, and a margin that contains every ray that is in reach of the object's
/// proofs and not proven to miss it (kSphericalMargin, and 2^-20 of the reach of 2^8 diagonals).
inline ObjectBox object_box(const SphericalField& field) {
  ObjectBox box;
  for (int a = 0; a < 3; ++a) {
    box.low[a] = double(field.low[a]) - 8 * double(field.margin);
    box.high[a] = double(field.high[a]) + 8 * double(field.margin);
  }
  return box;
}

/// kCertainReach counts units; kSphericalUnits of them make the diagonal.
inline float reach_scale(const SphericalField& field) { return field.reach_scale; }
inline Calibration calibration(const SphericalField&) { return {kSphericalLogitScale, 0}; }

template <>
struct EncodingOf<SphericalField> : MadeOf<SphericalField> {
  static constexpr EncodingName kName{2, "spherical"};
};

}  // namespace nif::kernels
