// The list of encodings, by their fields. To add one, add its field's name here, and its file to the includes of
// kernels/reference/reference_encodings.hpp (docs/adding-a-part.md). GPU kernels take their list from this one, so
// it includes nothing.
#pragma once

namespace nif::kernels {

/// T<...> of the fields of all encodings.
template <template <class...> class T>
using OfFields = T<struct SegmentField, struct SphericalField, struct TrianglesField, struct ExactField,
                   struct PlanesField, struct CutoutField>;

}  // namespace nif::kernels
