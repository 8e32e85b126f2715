// The list of encodings: which parts may be combined, what users call each combination, and the functions
// that dispatch on it. To add one, add a file to kernels/reference/encodings and lines to the lists here
// (docs/adding-a-part.md).
#pragma once

#include <algorithm>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <limits>
#include <variant>

#include "kernels/reference/encodings/reference_bvh.hpp"
#include "kernels/reference/encodings/reference_exact.hpp"
#include "kernels/reference/encodings/reference_proof.hpp"
#include "kernels/reference/encodings/reference_segment.hpp"
#include "kernels/reference/encodings/reference_spherical.hpp"
#include "kernels/reference/instance.hpp"

namespace nif::kernels {

/// One object, ready to be queried. Owns nothing: its fields are plain pointers into a loaded asset.
using AnyField = std::variant<SegmentField, SphericalField, TrianglesField, ExactField, PlanesField>;

/// The user's name of an encoding; the number is that of NifEncoding.
struct EncodingName {
  uint32_t number;
  const char* name;
};
/// In the order of AnyField.
inline constexpr EncodingName kEncodings[] = {
    {1, "segment"}, {2, "spherical"}, {3, "bvh"}, {4, "exact"}, {5, "proof"}};
static_assert(std::size(kEncodings) == std::variant_size_v<AnyField>);

/// The encoding that a field type belongs to.
template <class Field, size_t kPlace = 0>
constexpr const EncodingName& encoding_of_field() {
  if constexpr (std::same_as<Field, std::variant_alternative_t<kPlace, AnyField>>)
    return kEncodings[kPlace];
  else
    return encoding_of_field<Field, kPlace + 1>();
}

/// The encoding with exactly these parts; null if there is none.
constexpr const EncodingName* encoding_with(bool planes, bool triangles, bool network, bool spherical) {
  if (spherical) return planes || triangles || network ? nullptr : &encoding_of_field<SphericalField>();
  if (network) return planes && !triangles ? &encoding_of_field<SegmentField>() : nullptr;
  if (planes) return triangles ? &encoding_of_field<ExactField>() : &encoding_of_field<PlanesField>();
  return triangles ? &encoding_of_field<TrianglesField>() : nullptr;
}

/// Joins an object's parts into one field. Their combination must be an encoding.
inline AnyField join_parts(const PlanesField* planes, const TrianglesField* triangles,
                           const NetworkField* network, const SphericalField* spherical) {
  if (spherical) return *spherical;
  if (network) return SegmentField{*planes, *network};
  if (planes && triangles) return ExactField{*planes, *triangles};
  if (planes) return *planes;
  return *triangles;
}

// These are templates so that nothing converts to an AnyField: an encoding that lacks one of these functions
// would otherwise call the one here, forever.

template <std::same_as<AnyField> Any>
Answer query(const Any& field, const Segment& segment) {
  return std::visit([&](const auto& own) { return query(own, segment); }, field);
}
/// `limit` is described at Hit.
template <std::same_as<AnyField> Any>
Hit intersect(const Any& field, const Segment& segment, float limit = kNoHit) {
  return std::visit([&](const auto& own) { return intersect(own, segment, limit); }, field);
}
template <std::same_as<AnyField> Any>
ObjectBox object_box(const Any& field) {
  return std::visit([](const auto& own) { return object_box(own); }, field);
}
/// stays_certain() limits distances in object space multiplied by this. Infinite if the object itself lies
/// farther from the origin of its space than kMostOffset.
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
