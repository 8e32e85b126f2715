// A scanner that only knows strings and brackets, and skips everything else. It does not recurse, and stays
// within any text. Edits are sorted by position, then applied in one pass.
#include "formats/mesh/gltf/gltf_json_text.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>

namespace nif::mesh::detail {

size_t JsonText::skip_space(size_t at) const {
  return std::min(text_.find_first_not_of(" \t\r\n", at), text_.size());
}

/// From an opening quote to after the closing one. A string may contain whole buffers.
size_t JsonText::skip_string(size_t at) const {
  for (size_t quote = text_.find('"', at + 1); quote != std::string_view::npos;
       quote = text_.find('"', quote + 1)) {
    size_t slashes = 0;
    while (quote - slashes - 1 > at && text_[quote - slashes - 1] == '\\') ++slashes;
    if (slashes % 2 == 0) return quote + 1;
  }
  return text_.size();
}

size_t JsonText::skip_value(size_t at) const {
  size_t depth = 0;
  while (at < text_.size()) {
    switch (text_[at]) {
      case '"':
        at = skip_string(at);
        break;
      case '{':
      case '[':
        ++depth;
        ++at;
        break;
      case '}':
      case ']':
        if (depth == 0) return at;  // not JSON
        --depth;
        ++at;
        break;
      default:
        // Outside of strings and brackets, white space and punctuation end a value; numbers and words are
        // values.
        if (depth == 0) return std::min(text_.find_first_of(" \t\r\n,:]}", at), text_.size());
        at = std::min(text_.find_first_of("\"{}[]", at), text_.size());
    }
    if (depth == 0) return at;
  }
  return at;
}

std::vector<JsonItem> JsonText::items(size_t value) const {
  std::vector<JsonItem> out;
  const bool object = is_object(value);
  if (!object && !is_array(value)) return out;
  for (size_t at = value + 1;; ++at) {  // from after a bracket or a comma
    JsonItem item;
    item.begin = item.value = at = skip_space(at);
    if (at == text_.size() || text_[at] == '}' || text_[at] == ']') return out;
    if (object) item.value = skip_space(skip_space(skip_string(at)) + 1);
    item.end = skip_value(std::min(item.value, text_.size()));
    out.push_back(item);
    at = skip_space(item.end);
    if (!starts_with(at, ',')) return out;
  }
}

std::string JsonText::key(const JsonItem& member) const {
  const std::string_view quoted = text_.substr(member.begin, skip_string(member.begin) - member.begin);
  if (quoted.find('\\') == std::string_view::npos && quoted.size() >= 2)
    return std::string(quoted.substr(1, quoted.size() - 2));
  const nlohmann::json parsed = nlohmann::json::parse(quoted, nullptr, false);
  return parsed.is_string() ? parsed.get<std::string>() : std::string();
}

std::optional<JsonItem> JsonText::find(size_t object, std::string_view name) const {
  return is_object(object) ? find(items(object), name) : std::nullopt;
}

std::optional<JsonItem> JsonText::find(const std::vector<JsonItem>& members, std::string_view name) const {
  std::optional<JsonItem> found;
  for (const JsonItem& member : members)
    if (key(member) == name) found = member;
  return found;
}

ptrdiff_t TextEdits::growth() const {
  ptrdiff_t growth = 0;
  for (const Edit& edit : edits_) growth += ptrdiff_t(edit.text.size()) - ptrdiff_t(edit.end - edit.begin);
  return growth;
}

void TextEdits::apply(std::string_view text, FilePieces& out) const {
  std::vector<const Edit*> sorted;
  for (const Edit& edit : edits_) sorted.push_back(&edit);
  std::ranges::stable_sort(sorted, {}, [](const Edit* edit) { return std::pair(edit->begin, edit->end); });
  size_t at = 0;
  for (const Edit* edit : sorted) {
    out.refer(text.substr(at, edit->begin - at));
    out.own(edit->text);
    at = edit->end;
  }
  out.refer(text.substr(at));
}

}  // namespace nif::mesh::detail
