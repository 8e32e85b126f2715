// Marks are the preprocessor's lines in nif.glsl, which in nif.wgsl are comments: `#if NIF_TRIANGLES && NIF_FIRST_HITS`.
#include "tools/export_shader/shader_sections.hpp"

#include <algorithm>
#include <iterator>
#include <optional>
#include <stdexcept>

#include "kernels/shader/shader_tables.hpp"

namespace nif::tools {
namespace {

struct Section {
  std::string_view macro;
  const char* name;
  bool ShaderSections::*wanted;
};
constexpr Section kSections[] = {{"NIF_PLANES", "planes", &ShaderSections::planes},
                                 {"NIF_NETWORK", "network", &ShaderSections::network},
                                 {"NIF_TRIANGLES", "triangles", &ShaderSections::triangles},
                                 {"NIF_SCENES", "scenes", &ShaderSections::scenes},
                                 {"NIF_FIRST_HITS", "first hits", &ShaderSections::first_hits}};

const Section* find_section(std::string_view macro) {
  const auto* const found = std::ranges::find(kSections, macro, &Section::macro);
  return found == std::end(kSections) ? nullptr : found;
}

/// The words of a line of the preprocessor, in a comment or not; none of other lines.
std::vector<std::string_view> directive(std::string_view line) {
  if (line.starts_with("// ")) line.remove_prefix(3);
  std::vector<std::string_view> words;
  if (!line.starts_with('#')) return words;
  line = line.substr(0, line.find(" //"));
  while (!line.empty()) {
    const size_t end = std::min(line.find(' '), line.size());
    if (end > 0) words.push_back(line.substr(0, end));
    line.remove_prefix(std::min(end + 1, line.size()));
  }
  return words;
}

/// Whether what follows a mark is wanted; nothing if the line is no mark of a section.
std::optional<bool> wanted_after(const std::vector<std::string_view>& words, const ShaderSections& sections) {
  if (words.size() == 2 && words[0] == "#ifndef" && find_section(words[1]) != nullptr)
    return false;  // its default
  if (words.empty() || words[0] != "#if") return std::nullopt;
  const auto wanted = [&](std::string_view macro) {
    const Section* const section = find_section(macro);
    if (section == nullptr)
      throw std::logic_error("a shader's text has the unknown mark " + std::string(macro));
    return sections.*section->wanted;
  };
  if (words.size() == 2) return wanted(words[1]);
  if (words.size() == 4 && words[2] == "&&") return wanted(words[1]) && wanted(words[3]);
  if (words.size() == 4 && words[2] == "||") return wanted(words[1]) || wanted(words[3]);
  throw std::logic_error("a shader's text has a mark of another form");
}

}  // namespace

void ShaderSections::add_object(uint32_t flags) {
  using namespace kernels::shader;
  planes |= (flags & kHasPlanes) != 0;
  network |= (flags & kHasNetwork) != 0;
  triangles |= (flags & kHasTriangles) != 0;
  first_hits |= (flags & kHasTriangles) != 0;
}

std::vector<std::string> ShaderSections::names() const {
  std::vector<std::string> names;
  for (const Section& section : kSections)
    if (this->*section.wanted) names.emplace_back(section.name);
  return names;
}

std::string ShaderSections::listed() const {
  std::string text;
  for (const std::string& name : names()) text += (text.empty() ? "" : ", ") + name;
  return text;
}

std::string cut_shader(std::string_view text, const ShaderSections& sections) {
  struct Block {
    bool is_section, wanted;
  };
  std::vector<Block> open;  // the blocks that a line is in
  std::string cut;
  while (!text.empty()) {
    const std::string_view line = text.substr(0, std::min(text.find('\n'), text.size() - 1) + 1);
    text.remove_prefix(line.size());
    const auto words = directive(line.substr(0, line.find('\n')));
    const std::optional<bool> wanted = wanted_after(words, sections);
    const bool ends = !words.empty() && words[0] == "#endif";
    bool is_mark = wanted.has_value();
    if (wanted)
      open.push_back({true, *wanted});
    else if (!words.empty() && words[0].starts_with("#if"))
      open.push_back({false, true});
    else if (ends)
      is_mark = open.at(open.size() - 1).is_section;
    const bool is_blank = line == "\n" && (cut.empty() || cut.ends_with("\n\n"));
    if (!is_mark && !is_blank && std::ranges::all_of(open, &Block::wanted)) cut += line;
    if (ends) open.pop_back();
    if (cut.size() == line.size())
      cut += "// Written by nif export-shader with only what these need: " + sections.listed() +
             ". Objects of other kinds are left open.\n";
  }
  if (!open.empty()) throw std::logic_error("a shader's text has a mark without an end");
  return cut;
}

}  // namespace nif::tools
