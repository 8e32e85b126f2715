// Small meshes of known shape for tests. Closed ones are welded and face outwards, counter-clockwise.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <numbers>
#include <utility>
#include <vector>

#include "formats/mesh/mesh_scene.hpp"

namespace nif::test {

/// Adds `part` to `mesh`, moved by `offset`, scaled by `scale`, and turned inside out if `flipped`.
inline void append(mesh::Mesh& mesh, const mesh::Mesh& part, float scale = 1, mesh::Float3 offset = {0, 0, 0},
                   bool flipped = false) {
  const auto base = static_cast<uint32_t>(mesh.positions.size());
  for (const mesh::Float3& p : part.positions) {
    mesh.positions.push_back({p[0] * scale + offset[0], p[1] * scale + offset[1], p[2] * scale + offset[2]});
  }
  for (mesh::Triangle t : part.triangles) {
    if (flipped) std::swap(t[1], t[2]);
    mesh.triangles.push_back({base + t[0], base + t[1], base + t[2]});
  }
}

/// The cube [-1, 1]^3: 8 vertices, 12 triangles.
inline mesh::Mesh cube() {
  mesh::Mesh out{"cube", {}, {}};
  for (int i = 0; i < 8; ++i)
    out.positions.push_back({i & 1 ? 1.f : -1.f, i & 2 ? 1.f : -1.f, i & 4 ? 1.f : -1.f});
  const std::array<std::array<uint32_t, 4>, 6> sides{
      {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}}};
  for (const auto& s : sides) {
    out.triangles.push_back({s[0], s[1], s[2]});
    out.triangles.push_back({s[0], s[2], s[3]});
  }
  return out;
}

/// The unit sphere from an icosahedron: 20 * 4^level triangles of similar size.
inline mesh::Mesh icosphere(int level) {
  mesh::Mesh out{"icosphere", {}, {}};
  const auto add = [&](double x, double y, double z) {
    const double length = std::sqrt(x * x + y * y + z * z);
    out.positions.push_back(
        {static_cast<float>(x / length), static_cast<float>(y / length), static_cast<float>(z / length)});
    return static_cast<uint32_t>(out.positions.size() - 1);
  };
  const double g = std::numbers::phi;
  add(-1, g, 0), add(1, g, 0), add(-1, -g, 0), add(1, -g, 0);
  add(0, -1, g), add(0, 1, g), add(0, -1, -g), add(0, 1, -g);
  add(g, 0, -1), add(g, 0, 1), add(-g, 0, -1), add(-g, 0, 1);
  out.triangles = {{0, 11, 5},  {0, 5, 1},  {0, 1, 7},  {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4},
                   {11, 10, 2}, {10, 7, 6}, {7, 1, 8},  {3, 9, 4},  {3, 4, 2},   {3, 2, 6}, {3, 6, 8},
                   {3, 8, 9},   {4, 9, 5},  {2, 4, 11}, {6, 2, 10}, {8, 6, 7},   {9, 8, 1}};
  for (; level > 0; --level) {
    std::map<std::pair<uint32_t, uint32_t>, uint32_t> middles;
    const auto middle = [&](uint32_t a, uint32_t b) {
      const auto [entry, fresh] = middles.try_emplace({std::min(a, b), std::max(a, b)}, 0);
      if (fresh) {
        const mesh::Float3 p = out.positions[a], q = out.positions[b];
        entry->second = add(double{p[0]} + q[0], double{p[1]} + q[1], double{p[2]} + q[2]);
      }
      return entry->second;
    };
    std::vector<mesh::Triangle> finer;
    for (const auto& [a, b, c] : out.triangles) {
      const uint32_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
      finer.insert(finer.end(), {{a, ab, ca}, {b, bc, ab}, {c, ca, bc}, {ab, bc, ca}});
    }
    out.triangles = std::move(finer);
  }
  return out;
}

