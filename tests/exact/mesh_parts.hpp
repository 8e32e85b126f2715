// What hostile meshes are put together from: walls, boxes, and changes of all triangles or corners.
#pragma once

#include <algorithm>
#include <array>
#include <map>
#include <utility>
#include <vector>

#include "formats/base/collinear.hpp"
#include "tests/exact/draws.hpp"
#include "tests/exact/generators.hpp"

namespace nif::test {

using mesh::Float3;
using mesh::Mesh;

inline void add_triangle(Mesh& mesh, const Float3& a, const Float3& b, const Float3& c) {
  const auto base = uint32_t(mesh.positions.size());
  mesh.positions.insert(mesh.positions.end(), {a, b, c});
  mesh.triangles.push_back({base, base + 1, base + 2});
}

/// Two triangles, cut along either diagonal.
inline void add_quad(Mesh& mesh, const std::array<Float3, 4>& at, nif::Random& random) {
  const size_t first = random.below(2);
  add_triangle(mesh, at[first], at[first + 1], at[first + 2]);
  add_triangle(mesh, at[first], at[first + 2], at[(first + 3) % 4]);
}

using Cuts = std::vector<float>;

/// From `low` to `high`, and some of the whole numbers between, `most` at most.
inline Cuts cuts_between(nif::Random& random, int low, int high, int most) {
  Cuts cuts{float(low)};
  for (int at = low + 1; at < high; ++at)
    if (int(cuts.size()) <= most && random.below(2)) cuts.push_back(float(at));
  cuts.push_back(float(high));
  return cuts;
}

/// A rectangle across an axis, cut into smaller ones.
inline void add_wall(Mesh& mesh, size_t axis, float level, bool up, const Cuts& b, const Cuts& c,
                     nif::Random& random) {
  for (size_t i = 0; i + 1 < b.size(); ++i)
    for (size_t k = 0; k + 1 < c.size(); ++k) {
      std::array<Float3, 4> at;
      for (size_t corner = 0; corner < 4; ++corner) {
        at[corner][axis] = level;
        at[corner][(axis + 1) % 3] = b[i + (corner == 1 || corner == 2)];
        at[corner][(axis + 2) % 3] = c[k + (corner >= 2)];
      }
      if (!up) std::swap(at[1], at[3]);
      add_quad(mesh, at, random);
    }
}

struct WholeBox {
  std::array<int, 3> low, high;
};

inline WholeBox whole_box(nif::Random& random, int most = 6) {
  WholeBox box;
  for (size_t a = 0; a < 3; ++a) {
    box.low[a] = between(random, -4, 4);
    box.high[a] = box.low[a] + between(random, 1, most);
  }
  return box;
}

/// Its walls are cut alike where they meet, or each in its own way: then corners lie on edges of others.
inline void add_box(Mesh& mesh, const WholeBox& box, int least_cuts, int most_cuts, bool alike,
                    nif::Random& random) {
  most_cuts = between(random, least_cuts, most_cuts);
  std::array<Cuts, 3> cuts;
  for (size_t axis = 0; axis < 3; ++axis)
    cuts[axis] = cuts_between(random, box.low[axis], box.high[axis], most_cuts);
  for (size_t axis = 0; axis < 3; ++axis)
    for (const bool up : {false, true}) {
      const size_t b = (axis + 1) % 3, c = (axis + 2) % 3;
      const float level = float(up ? box.high[axis] : box.low[axis]);
      if (!alike)
        for (const size_t a : {b, c}) cuts[a] = cuts_between(random, box.low[a], box.high[a], most_cuts);
      add_wall(mesh, axis, level, up, cuts[b], cuts[c], random);
    }
}

/// Makes one position of those that are equal.
inline void weld_equal(Mesh& mesh) {
  std::map<Float3, uint32_t> seen;
  std::vector<Float3> positions;
  for (mesh::Triangle& t : mesh.triangles)
    for (uint32_t& v : t) {
      const auto [entry, fresh] = seen.try_emplace(mesh.positions[v], uint32_t(positions.size()));
      if (fresh) positions.push_back(mesh.positions[v]);
      v = entry->second;
    }
  mesh.positions = std::move(positions);
}

inline void flip(mesh::Triangle& t) { std::swap(t[1], t[2]); }

/// Repeats each triangle, so that it is there `copies` times, facing as it likes.
inline void repeat_triangles(Mesh& mesh, int copies, nif::Random& random) {
  const auto once = mesh.triangles;
  for (int copy = 1; copy < copies; ++copy)
    for (mesh::Triangle t : once) {
      if (random.below(2)) flip(t);
      mesh.triangles.push_back(t);
    }
}

/// Moves each coordinate: times a factor, plus an offset, of its axis.
inline void stretch(Mesh& mesh, const Double3& scale, const Double3& offset) {
  for (Float3& p : mesh.positions)
    for (size_t a = 0; a < 3; ++a) p[a] = float(p[a] * scale[a] + offset[a]);
}

/// Puts what has whole coordinates somewhere on a grid, so that all stays exact.
inline HostileMesh on_grid(Mesh mesh, bool closed, nif::Random& random) {
  const double step = power(random, -6, 3);
  const Double3 offset = random.below(2) ? Double3{} : whole_vector(random, 12) * step;
  stretch(mesh, {step, step, step}, offset);
  if (random.below(2)) weld_equal(mesh);
  return {std::move(mesh), closed};
}

/// Of walls across the axes: on a grid, or somewhere. Each coordinate is rounded by itself, so walls stay
/// across the axes, and what lies on their edges stays there.
inline HostileMesh along_axes(Mesh mesh, bool closed, nif::Random& random) {
  if (random.below(3)) return on_grid(std::move(mesh), closed, random);
  Double3 scale, offset;
  for (size_t a = 0; a < 3; ++a) {
    scale[a] = spread(random, 0.05, 10);
    offset[a] = random.uniform(-20, 20);
  }
  stretch(mesh, scale, offset);
  return on_grid(std::move(mesh), closed, random);
}

/// What is round: as it is, or rounded to a grid. Its edges stay shared.
inline HostileMesh maybe_rounded(Mesh mesh, bool closed, nif::Random& random) {
  const double size = spread(random, 0.1, 10);
  const Double3 offset = random.below(2) ? Double3{} : arrow(random, size, size * 9);
  stretch(mesh, {size, size, size}, offset);
  if (random.below(2))
    for (Float3& p : mesh.positions)
      for (float& x : p) x = float(std::round(x * 64 / size));
  return {std::move(mesh), closed};
}

/// Whether each edge has an even number of sides, between equal corners.
inline bool edges_are_shared(const Mesh& mesh) {
  std::map<std::pair<Float3, Float3>, int> sides;
  for (const mesh::Triangle& t : mesh.triangles)
    for (size_t i = 0; i < 3; ++i) {
      const Float3 &a = mesh.positions[t[i]], &b = mesh.positions[t[(i + 1) % 3]];
      if (a != b) ++sides[{std::min(a, b), std::max(a, b)}];
    }
  return std::all_of(sides.begin(), sides.end(), [](const auto& side) { return side.second % 2 == 0; });
}

/// How many triangles have an area.
inline size_t count_wide(const Mesh& mesh) {
  return size_t(std::count_if(mesh.triangles.begin(), mesh.triangles.end(), [&](const mesh::Triangle& t) {
    return !collinear(mesh.positions[t[0]], mesh.positions[t[1]], mesh.positions[t[2]]);
  }));
}

}  // namespace nif::test
