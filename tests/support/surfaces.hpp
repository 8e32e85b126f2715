// Checks that generated meshes are closed surfaces.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <utility>
#include <vector>

#include "formats/mesh/mesh_scene.hpp"

namespace nif::test {

/// Is each edge used once in each direction? open_edges() alone would miss an edge of four triangles.
inline void expect_closed(const mesh::Mesh& mesh) {
  std::vector<std::pair<uint32_t, uint32_t>> edges;
  for (const mesh::Triangle& t : mesh.triangles)
    for (size_t i = 0; i < 3; ++i) edges.emplace_back(t[i], t[(i + 1) % 3]);
  std::sort(edges.begin(), edges.end());
  EXPECT_EQ(std::adjacent_find(edges.begin(), edges.end()), edges.end()) << "an edge runs twice the same way";
  size_t open = 0;
  for (const auto& [a, b] : edges) open += !std::binary_search(edges.begin(), edges.end(), std::pair(b, a));
  EXPECT_EQ(open, 0u);
}

/// Splits a mesh into its surfaces, each a list of triangles.
inline std::vector<mesh::Mesh> surfaces(const mesh::Mesh& mesh) {
  std::vector<uint32_t> parent(mesh.positions.size());
  for (uint32_t i = 0; i < parent.size(); ++i) parent[i] = i;
  const auto root = [&](uint32_t i) {
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
  };
  for (const mesh::Triangle& t : mesh.triangles) {
    parent[root(t[1])] = root(t[0]);
    parent[root(t[2])] = root(t[0]);
  }
  std::map<uint32_t, mesh::Mesh> parts;
  for (const mesh::Triangle& t : mesh.triangles) {
    mesh::Mesh& part = parts[root(t[0])];
    const auto base = uint32_t(part.positions.size());
    for (const uint32_t vertex : t) part.positions.push_back(mesh.positions[vertex]);
    part.triangles.push_back({base, base + 1, base + 2});
  }
  std::vector<mesh::Mesh> out;
  for (auto& [first, part] : parts) out.push_back(std::move(part));
  return out;
}

}  // namespace nif::test
