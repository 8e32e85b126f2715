// The encodings of objects as the scalar code knows them: one list, and each question that is asked of all of
// them. A new encoding adds a folder here with its encoding.hpp, and its field to the list
// (docs/adding-an-encoding.md).
#pragma once

#include <variant>

#include "kernels/reference/bvh/encoding.hpp"
#include "kernels/reference/segment/encoding.hpp"
#include "kernels/reference/spherical/encoding.hpp"

namespace nif::kernels {

/// One object, ready to be queried. Owns nothing; fields are plain pointers into a loaded asset.
using AnyField = std::variant<SegmentField, SphericalField, BvhField>;

inline Answer query(const AnyField& field, const Segment& segment) {
  return std::visit([&](const auto& own) { return query(own, segment); }, field);
}
inline ObjectBox object_box(const AnyField& field) {
  return std::visit([](const auto& own) { return object_box(own); }, field);
}
/// Distances in object space, times this, are what kCertainReach limits.
inline float reach_scale(const AnyField& field) {
  return std::visit([](const auto& own) { return reach_scale(own); }, field);
}
/// The probability of being visible is 1 / (1 + exp(-logit * logit_scale)).
inline float logit_scale(const AnyField& field) {
  return std::visit([](const auto& own) { return logit_scale(own); }, field);
}

}  // namespace nif::kernels
