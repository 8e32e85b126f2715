// The sections of the texts of kernels/shader that can be left out where no object needs them.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace nif::tools {

struct ShaderSections {
  bool planes = false, network = false, triangles = false, scenes = false, first_hits = false;

  static ShaderSections all() { return {true, true, true, true, true}; }
  /// Adds what an object needs. `flags`: word 3 of its tables.
  void add_object(uint32_t flags);
  /// As users know them.
  std::vector<std::string> names() const;
  std::string listed() const;
};

/// A text of kernels/shader, in either language, without the sections that are not wanted, and without marks.
std::string cut_shader(std::string_view text, const ShaderSections& sections);

}  // namespace nif::tools
