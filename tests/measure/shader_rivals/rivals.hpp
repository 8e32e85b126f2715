// Rivals of kernels/shader for tests/measure/shader_speed.cpp: hierarchies that are walked with a stack, made from the triangles
// of a `bvh` object. binary.comp and wide.comp say what the words are.
#pragma once

#include <cstdint>
#include <vector>

#include "kernels/reference/triangles/triangles_field.hpp"

namespace nif::test {

/// The object's own nodes, and its triangles in three vec4s each.
std::vector<uint32_t> wide_rival(const kernels::TrianglesField& field);
/// Binned by the surface area heuristic, at most four triangles a leaf.
std::vector<uint32_t> binary_rival(const kernels::TrianglesField& field);

}  // namespace nif::test
