// The triangles of one object as shaders read them: a tree that is walked without a stack. Its nodes lie depth first,
// each with the place at which the walk goes on if the ray misses its box (docs/shaders.md, "The words").
#pragma once

#include <cstdint>
#include <memory_resource>
#include <vector>

#include "kernels/reference/triangles/triangles_field.hpp"

namespace nif::kernels::shader {

inline constexpr uint32_t kTreeLeaf =
    0x80000000u;                              ///< bit of a node's last word; below it the number of triangles
inline constexpr uint32_t kBoxSteps = 65535;  ///< a box's planes count steps from the tree's corner

/// What a triangle takes at most: a leaf and an inner node of its own, and a number.
inline constexpr uint32_t kMostWordsOfATriangle = 12;

/// Of a tree: its boxes' planes are corner + step * (0 to kBoxSteps), along each axis.
struct TreeFrame {
  float corner[3], step[3];
};

/// How many words the tree takes. The field must be one that the loader accepts.
uint64_t count_tree_words(const TrianglesField& field);
/// Appends the tree to the words.
TreeFrame append_tree(const TrianglesField& field, std::pmr::vector<uint32_t>& words);

}  // namespace nif::kernels::shader
