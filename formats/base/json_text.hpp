// Parses untrusted JSON, with limits on depth and width that protect recursive and quadratic libraries.
#pragma once

#include <array>
#include <cstddef>
#include <string_view>

namespace nif {

/// nlohmann's JSON recurses for each level of a value to copy and to write it, and tinygltf does to read it.
/// No real file comes close to this.
inline constexpr size_t kMostJsonDepth = 128;

/// nlohmann's ordered_json compares each key of an object with all keys before it.
inline constexpr size_t kMostOrderedMembers = 10000;

/// The byte at which JSON exceeds kMostJsonDepth levels or an object exceeds `most_members` members; npos if
/// neither happens. Invalid JSON is scanned as if it were valid: a parser that stops at the first error gets
/// no deeper.
inline size_t too_large_at(std::string_view json, size_t most_members) {
  std::array<size_t, kMostJsonDepth + 1> members{};  // of the open objects
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

/// Parses like nlohmann's basic_json. Returns a discarded value if the text is not JSON, is nested deeper
/// than kMostJsonDepth or, for ordered JSON, has objects with more than kMostOrderedMembers members.
template <class Json>
Json parse_untrusted(std::string_view json) {
  if (too_large_at(json, kIsOrdered<Json> ? kMostOrderedMembers : json.npos) != json.npos)
    return Json(Json::value_t::discarded);
  return Json::parse(json, nullptr, false);
}

}  // namespace nif
