// Objects of any encoding: which parts may be combined, what users call each combination, and the functions
// that dispatch on it. All follows from the list in kernels/reference/field_list.hpp.
#pragma once

#include <algorithm>
#include <array>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <tuple>
#include <type_traits>
#include <variant>

#include "kernels/reference/encodings/reference_bvh.hpp"
#include "kernels/reference/encodings/reference_cutout.hpp"
#include "kernels/reference/encodings/reference_exact.hpp"
#include "kernels/reference/encodings/reference_proof.hpp"
#include "kernels/reference/encodings/reference_segment.hpp"
#include "kernels/reference/encodings/reference_spherical.hpp"
#include "kernels/reference/field_list.hpp"
#include "kernels/reference/instance.hpp"

namespace nif::kernels {

/// One object, ready to be queried. Owns nothing: its fields are plain pointers into a loaded asset.
using AnyField = OfFields<std::variant>;

/// In the order of AnyField.
inline constexpr auto kEncodings = []<class... Field>(std::type_identity<std::variant<Field...>>) {
  return std::array{EncodingOf<Field>::kName...};
}(std::type_identity<AnyField>());

/// The encoding that a field type belongs to.
template <class Field, size_t kPlace = 0>
constexpr const EncodingName& encoding_of_field() {
  if constexpr (std::same_as<Field, std::variant_alternative_t<kPlace, AnyField>>)
    return kEncodings[kPlace];
  else
    return encoding_of_field<Field, kPlace + 1>();
}

template <class Part, class... Own>
constexpr bool has_part(MadeOf<Own...>) {
  return (std::same_as<Part, Own> || ...);
}

/// Calls ask(std::type_identity<Field>()) for the encoding of objects that have these parts, named by their fields,
/// and no others. Returns false if there is none.
template <class... Part, class Ask>
constexpr bool for_encoding_with(const std::array<bool, sizeof...(Part)>& has, const Ask& ask) {
  const auto try_one = [&]<class Field>(std::type_identity<Field> field) {
    const bool found = has == std::array<bool, sizeof...(Part)>{has_part<Part>(EncodingOf<Field>())...};
    if (found) ask(field);
    return found;
  };
  return [&]<class... Field>(std::type_identity<std::variant<Field...>>) {
    return (try_one(std::type_identity<Field>()) || ...);
  }(std::type_identity<AnyField>());
}

/// That encoding; null if there is none.
template <class... Part>
constexpr const EncodingName* encoding_with(const std::array<bool, sizeof...(Part)>& has) {
  const EncodingName* name = nullptr;
  for_encoding_with<Part...>(
      has, [&]<class Field>(std::type_identity<Field>) { name = &encoding_of_field<Field>(); });
  return name;
}

template <class Field, class... Own, class... Part>
Field join_as(MadeOf<Own...>, const std::tuple<const Part*...>& parts) {
  return Field{*std::get<const Own*>(parts)...};
}

/// Joins an object's parts into one field; those that it lacks are null. Their combination must be an encoding.
template <class... Part>
AnyField join_parts(const Part*... part) {
  AnyField joined;
  for_encoding_with<Part...>({part != nullptr...}, [&]<class Field>(std::type_identity<Field>) {
    joined = join_as<Field>(EncodingOf<Field>(), std::tuple(part...));
  });
  return joined;
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
