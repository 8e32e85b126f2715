// Reads triangles from an OBJ file, with as much of the format as a sample needs.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

struct Mesh {
  std::vector<std::array<float, 3>> positions;
  std::vector<std::array<uint32_t, 3>> triangles;
  std::array<float, 3> low, high;  // of the triangles' corners
};

/// Reads vertices and faces. Faces with more corners become fans; everything else is skipped. Throws
/// std::runtime_error.
Mesh read_obj(const std::string& path);
