// The encodings of objects as the scalar code knows them: one list, and each question that is asked of all of
// them. A new encoding adds a folder here with its encoding.hpp, and its field to the list
// (docs/adding-an-encoding.md).
#pragma once

#include <algorithm>
#include <concepts>
#include <limits>
#include <variant>

#include "kernels/reference/bvh/encoding.hpp"
#include "kernels/reference/exact/encoding.hpp"
#include "kernels/reference/instance.hpp"
#include "kernels/reference/proof/encoding.hpp"
#include "kernels/reference/segment/encoding.hpp"
#include "kernels/reference/spherical/encoding.hpp"

namespace nif::kernels {

/// One object, ready to be queried. Owns nothing; fields are plain pointers into a loaded asset.
using AnyField = std::variant<SegmentField, SphericalField, BvhField, ExactField, ProofField>;

// These are templates so that nothing converts to an AnyField: an encoding that lacks one of its own
// functions would call them in its place, without end.

template <std::same_as<AnyField> Any>
Answer query(const Any& field, const Segment& segment) {
  return std::visit([&](const auto& own) { return query(own, segment); }, field);
}
/// `limit`: see Hit.
template <std::same_as<AnyField> Any>
Hit intersect(const Any& field, const Segment& segment, float limit = kNoHit) {
  return std::visit([&](const auto& own) { return intersect(own, segment, limit); }, field);
}
template <std::same_as<AnyField> Any>
ObjectBox object_box(const Any& field) {
  return std::visit([](const auto& own) { return object_box(own); }, field);
}
/// Distances in object space, times this, are what stays_certain() limits. Infinite where the object itself
/// lies farther from the origin of its space than kMostOffset.
template <std::same_as<AnyField> Any>
float reach_scale(const Any& field) {
  const float scale = std::visit([](const auto& own) { return reach_scale(own); }, field);
  const ObjectBox box = object_box(field);
  for (int a = 0; a < 3; ++a)
    if (!(std::max(-box.low[a], box.high[a]) * double(scale) <= double(kMostOffset)))
      return std::numeric_limits<float>::infinity();
  return scale;
}
template <std::same_as<AnyField> Any>
Calibration calibration(const Any& field) {
  return std::visit([](const auto& own) { return calibration(own); }, field);
}

}  // namespace nif::kernels
