// The list of encodings, by their fields. To add one, add a file to kernels/reference/encodings, and a name to the list
// (docs/adding-a-part.md). GPU kernels take their list from this one, so there is nothing else here.
#pragma once

#include "kernels/reference/encodings/reference_bvh.hpp"
#include "kernels/reference/encodings/reference_exact.hpp"
#include "kernels/reference/encodings/reference_proof.hpp"
#include "kernels/reference/encodings/reference_segment.hpp"
#include "kernels/reference/encodings/reference_spherical.hpp"

namespace nif::kernels {

/// T<...> of the fields of all encodings.
template <template <class...> class T>
using OfFields = T<SegmentField, SphericalField, TrianglesField, ExactField, PlanesField>;

}  // namespace nif::kernels