/// The part of the unit sphere within `polar_end` of +z (in radians), in rings and sectors. Closed at pi,
/// else a bowl open towards -z.
inline mesh::Mesh sphere_cap(int rings, int sectors, double polar_end) {
  mesh::Mesh out{"sphere cap", {}, {}};
  const bool closed = polar_end >= std::numbers::pi;
  const auto n = static_cast<uint32_t>(sectors);
  out.positions.push_back({0, 0, 1});
  const int last = closed ? rings - 1 : rings;
  for (int i = 1; i <= last; ++i) {
    const double polar = polar_end * i / rings;
    for (int k = 0; k < sectors; ++k) {
      const double turn = 2 * std::numbers::pi * k / sectors;
      out.positions.push_back({static_cast<float>(std::sin(polar) * std::cos(turn)),
                               static_cast<float>(std::sin(polar) * std::sin(turn)),
                               static_cast<float>(std::cos(polar))});
    }
  }
  const auto at = [&](int ring, uint32_t k) { return 1 + static_cast<uint32_t>(ring - 1) * n + k % n; };
  for (uint32_t k = 0; k < n; ++k) {
    out.triangles.push_back({0, at(1, k), at(1, k + 1)});
    for (int i = 1; i < last; ++i) {
      out.triangles.push_back({at(i, k), at(i + 1, k), at(i + 1, k + 1)});
      out.triangles.push_back({at(i, k), at(i + 1, k + 1), at(i, k + 1)});
    }
  }
  if (closed) {
    const auto pole = static_cast<uint32_t>(out.positions.size());
    out.positions.push_back({0, 0, -1});
    for (uint32_t k = 0; k < n; ++k) out.triangles.push_back({at(last, k), pole, at(last, k + 1)});
  }
  return out;
}

/// The unit sphere by latitude and longitude: 2 * sectors * (rings - 1) triangles.
inline mesh::Mesh uv_sphere(int rings, int sectors) {
  mesh::Mesh out = sphere_cap(rings, sectors, std::numbers::pi);
  out.name = "uv sphere";
  return out;
}

/// The half of the unit sphere with z >= 0, without a lid.
inline mesh::Mesh open_bowl(int rings, int sectors) {
  mesh::Mesh out = sphere_cap(rings, sectors, std::numbers::pi / 2);
  out.name = "open bowl";
  return out;
}

/// A ring around the z axis: 2 * around * across triangles.
inline mesh::Mesh torus(int around, int across, double radius = 1, double thickness = 0.4) {
  mesh::Mesh out{"torus", {}, {}};
  const auto n = static_cast<uint32_t>(around), m = static_cast<uint32_t>(across);
  for (uint32_t i = 0; i < n; ++i) {
    const double u = 2 * std::numbers::pi * i / n;
    for (uint32_t k = 0; k < m; ++k) {
      const double v = 2 * std::numbers::pi * k / m, r = radius + thickness * std::cos(v);
      out.positions.push_back({static_cast<float>(r * std::cos(u)), static_cast<float>(r * std::sin(u)),
                               static_cast<float>(thickness * std::sin(v))});
    }
  }
  const auto at = [&](uint32_t i, uint32_t k) { return i % n * m + k % m; };
  for (uint32_t i = 0; i < n; ++i) {
    for (uint32_t k = 0; k < m; ++k) {
      out.triangles.push_back({at(i, k), at(i + 1, k), at(i + 1, k + 1)});
      out.triangles.push_back({at(i, k), at(i + 1, k + 1), at(i, k + 1)});
    }
  }
  return out;
}

/// A hollow ball: the unit sphere outside, and inside it one of radius `inner` that faces its own centre, so
/// that the solid lies between them.
inline mesh::Mesh nested_spheres(int level, float inner = 0.5f) {
  mesh::Mesh out{"nested spheres", {}, {}};
  append(out, icosphere(level));
  append(out, icosphere(level), inner, {0, 0, 0}, true);
  return out;
}

/// The volume inside a closed mesh; positive if it faces outwards.
inline double signed_volume(const mesh::Mesh& mesh) {
  double six = 0;
  for (const mesh::Triangle& t : mesh.triangles) {
    const mesh::Float3 a = mesh.positions[t[0]], b = mesh.positions[t[1]], c = mesh.positions[t[2]];
    six += double{a[0]} * (double{b[1]} * c[2] - double{b[2]} * c[1]) +
           double{a[1]} * (double{b[2]} * c[0] - double{b[0]} * c[2]) +
           double{a[2]} * (double{b[0]} * c[1] - double{b[1]} * c[0]);
  }
  return six / 6;
}

/// Directed edges that no triangle uses in the other direction; none if the mesh is closed and oriented.
inline size_t open_edges(const mesh::Mesh& mesh) {
  std::map<std::pair<uint32_t, uint32_t>, int> balance;
  for (const mesh::Triangle& t : mesh.triangles) {
    for (size_t i = 0; i < 3; ++i) {
      const uint32_t a = t[i], b = t[(i + 1) % 3];
      balance[{std::min(a, b), std::max(a, b)}] += a < b ? 1 : -1;
    }
  }
  size_t open = 0;
  for (const auto& [edge, sum] : balance) open += sum != 0;
  return open;
}

}  // namespace nif::test
