// Meshes as OBJ text, for the program to read.
#pragma once

#include <cstdio>
#include <string>

#include "formats/mesh/mesh_scene.hpp"

namespace nif::test {

/// One object of an OBJ file. `base` is the number of vertices in the file so far, and counts on.
inline std::string obj_object(const mesh::Mesh& mesh, const std::string& name, size_t& base) {
  std::string text = "o " + name + "\n";
  char line[128];
  for (const mesh::Float3& p : mesh.positions) {
    std::snprintf(line, sizeof(line), "v %.9g %.9g %.9g\n", double{p[0]}, double{p[1]}, double{p[2]});
    text += line;
  }
  for (const mesh::Triangle& t : mesh.triangles) {
    std::snprintf(line, sizeof(line), "f %zu %zu %zu\n", base + t[0] + 1, base + t[1] + 1, base + t[2] + 1);
    text += line;
  }
  base += mesh.positions.size();
  return text;
}

inline std::string obj_text(const mesh::Mesh& mesh) {
  size_t base = 0;
  return obj_object(mesh, mesh.name, base);
}

}  // namespace nif::test
