// JSON that others wrote, how deep it may be nested, and how wide.
#pragma once

#include <array>
#include <cstddef>
#include <string_view>

namespace nif {

/// nlohmann's JSON calls itself for each level of a value to copy and to write it, and tinygltf does to read
/// it. No real file comes near.
inline constexpr size_t kMostJsonDepth = 128;

/// The byte at which JSON opens one level too many; npos where it does not. Text that is no JSON is looked at
/// as if it were: a parser that stops at the first fault does not get deeper.
inline size_t too_deep_at(std::string_view json) {
  size_t depth = 0;
  bool in_string = false;
  for (size_t i = 0; i < json.size(); ++i) {
    const char c = json[i];
    if (in_string) {
      if (c == '\\') ++i;
      if (c == '"') in_string = false;
    } else if (c == '"') {
      in_string = true;
    } else if (c == '{' || c == '[') {
      if (++depth > kMostJsonDepth) return i;
    } else if ((c == '}' || c == ']') && depth > 0) {
      --depth;
    }
  }
  return json.npos;
}

/// nlohmann's ordered_json compares each key of an object with all before it.
inline constexpr size_t kMostOrderedMembers = 10000;

/// The byte at which an object, at most kMostJsonDepth deep, gets one member more than that; npos where none
/// does.
inline size_t too_wide_at(std::string_view json) {
  std::array<size_t, kMostJsonDepth + 1> members{};
  size_t depth = 0;
  bool in_string = false;
  for (size_t i = 0; i < json.size(); ++i) {
    const char c = json[i];
    if (in_string) {
      if (c == '\\') ++i;
      if (c == '"') in_string = false;
    } else if (c == '"') {
      in_string = true;
    } else if ((c == '{' || c == '[') && depth < kMostJsonDepth) {
      members[++depth] = 0;
    } else if ((c == '}' || c == ']') && depth > 0) {
      --depth;
    } else if (c == ':' && ++members[depth] > kMostOrderedMembers) {
      return i;
    }
  }
  return json.npos;
}

template <class Json>
inline constexpr bool kIsOrdered = requires(typename Json::object_t list) {
  list.reserve(1);
};

/// As nlohmann's basic_json; a discarded value where it is no JSON, nested deeper than kMostJsonDepth or,
/// read in its order, wider than kMostOrderedMembers.
template <class Json>
Json parse_untrusted(std::string_view json) {
  if (too_deep_at(json) != json.npos) return Json(Json::value_t::discarded);
  if constexpr (kIsOrdered<Json>)
    if (too_wide_at(json) != json.npos) return Json(Json::value_t::discarded);
  return Json::parse(json, nullptr, false);
}

}  // namespace nif
