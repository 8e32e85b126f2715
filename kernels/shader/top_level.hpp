// The tree over a scene's instances as shaders read it (docs/shaders.md, "The words of a scene").
#pragma once

#include <cstdint>
#include <memory_resource>
#include <span>
#include <vector>

#include "kernels/reference/instance.hpp"

namespace nif::kernels::shader {

inline constexpr uint32_t kTopNodeWords = 8;
/// Words of a node. The first 6: its box, lowest, then highest corner, floats.
enum TopNodeWord : uint32_t {
  kTopNext = 6,  ///< the word, from the scene's first, at which a ray goes on that misses the box
  kTopList = 7   ///< 0, or of a leaf: its first instance in the order of the tables * 8 + how many there are
};

struct TopLevel {
  std::pmr::vector<uint32_t> order;  ///< boxes as instances lie in the tables
  std::pmr::vector<uint32_t> words;
};

/// How many words the tree takes over so many boxes.
size_t count_top_level_words(size_t boxes);
/// `first`: where the tree's words will lie.
TopLevel make_top_level(std::span<const WorldBox> boxes, uint32_t first, std::pmr::memory_resource* memory);

}  // namespace nif::kernels::shader
