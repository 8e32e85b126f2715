// JSON that others wrote, how deep it may be nested, and how wide.
#pragma once

#include <array>
#include <cstddef>
#include <string_view>

namespace nif {

/// nlohmann's JSON calls itself for each level of a value to copy and to write it, and tinygltf does to read
/// it. No real file comes near.
inline constexpr size_t kMostJsonDepth = 128;

/// nlohmann's ordered_json compares each key of an object with all before it.
inline constexpr size_t kMostOrderedMembers = 10000;

/// The byte at which JSON opens a level beyond kMostJsonDepth, or has a member more than `most_members` in
/// one object; npos where it does neither. Text that is no JSON is looked at as if it were: a parser that
/// stops at the first fault does not get deeper.
inline size_t too_large_at(std::string_view json, size_t most_members) {
  std::array<size_t, kMostJsonDepth + 1> members{};  // of the objects that are open
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
      members[depth] = 0;
    } else if ((c == '}' || c == ']') && depth > 0) {
      --depth;
    } else if (c == ':' && ++members[depth] > most_members) {
      return i;
    }
  }
  return json.npos;
}
inline size_t too_deep_at(std::string_view json) { return too_large_at(json, json.npos); }

template <class Json>
inline constexpr bool kIsOrdered = requires(typename Json::object_t list) {
  list.reserve(1);
};

/// As nlohmann's basic_json; a discarded value where it is no JSON, nested deeper than kMostJsonDepth or,
/// read in its order, wider than kMostOrderedMembers.
template <class Json>
Json parse_untrusted(std::string_view json) {
  if (too_large_at(json, kIsOrdered<Json> ? kMostOrderedMembers : json.npos) != json.npos)
    return Json(Json::value_t::discarded);
  return Json::parse(json, nullptr, false);
}

}  // namespace nif
