// The `exact` encoding as the list of encodings has it. All that a scene needs to know of an object is what
// it needs to know of its BVH, because the answers are the same.
#pragma once

#include "kernels/reference/bvh/encoding.hpp"
#include "kernels/reference/exact/hit.hpp"
#include "kernels/reference/exact/query.hpp"

namespace nif::kernels {

inline ObjectBox object_box(const ExactField& field) { return object_box(field.bvh); }
inline float reach_scale(const ExactField& field) { return reach_scale(field.bvh); }
inline Calibration calibration(const ExactField&) { return {}; }

}  // namespace nif::kernels
