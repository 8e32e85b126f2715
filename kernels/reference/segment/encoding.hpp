// The `segment` encoding as the list of encodings has it: its field, its query(), and what a scene needs to
// know of an object besides its answers; the rest of that is its grid's.
#pragma once

#include "kernels/reference/proof/encoding.hpp"
#include "kernels/reference/ray.hpp"
#include "kernels/reference/segment/field.hpp"
#include "kernels/reference/segment/hit.hpp"
#include "kernels/reference/segment/query.hpp"

namespace nif::kernels {

inline Calibration calibration(const SegmentField& field) { return field.network.calibration; }

}  // namespace nif::kernels
