// The generators, in four parts: meshes, parts of rays, rays, transforms. Each says what it attacks.
#include "tests/exact/generators.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <utility>
#include <vector>

#include "formats/base/collinear.hpp"
#include "formats/base/vector.hpp"
#include "formats/mesh/transform.hpp"
#include "tests/support/shapes.hpp"

namespace nif::test {
namespace {

using mesh::Float3;
using mesh::Mesh;

// ---- Numbers ----------------------------------------------------------------------------------------------

/// A whole number, both ends among them.
int between(nif::Random& random, int low, int high) {
  return low + int(random.below(uint32_t(high - low + 1)));
}
bool chance(nif::Random& random, uint32_t one_in) { return random.below(one_in) == 0; }
double sign(nif::Random& random) { return random.below(2) ? 1 : -1; }
double power(nif::Random& random, int low, int high) { return std::ldexp(1, between(random, low, high)); }
/// As often near one power of two as near another.
double spread(nif::Random& random, double low, double high) {
  return std::exp2(random.uniform(std::log2(low), std::log2(high)));
}
/// Any direction, a length between both.
Double3 arrow(nif::Random& random, double low, double high) {
  const double size = spread(random, low, high);
  return random.direction() * size;
}
std::array<Double3, 3> random_rotation(nif::Random& random) {
  for (;;) {
    const Double3 x = random.direction(), other = random.direction(), n = cross(x, other);
    if (length(n) < 0.01) continue;
    const Double3 z = n * (1 / length(n));
    return {x, cross(z, x), z};
  }
}
float ulps_beside(float x, int steps) {
  for (; steps > 0; --steps) x = std::nextafter(x, kInfinity);
  for (; steps < 0; ++steps) x = std::nextafter(x, -kInfinity);
  return x;
}
/// Of small whole numbers, not all 0.
Double3 whole_vector(nif::Random& random, int most) {
  for (;;) {
    const Double3 v{double(between(random, -most, most)), double(between(random, -most, most)),
                    double(between(random, -most, most))};
    if (dot(v, v) > 0) return v;
  }
}

// ---- Parts of meshes --------------------------------------------------------------------------------------

void add_triangle(Mesh& mesh, const Float3& a, const Float3& b, const Float3& c) {
  const auto base = uint32_t(mesh.positions.size());
  mesh.positions.insert(mesh.positions.end(), {a, b, c});
  mesh.triangles.push_back({base, base + 1, base + 2});
}

/// Two triangles, cut along either diagonal.
void add_quad(Mesh& mesh, const std::array<Float3, 4>& at, nif::Random& random) {
  const size_t first = random.below(2);
  add_triangle(mesh, at[first], at[first + 1], at[first + 2]);
  add_triangle(mesh, at[first], at[first + 2], at[(first + 3) % 4]);
}

using Cuts = std::vector<float>;

/// From `low` to `high`, and some of the whole numbers between, `most` at most.
Cuts cuts_between(nif::Random& random, int low, int high, int most) {
  Cuts cuts{float(low)};
  for (int at = low + 1; at < high; ++at)
    if (int(cuts.size()) <= most && random.below(2)) cuts.push_back(float(at));
  cuts.push_back(float(high));
  return cuts;
}

/// A rectangle across an axis, cut into smaller ones.
void add_wall(Mesh& mesh, size_t axis, float level, bool up, const Cuts& b, const Cuts& c,
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

WholeBox whole_box(nif::Random& random, int most = 6) {
  WholeBox box;
  for (size_t a = 0; a < 3; ++a) {
    box.low[a] = between(random, -4, 4);
    box.high[a] = box.low[a] + between(random, 1, most);
  }
  return box;
}

/// Its walls are cut alike where they meet, or each in its own way: then corners lie on edges of others.
void add_box(Mesh& mesh, const WholeBox& box, int least_cuts, int most_cuts, bool alike,
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
void weld_equal(Mesh& mesh) {
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

void flip(mesh::Triangle& t) { std::swap(t[1], t[2]); }

/// Repeats each triangle, so that it is there `copies` times, facing as it likes.
void repeat_triangles(Mesh& mesh, int copies, nif::Random& random) {
  const auto once = mesh.triangles;
  for (int copy = 1; copy < copies; ++copy)
    for (mesh::Triangle t : once) {
      if (random.below(2)) flip(t);
      mesh.triangles.push_back(t);
    }
}

/// Moves each coordinate: times a factor, plus an offset, of its axis.
void stretch(Mesh& mesh, const Double3& scale, const Double3& offset) {
  for (Float3& p : mesh.positions)
    for (size_t a = 0; a < 3; ++a) p[a] = float(p[a] * scale[a] + offset[a]);
}

/// Puts what has whole coordinates somewhere on a grid, so that all stays exact.
HostileMesh on_grid(Mesh mesh, bool closed, nif::Random& random) {
  const double step = power(random, -6, 3);
  const Double3 offset = random.below(2) ? Double3{} : whole_vector(random, 12) * step;
  stretch(mesh, {step, step, step}, offset);
  if (random.below(2)) weld_equal(mesh);
  return {std::move(mesh), closed};
}

/// Of walls across the axes: on a grid, or somewhere. Each coordinate is rounded by itself, so walls stay
/// across the axes, and what lies on their edges stays there.
HostileMesh along_axes(Mesh mesh, bool closed, nif::Random& random) {
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
HostileMesh maybe_rounded(Mesh mesh, bool closed, nif::Random& random) {
  const double size = spread(random, 0.1, 10);
  const Double3 offset = random.below(2) ? Double3{} : arrow(random, size, size * 9);
  stretch(mesh, {size, size, size}, offset);
  if (random.below(2))
    for (Float3& p : mesh.positions)
      for (float& x : p) x = float(std::round(x * 64 / size));
  return {std::move(mesh), closed};
}

/// Whether each edge has an even number of sides, between equal corners.
bool edges_are_shared(const Mesh& mesh) {
  std::map<std::pair<Float3, Float3>, int> sides;
  for (const mesh::Triangle& t : mesh.triangles)
    for (size_t i = 0; i < 3; ++i) {
      const Float3 &a = mesh.positions[t[i]], &b = mesh.positions[t[(i + 1) % 3]];
      if (a != b) ++sides[{std::min(a, b), std::max(a, b)}];
    }
  return std::all_of(sides.begin(), sides.end(), [](const auto& side) { return side.second % 2 == 0; });
}

/// How many triangles have an area.
size_t count_wide(const Mesh& mesh) {
  return size_t(std::count_if(mesh.triangles.begin(), mesh.triangles.end(), [&](const mesh::Triangle& t) {
    return !collinear(mesh.positions[t[0]], mesh.positions[t[1]], mesh.positions[t[2]]);
  }));
}

// ---- Meshes -----------------------------------------------------------------------------------------------

/// Edges that belong to two triangles do not leak, and one of them answers for a point of the edge.
HostileMesh box_on_grid(nif::Random& random) {
  Mesh mesh;
  add_box(mesh, whole_box(random), 0, 3, true, random);
  return along_axes(std::move(mesh), true, random);
}

/// Cells of a small grid that are full: walls in planes of the grid, edges of four walls, corners that touch.
/// Half of them are stairs. Attacks what is proven of a cell whose surface lies in its own planes.
HostileMesh stairs(nif::Random& random) {
  const int wide = between(random, 1, 4), deep = between(random, 1, 2), tall = between(random, 1, 4);
  const bool steps = random.below(2) != 0;
  std::vector<bool> full(size_t(wide * deep * tall));
  for (size_t i = 0; i < full.size(); ++i)
    full[i] = steps ? int(i) / wide / deep <= int(i) % wide : random.below(2) != 0;
  full[0] = true;
  const auto at = [&](const std::array<int, 3>& p) {
    const bool within = std::min({p[0], p[1], p[2]}) >= 0 && p[0] < wide && p[1] < deep && p[2] < tall;
    return within && full[size_t(p[0] + wide * (p[1] + deep * p[2]))];
  };
  Mesh mesh;
  for (int i = 0; i < wide * deep * tall; ++i) {
    const std::array<int, 3> cell{i % wide, i / wide % deep, i / wide / deep};
    for (size_t side = 0; side < 6 && at(cell); ++side) {
      const size_t axis = side / 2, b = (axis + 1) % 3, c = (axis + 2) % 3;
      const bool up = side % 2 != 0;
      std::array<int, 3> next = cell;
      next[axis] += up ? 1 : -1;
      if (at(next)) continue;
      add_wall(mesh, axis, float(cell[axis] + up), up, {float(cell[b]), float(cell[b] + 1)},
               {float(cell[c]), float(cell[c] + 1)}, random);
    }
  }
  return along_axes(std::move(mesh), true, random);
}

/// Each on top of the one below, so that walls lie in one plane, face to face, and overlap.
HostileMesh stacked_boxes(nif::Random& random) {
  Mesh mesh;
  WholeBox box = whole_box(random, 8);
  for (int count = between(random, 2, 6); count > 0; --count) {
    add_box(mesh, box, 0, 1, true, random);
    const int height = between(random, 1, 3);
    box.low[2] = box.high[2], box.high[2] += height;
    for (size_t a = 0; a < 2; ++a) {
      box.low[a] = between(random, box.low[a], box.high[a] - 1);
      box.high[a] = between(random, box.low[a] + 1, box.high[a]);
    }
  }
  return along_axes(std::move(mesh), true, random);
}

/// Corners on edges of others, exactly: closed, though edges are not shared. Nothing may leak there.
HostileMesh t_junctions(nif::Random& random) {
  Mesh mesh;
  add_box(mesh, whole_box(random, 8), 1, 3, false, random);
  return along_axes(std::move(mesh), true, random);
}

/// The same on edges in any direction: cuts triangles at an eighth of an edge, of which the neighbour does
/// not know. `slivers` close the seam: so many of 8.
HostileMesh cut_edges(nif::Random& random, uint32_t slivers) {
  Mesh whole_one = cube();
  if (random.below(2)) whole_one.triangles = {{0, 6, 3}, {0, 3, 5}, {0, 5, 6}, {3, 6, 5}};  // a tetrahedron
  for (Float3& p : whole_one.positions)
    for (float& x : p)
      x = 64 * (x * 3 + float(between(random, -1, 1)));  // its walls are bent: two triangles each
  weld_equal(whole_one);
  Mesh mesh = whole_one;
  for (int round = between(random, 1, 2); round > 0; --round)
    for (size_t i = 0, count = mesh.triangles.size(); i < count; ++i) {
      if (chance(random, 3)) continue;
      const size_t k = random.below(3);
      const mesh::Triangle t = mesh.triangles[i];
      const uint32_t a = t[k], b = t[(k + 1) % 3], c = t[(k + 2) % 3],
                     middle = uint32_t(mesh.positions.size());
      const float share = float(between(random, 1, 7)) / 8;  // two rounds are exact: 64 is 8 * 8
      Float3 p;
      for (size_t n = 0; n < 3; ++n)
        p[n] = mesh.positions[a][n] + (mesh.positions[b][n] - mesh.positions[a][n]) * share;
      mesh.positions.push_back(p);
      mesh.triangles[i] = {a, middle, c};
      mesh.triangles.push_back({middle, b, c});
      if (random.below(8) < slivers) mesh.triangles.push_back({a, b, middle});
    }
  return on_grid(std::move(mesh), true, random);
}
/// A corner on a slanted edge leaks no more than one on an edge along an axis.
HostileMesh slanted_t_junctions(nif::Random& random) { return cut_edges(random, 0); }
/// A sliver hides nothing itself, but counts where it closes a seam; it may not make holes.
HostileMesh t_junctions_with_slivers(nif::Random& random) { return cut_edges(random, 8); }
/// Some seams have slivers, others not.
HostileMesh t_junctions_with_some_slivers(nif::Random& random) { return cut_edges(random, 4); }

/// 3 to 20 leaves on one edge: it belongs to each, and has no two sides.
HostileMesh book(nif::Random& random) {
  Mesh mesh;
  const Float3 low{0, 0, 0}, high{0, 0, float(between(random, 1, 8))};
  for (int leaf = between(random, 3, 20); leaf > 0; --leaf) {
    const auto x = float(between(random, -8, 8)), tall = float(between(random, 1, 8)),
               y = random.below(2) ? tall : -tall;
    if (random.below(2))
      add_quad(mesh, {{low, {x, y, 0}, {x, y, high[2]}, high}}, random);
    else
      add_triangle(mesh, low, high, {x, y, float(between(random, -4, 12))});
  }
  return on_grid(std::move(mesh), false, random);
}

/// A parallelogram on a grid in the plane of two vectors.
void add_sheet(Mesh& mesh, const Double3& u, const Double3& v, nif::Random& random) {
  const double i = between(random, -4, 4), k = between(random, -4, 4), wide = between(random, 1, 5),
               tall = between(random, 1, 5);
  const auto at = [&](double x, double y) { return to_float(u * (i + x) + v * (k + y)); };
  add_quad(mesh, {{at(0, 0), at(wide, 0), at(wide, tall), at(0, tall)}}, random);
}
std::pair<Double3, Double3> plane_of_grid(nif::Random& random) {
  if (random.below(2)) return {{1, 0, 0}, {0, 1, 0}};
  for (;;) {
    const Double3 u = whole_vector(random, 3), v = whole_vector(random, 3), n = cross(u, v);
    if (dot(n, n) > 0) return {u, v};
  }
}

/// Sheets that overlap in one plane: hits at the same place, of which one counts.
HostileMesh coplanar_sheets(nif::Random& random) {
  Mesh mesh;
  const auto [u, v] = plane_of_grid(random);
  for (int count = between(random, 2, 12); count > 0; --count) add_sheet(mesh, u, v, random);
  return on_grid(std::move(mesh), false, random);
}

/// A sheet 2 to 5 times: an even number of crossings does not mean that nothing is there.
HostileMesh repeated_sheets(nif::Random& random) {
  Mesh mesh;
  const auto [u, v] = plane_of_grid(random);
  for (int count = between(random, 1, 4); count > 0; --count) add_sheet(mesh, u, v, random);
  repeat_triangles(mesh, between(random, 2, 5), random);
  return on_grid(std::move(mesh), false, random);
}

/// The same of closed ones: what is inside may not depend on how often the surface is there.
HostileMesh repeated_box(nif::Random& random) {
  Mesh mesh;
  add_box(mesh, whole_box(random), 0, 1, true, random);
  repeat_triangles(mesh, between(random, 2, 5), random);
  return along_axes(std::move(mesh), true, random);
}

/// Each triangle twice, one a side, and nothing between: there is no inside, but there are two sides.
HostileMesh thin_shell(nif::Random& random) {
  Mesh mesh;
  const int size = between(random, 1, 5);
  const bool flat = random.below(2) != 0;
  const auto at = [&](int x, int y) {
    const int bend = flat ? 0 : (x * x + 3 * y) % 5;
    return Float3{float(x), float(y), float(bend)};
  };
  for (int y = 0; y < size; ++y)
    for (int x = 0; x < size; ++x)
      add_quad(mesh, {{at(x, y), at(x + 1, y), at(x + 1, y + 1), at(x, y + 1)}}, random);
  const auto once = mesh.triangles;
  for (mesh::Triangle t : once) flip(t), mesh.triangles.push_back(t);
  return random.below(2) ? on_grid(std::move(mesh), false, random)
                         : maybe_rounded(std::move(mesh), false, random);
}

/// A box without one wall: what looks like an inside is none.
HostileMesh open_box(nif::Random& random) {
  Mesh mesh;
  add_box(mesh, whole_box(random), 0, 0, true, random);
  const auto wall = mesh.triangles.begin() + 2 * random.below(6);
  mesh.triangles.erase(wall, wall + between(random, 1, 2));
  return along_axes(std::move(mesh), false, random);
}

/// Boxes with a wall, an edge or a corner in common: inside of two things, and between them, is inside.
HostileMesh touching_boxes(nif::Random& random) {
  Mesh mesh;
  WholeBox box = whole_box(random);
  for (int count = between(random, 2, 4); count > 0; --count) {
    add_box(mesh, box, 0, 1, true, random);
    const uint32_t moved = 1 + random.below(7);  // one axis: a wall, two: an edge, three: a corner
    for (size_t a = 0; a < 3; ++a) {
      const int side = between(random, 1, 4);
      if (moved >> a & 1)
        box.low[a] = box.high[a], box.high[a] += side;
      else if (random.below(2))
        box.low[a] -= 1;
    }
  }
  return along_axes(std::move(mesh), true, random);
}

/// One in the other, from far apart to an ulp, facing either way.
HostileMesh nested_boxes(nif::Random& random) {
  Mesh mesh;
  float size = float(between(random, 1, 8));
  for (int count = between(random, 2, 5); count > 0; --count) {
    append(mesh, cube(), size, {0, 0, 0}, random.below(2) != 0);
    const uint32_t gap = random.below(3);
    size = gap == 0   ? ulps_beside(size, -between(random, 1, 4))
           : gap == 1 ? size * float(between(random, 4, 7)) / 8
                      : float(size * random.uniform(0.5, 1));
  }
  return {std::move(mesh), true};
}

/// Faces inwards: which way triangles face changes no answer.
HostileMesh inside_out(nif::Random& random) {
  Mesh mesh = random.below(2) ? cube() : icosphere(between(random, 0, 1));
  for (mesh::Triangle& t : mesh.triangles) flip(t);
  return maybe_rounded(std::move(mesh), true, random);
}

/// Has no two sides that could be told apart.
HostileMesh moebius_strip(nif::Random& random) {
  Mesh mesh;
  const int around = between(random, 5, 40);
  const double wide = random.uniform(0.1, 0.9);
  const auto at = [&](int i, double side) {
    const double turn = 2 * std::numbers::pi * (i % around) / around, half = turn / 2;
    const double out = (i == around ? -side : side) * wide, r = 1 + out * std::cos(half);
    return to_float(Double3{r * std::cos(turn), r * std::sin(turn), out * std::sin(half)});
  };
  for (int i = 0; i < around; ++i)
    add_quad(mesh, {{at(i, -1), at(i + 1, -1), at(i + 1, 1), at(i, 1)}}, random);
  return maybe_rounded(std::move(mesh), false, random);
}

/// Closed, without two sides, and passes through itself: its inside is where a line leaves it an odd number
/// of times.
HostileMesh klein_bottle(nif::Random& random) {
  Mesh mesh;
  const int around = between(random, 4, 8), across = between(random, 4, 9);
  const auto at = [&](int i, int k) {
    if (i == around) i = 0, k = across - k;
    const double u = 2 * std::numbers::pi * i / around, v = 2 * std::numbers::pi * (k % across) / across;
    const double s = std::sin(v), s2 = std::sin(2 * v), r = 2 + std::cos(u / 2) * s - std::sin(u / 2) * s2;
    return to_float(Double3{r * std::cos(u), r * std::sin(u), std::sin(u / 2) * s + std::cos(u / 2) * s2});
  };
  for (int i = 0; i < around; ++i)
    for (int k = 0; k < across; ++k)
      add_quad(mesh, {{at(i, k), at(i + 1, k), at(i + 1, k + 1), at(i, k + 1)}}, random);
  return maybe_rounded(std::move(mesh), true, random);
}

/// A smooth closed one with a hole through it: plain, so that the others have something to differ from.
HostileMesh ring(nif::Random& random) {
  const int around = between(random, 3, 10), across = between(random, 3, 7);
  return maybe_rounded(torus(around, across, 1, random.uniform(0.1, 0.7)), true, random);
}

HostileMesh ball(nif::Random& random) {
  return maybe_rounded(icosphere(between(random, 0, 1)), true, random);
}

/// Triangles that are very much longer than wide: rounding of a side is as large as the side.
HostileMesh needles(nif::Random& random) {
  Mesh mesh;
  const bool exact = random.below(2) != 0;
  for (int count = between(random, 3, 50); count > 0; --count) {
    const Double3 a = exact ? whole_vector(random, 8) : random.direction();
    const Double3 along = exact ? whole_vector(random, 8) : arrow(random, 0.3, 3);
    const double wide = exact ? power(random, -20, -3) : spread(random, 1e-6, 1e-1);
    const Double3 aside = (exact ? whole_vector(random, 1) : random.direction()) * wide;
    // The third corner at an end of the long sides, or between.
    const Double3 c = a + along * (random.below(2) ? 0.5 * random.below(3) : 0.5) + aside;
    add_triangle(mesh, to_float(a), to_float(a + along), to_float(c));
  }
  return {std::move(mesh), false};
}

/// A closed needle or leaf: its inside is thinner than cells and than rounding.
HostileMesh thin_box(nif::Random& random) {
  Mesh mesh;
  add_box(mesh, whole_box(random, 3), 1, 1, true, random);
  Double3 scale{1, 1, 1}, offset{};
  for (int count = between(random, 1, 2); count > 0; --count) scale[random.below(3)] = power(random, -20, -6);
  if (random.below(2)) offset = whole_vector(random, 8);
  stretch(mesh, scale, offset);
  return {std::move(mesh), edges_are_shared(mesh)};
}

/// Slivers around a corner on a grid, flat or folded: many triangles that a ray through the corner meets.
HostileMesh fan(nif::Random& random) {
  Mesh mesh;
  const int count = between(random, 3, 80), far = 1 << between(random, 3, 10), fold = between(random, 0, 2);
  const auto rim = [&](int i) {
    return Float3{float(far), float(i - count / 2), float(fold == 0 ? 0 : fold == 1 ? i % 2 : i * i % 7)};
  };
  for (int i = 0; i < count; ++i) {
    add_triangle(mesh, {0, 0, 0}, rim(i), rim(i + 1));
    if (chance(random, 16)) mesh.triangles.pop_back();
  }
  if (mesh.triangles.empty()) add_triangle(mesh, {0, 0, 0}, rim(0), rim(1));
  return on_grid(std::move(mesh), false, random);
}

/// Corners that belong together are an ulp apart: a gap is there, or an overlap, and no inside.
HostileMesh cracked_ball(nif::Random& random) {
  const HostileMesh whole_one = random.below(2) ? ball(random) : box_on_grid(random);
  Mesh mesh;
  for (const mesh::Triangle& t : whole_one.mesh.triangles)
    add_triangle(mesh, whole_one.mesh.positions[t[0]], whole_one.mesh.positions[t[1]],
                 whole_one.mesh.positions[t[2]]);
  for (Float3& p : mesh.positions)
    for (float& x : p)
      if (chance(random, 3)) x = ulps_beside(x, random.below(2) ? 1 : -1);
  return {std::move(mesh), false};
}

/// Triangles that have corners, edges and planes in common by chance, and pass through each other.
HostileMesh soup_on_grid(nif::Random& random) {
  Mesh mesh;
  const int most = between(random, 2, 8);
  const auto corner = [&] {
    return Float3{float(between(random, 0, most)), float(between(random, 0, most)),
                  float(between(random, 0, most))};
  };
  for (int count = between(random, 2, 120); count > 0;) {
    const Float3 a = corner(), b = corner(), c = corner();
    if (collinear(a, b, c) && random.below(8)) continue;
    add_triangle(mesh, a, b, c);
    if (!collinear(a, b, c)) --count;
  }
  return on_grid(std::move(mesh), false, random);
}

/// Triangles of all sizes anywhere: boxes of the tree overlap, and sort badly.
HostileMesh soup_anywhere(nif::Random& random) {
  Mesh mesh;
  for (int count = between(random, 2, 120); count > 0; --count) {
    const Double3 at{random.uniform(), random.uniform(), random.uniform()};
    const double size = spread(random, 0.003, 1);
    const auto corner = [&] { return to_float(at + random.direction() * size); };
    const Float3 a = corner(), b = corner();
    add_triangle(mesh, a, b, corner());
  }
  return {std::move(mesh), false};
}

/// The smallest tree. Its box may be flat.
HostileMesh one_triangle(nif::Random& random) {
  HostileMesh one;
  do {
    one.mesh = {};
    Float3 at[3];
    for (Float3& p : at) p = to_float(random.below(2) ? whole_vector(random, 8) : arrow(random, 0.1, 4));
    add_triangle(one.mesh, at[0], at[1], at[2]);
  } while (count_wide(one.mesh) == 0);
  return one;
}

/// A flat box, and planes of cells in it.
HostileMesh one_quad(nif::Random& random) {
  Mesh mesh;
  const WholeBox box = whole_box(random);
  const size_t axis = random.below(3);
  const bool up = random.below(2) != 0;
  const std::array<Cuts, 2> cuts{cuts_between(random, box.low[0], box.high[0], 0),
                                 cuts_between(random, box.low[1], box.high[1], 0)};
  add_wall(mesh, axis, float(box.low[2]), up, cuts[0], cuts[1], random);
  return along_axes(std::move(mesh), false, random);
}

/// A box, and some a million times smaller on its corners, edges and walls: bounds of the large one's errors
/// are too coarse for the small ones.
HostileMesh large_and_small(nif::Random& random) {
  Mesh mesh;
  const WholeBox box = whole_box(random);
  add_box(mesh, box, 0, 0, true, random);
  for (int count = between(random, 1, 6); count > 0; --count) {
    Float3 at;
    for (size_t a = 0; a < 3; ++a)
      at[a] = float(random.below(2) ? box.low[a] : between(random, box.low[a], box.high[a]));
    Mesh small = cube();
    if (random.below(2)) small.triangles = {{0, 6, 3}, {0, 3, 5}, {0, 5, 6}, {3, 6, 5}};
    append(mesh, small, float(power(random, -20, -16)), at);
  }
  return on_grid(std::move(mesh), true, random);
}

constexpr MeshGenerator kPlainMeshes[] = {
    {"box on a grid", box_on_grid},
    {"stairs", stairs},
    {"stacked boxes", stacked_boxes},
    {"T-junctions", t_junctions},
    {"slanted T-junctions", slanted_t_junctions},
    {"T-junctions with slivers", t_junctions_with_slivers},
    {"T-junctions with some slivers", t_junctions_with_some_slivers},
    {"book", book},
    {"coplanar sheets", coplanar_sheets},
    {"repeated sheets", repeated_sheets},
    {"repeated box", repeated_box},
    {"thin shell", thin_shell},
    {"open box", open_box},
    {"touching boxes", touching_boxes},
    {"nested boxes", nested_boxes},
    {"inside out", inside_out},
    {"Moebius strip", moebius_strip},
    {"Klein bottle", klein_bottle},
    {"ring", ring},
    {"ball", ball},
    {"needles", needles},
    {"thin box", thin_box},
    {"fan", fan},
    {"cracked ball", cracked_ball},
    {"soup on a grid", soup_on_grid},
    {"soup anywhere", soup_anywhere},
    {"one triangle", one_triangle},
    {"one quad", one_quad},
    {"large and small", large_and_small},
};
HostileMesh any_plain_mesh(nif::Random& random) {
  return kPlainMeshes[random.below(uint32_t(std::size(kPlainMeshes)))].make(random);
}

/// Changes positions of any mesh, and rounds. It stays closed where its edges are shared, or where nothing
/// was rounded. Where rounding left nothing with an area, `change` is asked again.
template <class Change>
HostileMesh changed(nif::Random& random, Change change) {
  for (;;) {
    HostileMesh out = any_plain_mesh(random);
    bool exact = true;
    const auto move = change();
    for (Float3& p : out.mesh.positions) {
      const Double3 moved = move(to_double(p));
      p = to_float(moved);
      exact = exact && to_double(p) == moved;
    }
    const size_t wide = count_wide(out.mesh);
    out.closed = out.closed && (exact || (wide == out.mesh.triangles.size() && edges_are_shared(out.mesh)));
    if (wide > 0) return out;
  }
}

/// Up to 10^7 away from where its space begins: coordinates are coarse, and the extent is far larger than the
/// object.
HostileMesh moved_far(nif::Random& random) {
  return changed(random, [&] {
    Double3 offset;
    for (double& x : offset) {
      x = spread(random, 1, 1e7);
      x *= sign(random);
    }
    if (random.below(2))
      for (double& x : offset) x = std::round(x);
    return [offset](const Double3& p) { return p + offset; };
  });
}

/// Times a power of two. Nothing is rounded, but products of two or of three coordinates come to the ends of
/// floats; once in 16, coordinates themselves are too small for all their bits.
HostileMesh scaled(nif::Random& random) {
  return changed(random, [&] {
    constexpr int kRanges[][2] = {{-100, 40}, {-72, -55}, {-55, -38}, {36, 46}};
    const auto& range = kRanges[random.below(4)];
    const double scale = chance(random, 16) ? power(random, -126, -100) : power(random, range[0], range[1]);
    return [scale](const Double3& p) { return p * scale; };
  });
}

/// About as large as what can be baked, so that t may be as large as a float is before a ray is there.
HostileMesh large(nif::Random& random) {
  return changed(random, [&] {
    const double scale = power(random, 42, 46);
    return [scale](const Double3& p) { return p * scale; };
  });
}

/// Turned and rounded: what was exact is so no more, and walls are nearly in planes.
HostileMesh rotated(nif::Random& random) {
  return changed(random, [&] {
    const auto rows = random_rotation(random);
    return [rows](const Double3& p) { return mesh::product(rows, p); };
  });
}

// ---- Parts of rays ----------------------------------------------------------------------------------------

/// The corners of one triangle, beginning with any.
std::array<Double3, 3> any_triangle(const Mesh& mesh, nif::Random& random) {
  const mesh::Triangle& t = mesh.triangles[random.below(uint32_t(mesh.triangles.size()))];
  const size_t first = random.below(3);
  std::array<Double3, 3> corners;
  for (size_t i = 0; i < 3; ++i) corners[i] = to_double(mesh.positions[t[(first + i) % 3]]);
  return corners;
}
Double3 any_corner(const Mesh& mesh, nif::Random& random) { return any_triangle(mesh, random)[0]; }

/// At an eighth of an edge, or anywhere on it.
Double3 any_edge_point(const Mesh& mesh, nif::Random& random) {
  const auto [a, b, c] = any_triangle(mesh, random);
  return a + (b - a) * (random.below(2) ? between(random, 1, 7) / 8.0 : random.uniform());
}
Double3 any_inner_point(const Mesh& mesh, nif::Random& random) {
  const auto [a, b, c] = any_triangle(mesh, random);
  const int i = between(random, 1, 6), k = between(random, 1, 7 - i);
  if (random.below(2)) return a + (b - a) * (i / 8.0) + (c - a) * (k / 8.0);
  const double u = random.uniform(), v = random.uniform() * (1 - u);
  return a + (b - a) * u + (c - a) * v;
}
Double3 any_point(const Mesh& mesh, nif::Random& random) {
  const uint32_t kind = random.below(3);
  return kind == 0   ? any_corner(mesh, random)
         : kind == 1 ? any_edge_point(mesh, random)
                     : any_inner_point(mesh, random);
}

/// The largest coordinate of a box, and its longest side; not 0.
double extent_of(const mesh::Box& box) {
  double extent = std::numeric_limits<float>::denorm_min();
  for (size_t a = 0; a < 3; ++a)
    extent = std::max({extent, std::abs(double(box.min[a])), std::abs(double(box.max[a]))});
  return extent;
}
double size_of(const mesh::Box& box) {
  double size = std::numeric_limits<float>::denorm_min();
  for (size_t a = 0; a < 3; ++a) size = std::max(size, double(box.max[a]) - box.min[a]);
  return size;
}
Double3 point_in(const mesh::Box& box, nif::Random& random, double margin = 0) {
  Double3 point;
  for (size_t a = 0; a < 3; ++a) {
    const double side = double(box.max[a]) - box.min[a];
    point[a] = box.min[a] + side * random.uniform(-margin, 1 + margin);
  }
  return point;
}
/// A power of two, from the size of the box to 1/32 of it.
double step_of(const mesh::Box& box, nif::Random& random) {
  return std::ldexp(1, std::ilogb(size_of(box)) - between(random, 0, 5));
}

/// Of few bits, or of many.
Double3 any_way(const mesh::Box& box, nif::Random& random) {
  const double step = step_of(box, random);
  if (random.below(4)) return whole_vector(random, 8) * step;
  return random.direction() * size_of(box);
}

/// Passes a point at t = `back`, coming from `way` times that. Exactly so where the origin's coordinates have
/// 24 bits, else to rounding.
NifRay pass(const Double3& point, const Double3& way, double back) {
  NifRay ray{{}, 0, {}, kInfinity};
  for (size_t a = 0; a < 3; ++a) {
    ray.origin[a] = float(point[a] - way[a] * back);
    ray.direction[a] = float((point[a] - double(ray.origin[a])) / back);
  }
  return ray;
}
double any_back(nif::Random& random) {
  return random.below(2) ? between(random, 1, 16) : power(random, 0, 6);
}
NifRay pass_any_way(const Double3& point, const mesh::Box& box, nif::Random& random) {
  const Double3 way = any_way(box, random);
  return pass(point, way, any_back(random));
}

void set_origin(NifRay& ray, const Double3& point) {
  for (size_t a = 0; a < 3; ++a) ray.origin[a] = float(point[a]);
}
void set_direction(NifRay& ray, const Double3& way) {
  for (size_t a = 0; a < 3; ++a) ray.direction[a] = float(way[a]);
}

/// The same points: the direction times a power of two.
void lengthen(NifRay& ray, int by) {
  for (float& x : ray.direction) x = std::ldexp(x, by);
  ray.tmin = std::ldexp(ray.tmin, -by);
  ray.tmax = std::ldexp(ray.tmax, -by);
}

/// A direction that is out of what is valid is mostly brought back; and in a third of all it gets any length,
/// in a few one that makes t as large or as small as it can be.
void finish(NifRay& ray, nif::Random& random) {
  double steep = 0;
  for (const float x : ray.direction) steep = std::max(steep, std::abs(double(x)));
  if (steep == 0) return set_direction(ray, random.direction());
  if (std::abs(std::ilogb(steep)) > 40 && random.below(8)) lengthen(ray, -std::ilogb(steep));
  if (chance(random, 3)) lengthen(ray, between(random, -20, 20));
  if (chance(random, 24)) {
    steep = 0;
    for (const float x : ray.direction) steep = std::max(steep, std::abs(double(x)));
    lengthen(ray, (random.below(2) ? 59 : -59) - std::ilogb(steep));
  }
}

// ---- Rays -------------------------------------------------------------------------------------------------

/// All triangles around a corner have it: one of them must be met.
NifRay through_corner(const Mesh& mesh, const mesh::Box& box, nif::Random& random) {
  return pass_any_way(any_corner(mesh, random), box, random);
}

/// Both triangles have it.
NifRay through_edge(const Mesh& mesh, const mesh::Box& box, nif::Random& random) {
  return pass_any_way(any_edge_point(mesh, random), box, random);
}

/// A triangle seen edge-on does not count, its neighbours do; nearly edge-on, its depth is noise.
NifRay in_plane(const Mesh& mesh, const mesh::Box&, nif::Random& random) {
  const auto [a, b, c] = any_triangle(mesh, random);
  const Double3 u = b - a, v = c - a, shares = whole_vector(random, 4);
  const Double3 way = u * shares[0] + v * shares[1];
  const double i = between(random, 0, 8), k = between(random, 0, 8);
  const Double3 at = a + u * (i / 8) + v * (k / 8);
  NifRay ray = pass(at, way * 0.25, between(random, 1, 8));
  if (chance(random, 3)) {
    float& x = (random.below(2) ? ray.origin : ray.direction)[random.below(3)];
    x = ulps_beside(x, random.below(2) ? 1 : -1);
  }
  if (chance(random, 4)) ray.tmax = float(between(random, 0, 16));
  return ray;
}

/// All of the edge is met, or nothing of it, and each end by others.
NifRay along_edge(const Mesh& mesh, const mesh::Box&, nif::Random& random) {
  const auto [a, b, c] = any_triangle(mesh, random);
  NifRay ray = pass(a, b - a, between(random, 0, 1) ? between(random, 1, 8) : power(random, -3, 0));
  if (chance(random, 4)) ray.tmax = float(power(random, -3, 4));
  return ray;
}

/// Along an axis, through coordinates of corners: of one, or of several, which is where grid planes cross.
NifRay along_axis(const Mesh& mesh, const mesh::Box& box, nif::Random& random) {
  Double3 at = any_corner(mesh, random), way{};
  if (random.below(2))
    for (size_t a = 0; a < 3; ++a) at[a] = any_corner(mesh, random)[a];
  else if (random.below(2))
    at = any_point(mesh, random);
  const double step = step_of(box, random);
  way[random.below(3)] = sign(random) * step;
  return pass(at, way, random.below(4) ? any_back(random) * 4 : 0.25);
}

/// One or two components are zeros, of either sign: slopes and slabs divide by them.
NifRay with_zeros(const Mesh& mesh, const mesh::Box& box, nif::Random& random) {
  Double3 way = any_way(box, random);
  const uint32_t zeros = 1 + random.below(6);
  for (size_t a = 0; a < 3; ++a)
    if (zeros >> a & 1) way[a] = 0;
  const double back = any_back(random);
  const Double3 at = any_point(mesh, random);
  NifRay ray = pass(at, way, back);
  for (size_t a = 0; a < 3; ++a)
    if (zeros >> a & 1) ray.direction[a] = random.below(2) ? 0.f : -0.f;  // also where its point was rounded
  return ray;
}

/// Nearly zeros, of either sign: they may count as zero only where that changes nothing.
NifRay with_near_zeros(const Mesh& mesh, const mesh::Box& box, nif::Random& random) {
  NifRay ray = with_zeros(mesh, box, random);
  finish(ray, random);
  constexpr int kLimits[] = {-149, -127, -126, -125, -61,
                             -60,  -41,  -40,  -39};  // of formats, and of the product
  for (float& x : ray.direction) {
    if (x != 0) continue;
    const int size = random.below(3) ? between(random, -149, -20) : kLimits[random.below(std::size(kLimits))];
    const double above = random.below(2) ? 1 : random.uniform(1, 2);
    x = float(std::ldexp(above * sign(random), size));
  }
  return ray;
}

/// Ends exactly on a triangle, or begins there, or an ulp before or behind. The ends belong to the segment.
NifRay ends_on_triangle(const Mesh& mesh, const mesh::Box& box, nif::Random& random) {
  const Double3 way = any_way(box, random);
  const double back = any_back(random);
  const Double3 at = any_point(mesh, random);
  NifRay ray = pass(at, way, back);
  const float end = ulps_beside(float(back), between(random, -1, 1));
  if (random.below(2))
    ray.tmax = end;
  else
    ray.tmin = end;
  if (chance(random, 8)) ray.tmin = ray.tmax = end;
  return ray;
}

/// Starts exactly on a triangle: that is met, whatever the direction.
NifRay starts_on_triangle(const Mesh& mesh, const mesh::Box& box, nif::Random& random) {
  NifRay ray{{}, 0, {}, kInfinity};
  const auto [a, b, c] = any_triangle(mesh, random);
  const uint32_t place = random.below(3);
  const double i = between(random, 1, 6), k = place == 0   ? 0
                                              : place == 1 ? 8 - i
                                                           : between(random, 1, int(7 - i));
  set_origin(ray, place == 0 ? a : a + (b - a) * (i / 8) + (c - a) * (k / 8));
  const Double3 normal = cross((b - a) * (1 / size_of(box)), (c - a) * (1 / size_of(box)));
  const uint32_t kind = random.below(4);
  set_direction(ray, kind == 0   ? normal * sign(random)
                     : kind == 1 ? any_point(mesh, random) - (place == 0 ? a : b)
                                 : any_way(box, random));
  if (chance(random, 4)) ray.tmax = chance(random, 2) ? 0.f : float(power(random, -20, 2));
  return ray;
}

/// The same, some ulps off, as rays start that leave a hit.
NifRay starts_near_triangle(const Mesh& mesh, const mesh::Box& box, nif::Random& random) {
  NifRay ray = starts_on_triangle(mesh, box, random);
  for (float& x : ray.origin)
    if (random.below(2)) x = ulps_beside(x, between(random, -4, 4));
  return ray;
}

/// Lines and half-lines in both directions: what lies behind the origin counts, too.
NifRay from_behind(const Mesh& mesh, const mesh::Box& box, nif::Random& random) {
  const Double3 way = any_way(box, random);
  const double back = random.below(4) ? -any_back(random) : any_back(random);
  const Double3 at = any_point(mesh, random);
  NifRay ray = pass(at, way, back);
  const uint32_t kind = random.below(6);
  const auto near = ulps_beside(float(back), between(random, -1, 1));
  ray.tmin = kind < 3 ? -kInfinity : kind == 3 ? near : float(back * random.uniform(0, 2));
  ray.tmax = kind == 0 ? kInfinity : kind == 1 ? near : kind == 2 ? -0.f : std::max(0.f, ray.tmin);
  if (ray.tmin > ray.tmax) std::swap(ray.tmin, ray.tmax);
  return ray;
}

/// From one corner to another, as visibility of vertices is asked: both ends are met.
NifRay corner_to_corner(const Mesh& mesh, const mesh::Box&, nif::Random& random) {
  const Double3 from = any_corner(mesh, random), to = any_point(mesh, random);
  NifRay ray{{}, 0, {}, 1};
  set_origin(ray, from);
  set_direction(ray, (random.below(2) ? any_corner(mesh, random) : to) - from);
  if (chance(random, 4)) ray.tmin = ulps_beside(0, 1), ray.tmax = ulps_beside(1, -1);
  return ray;
}

/// Rounding grows with the distance: the ray is moved along itself, and must meet the same triangles.
NifRay from_far(const Mesh& mesh, const mesh::Box& box, nif::Random& random) {
  constexpr double kTimes[] = {64, 256, 4096, 16384};
  const double times = random.below(2) ? kTimes[random.below(4)] : power(random, 10, 21);
  const double extent = std::ldexp(1, std::ilogb(extent_of(box)));
  Double3 way = random.below(2) ? whole_vector(random, 3) * 0.5 : random.direction();
  if (chance(random, 4)) way = whole_vector(random, 1);
  NifRay ray = pass(any_point(mesh, random), way * extent, times);
  if (chance(random, 6)) ray.tmax = ulps_beside(float(times), between(random, -2, 2));
  return ray;
}

/// Of an object that is far from where its space begins: what a transform rounds of such a ray's direction
/// grows on the way.
NifRay from_origin_of_space(const Mesh& mesh, const mesh::Box& box, nif::Random& random) {
  NifRay ray{{}, 0, {}, kInfinity};
  if (random.below(2)) set_origin(ray, arrow(random, 0.1, 10) * size_of(box));
  const Double3 target = random.below(2) ? any_edge_point(mesh, random) : any_inner_point(mesh, random);
  set_direction(ray, target - to_double(std::to_array(ray.origin)));
  return ray;
}

/// It meets something at about the last t that is a float, or the first one, from as far away as an answer
/// may be certain, if the mesh is large.
NifRay at_last_t(const Mesh& mesh, const mesh::Box& box, nif::Random& random) {
  const double last = double(std::numeric_limits<float>::max()), side = sign(random);
  const double length = extent_of(box) * power(random, 17, 19) * random.uniform(1, 2) / last;
  NifRay ray{{}, 0, {}, 0};
  set_direction(ray, random.direction() * std::clamp(length, 0x1p-59, 0x1p-57));
  const Double3 target = any_point(mesh, random);
  const double t = side * last * (1 - random.uniform(0, 0x1p-22));
  for (size_t a = 0; a < 3; ++a) ray.origin[a] = float(target[a] - double(ray.direction[a]) * t);
  (side > 0 ? ray.tmax : ray.tmin) = float(side * last);
  return ray;
}

/// At the distances from which answers are computed in another way, no more called certain, or no more given,
/// and an ulp before and behind. (A BVH's extent is up to twice that of the box.)
NifRay from_limit(const Mesh& mesh, const mesh::Box& box, nif::Random& random) {
  constexpr int kLimits[] = {6, 6, 20, 20, 14, 24, 32};
  const double extent = extent_of(box) * (random.below(4) ? 1 : random.uniform(1, 2));
  const double limit = std::ldexp(extent, kLimits[random.below(std::size(kLimits))]);
  const float far = ulps_beside(float(limit), between(random, -2, 2));
  const size_t axis = random.below(3);
  const Double3 target = any_point(mesh, random);
  Double3 from = target;  // along an axis
  if (random.below(2))
    for (double& x : from) x = limit * random.uniform(-1, 1) * (1 - 0x1p-20);
  from[axis] = far * sign(random);
  NifRay ray{{}, 0, {}, kInfinity};
  set_origin(ray, from);
  set_direction(ray, target - to_double(std::to_array(ray.origin)));
  if (chance(random, 4)) ray.tmax = ulps_beside(1, between(random, -2, 2));
  return ray;
}

/// In a plane of the box, or between its cells: such a ray is in the cells of both sides, or in neither.
NifRay in_plane_of_box(const Mesh& mesh, const mesh::Box& box, nif::Random& random, int most) {
  Double3 at = random.below(2) ? any_point(mesh, random) : point_in(box, random), way = any_way(box, random);
  const uint32_t axes = 1 + random.below(6);
  for (size_t a = 0; a < 3; ++a) {
    if (!(axes >> a & 1)) continue;
    const double side = double(box.max[a]) - box.min[a];
    const int parts = 1 << between(random, 0, most);
    at[a] = float(box.min[a] + side * (between(random, 0, parts) / double(parts)));
    way[a] = 0;
  }
  NifRay ray = pass(at, way, any_back(random));
  if (chance(random, 4)) {
    float& x = ray.origin[random.below(3)];
    x = ulps_beside(x, random.below(2) ? 1 : -1);
  }
  return ray;
}
/// Walls of boxes that a ray runs along: 0 times infinity.
NifRay in_side_of_box(const Mesh& mesh, const mesh::Box& box, nif::Random& random) {
  return in_plane_of_box(mesh, box, random, 0);
}
/// Planes between voxels and cells.
NifRay in_plane_of_voxels(const Mesh& mesh, const mesh::Box& box, nif::Random& random) {
  return in_plane_of_box(mesh, box, random, 7);
}

/// Touches the box at an edge or a corner: no box may be passed by that has what is met there.
NifRay grazing(const Mesh&, const mesh::Box& box, nif::Random& random) {
  Double3 at = point_in(box, random);
  const size_t free_axis = random.below(4);  // 3: a corner
  for (size_t a = 0; a < 3; ++a)
    if (a != free_axis) at[a] = (random.below(2) ? box.max : box.min)[a];
  NifRay ray = pass_any_way(at, box, random);
  if (chance(random, 3)) {
    float& x = ray.origin[random.below(3)];
    x = ulps_beside(x, random.below(2) ? 1 : -1);
  }
  return ray;
}

/// What rays are like mostly.
NifRay chord(const Mesh&, const mesh::Box& box, nif::Random& random) {
  NifRay ray{{}, 0, {}, kInfinity};
  const Double3 from = point_in(box, random, 1);
  set_origin(ray, from);
  set_direction(ray, point_in(box, random) - from);
  if (chance(random, 3)) ray.tmax = float(random.uniform(0, 2));
  if (chance(random, 4)) ray.tmin = float(random.uniform() * std::min(ray.tmax, 1.f));
  return ray;
}

/// Starts within the box, so often within the surface: it may not get out.
NifRay from_inside(const Mesh& mesh, const mesh::Box& box, nif::Random& random) {
  NifRay ray = pass_any_way(any_point(mesh, random), box, random);
  set_origin(ray, point_in(box, random));
  return ray;
}

/// From the middle, where it is inside of most that are closed, out through corners and edges: where leaks
/// are.
NifRay from_middle(const Mesh& mesh, const mesh::Box& box, nif::Random& random) {
  NifRay ray{{}, 0, {}, kInfinity};
  Double3 middle;
  for (size_t a = 0; a < 3; ++a) middle[a] = (double(box.min[a]) + box.max[a]) / 2;
  if (chance(random, 3)) middle = middle * 0.75 + any_corner(mesh, random) * 0.25;
  set_origin(ray, middle);
  const Double3 target = random.below(2) ? any_corner(mesh, random) : any_edge_point(mesh, random);
  set_direction(ray, target - to_double(std::to_array(ray.origin)));
  return ray;
}

/// Misses an edge or a corner by little, and so meets one triangle or the other, or none.
NifRay past_edge(const Mesh& mesh, const mesh::Box& box, nif::Random& random) {
  const auto [a, b, c] = any_triangle(mesh, random);
  const Double3 at = a + (b - a) * (chance(random, 4) ? 0 : random.uniform());
  const Double3 aside = arrow(random, 1e-7, 1e-3) * extent_of(box);
  return pass_any_way(at + aside, box, random);
}

/// Not a ray, or hardly: visible, and certain only where it has no points. And what is just valid.
NifRay invalid(const Mesh& mesh, const mesh::Box& box, nif::Random& random) {
  NifRay ray = pass_any_way(any_point(mesh, random), box, random);
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  const size_t a = random.below(3);
  const float infinite = random.below(2) ? kInfinity : -kInfinity;
  const auto set_steep = [&](double steep) {
    for (float& x : ray.direction) x = float(random.uniform(-1, 1) * steep);
    ray.direction[a] = float(steep * sign(random));
  };
  switch (random.below(12)) {
    case 0:
      ray.origin[a] = random.below(2) ? kNan : infinite;
      break;
    case 1:
      ray.direction[a] = random.below(2) ? kNan : infinite;
      break;
    case 2:
      (random.below(2) ? ray.tmin : ray.tmax) = kNan;
      break;
    case 3:
      set_direction(ray, {});
      break;
    case 4:
      ray.tmin = float(any_back(random)), ray.tmax = ulps_beside(ray.tmin, -between(random, 1, 3));
      break;
    case 5:
      ray.tmin = kInfinity, ray.tmax = random.below(2) ? -kInfinity : kInfinity;
      break;
    case 6:
      ray.tmin = -kInfinity, ray.tmax = -kInfinity;
      break;
    case 7:
      set_steep(std::ldexp(1, random.below(2) ? -61 : 61));
      break;
    case 8:
      set_steep(std::ldexp(1, random.below(2) ? -60 : 60));
      break;
    case 9: {
      const float limit = random.below(2) ? 0x1p-60f : 0x1p60f;
      set_steep(ulps_beside(limit, between(random, -1, 1)));
    } break;
    case 10:
      set_steep(power(random, -149, -120));
      break;
    default:  // as large as floats are, or as small
      for (float& x : ray.origin) {
        x = random.below(2) ? 1.f : -1.f;
        x *= float(spread(random, 0x1p-149, random.below(2) ? 0x1p-120 : 0x1p127));
      }
      break;
  }
  return ray;
}

/// As drawn, or the same points by a direction of another length.
template <NifRay (*draw)(const Mesh&, const mesh::Box&, nif::Random&)>
NifRay of_any_length(const Mesh& mesh, const mesh::Box& box, nif::Random& random) {
  NifRay ray = draw(mesh, box, random);
  finish(ray, random);
  return ray;
}

constexpr RayGenerator kRays[] = {
    {"through a corner", of_any_length<through_corner>},
    {"through an edge", of_any_length<through_edge>},
    {"in a triangle's plane", of_any_length<in_plane>},
    {"along an edge", of_any_length<along_edge>},
    {"along an axis", of_any_length<along_axis>},
    {"with zeros", of_any_length<with_zeros>},
    {"with near zeros", with_near_zeros},
    {"ends on a triangle", of_any_length<ends_on_triangle>},
    {"starts on a triangle", of_any_length<starts_on_triangle>},
    {"starts near a triangle", of_any_length<starts_near_triangle>},
    {"from behind", of_any_length<from_behind>},
    {"corner to corner", of_any_length<corner_to_corner>},
    {"from far", of_any_length<from_far>},
    {"from the origin of space", of_any_length<from_origin_of_space>},
    {"from a limit", of_any_length<from_limit>},
    {"in a side of the box", of_any_length<in_side_of_box>},
    {"in a plane of voxels", of_any_length<in_plane_of_voxels>},
    {"grazing", of_any_length<grazing>},
    {"chord", of_any_length<chord>},
    {"from inside", of_any_length<from_inside>},
    {"from the middle", of_any_length<from_middle>},
    {"past an edge", of_any_length<past_edge>},
    {"at the last t", at_last_t},
    {"invalid", invalid},
};

// ---- Transforms -------------------------------------------------------------------------------------------

Transform transform_of(const std::array<Double3, 3>& rows, const Double3& translation = {}) {
  Transform t;
  for (size_t r = 0; r < 3; ++r) {
    for (size_t c = 0; c < 3; ++c) t[4 * r + c] = float(rows[r][c]);
    t[4 * r + 3] = float(translation[r]);
  }
  return t;
}
std::array<Double3, 3> diagonal(double x, double y, double z) {
  return {Double3{x, 0, 0}, Double3{0, y, 0}, Double3{0, 0, z}};
}
Double3 any_translation(const mesh::Box& box, nif::Random& random) {
  return random.below(2) ? Double3{} : arrow(random, 0.1, 10) * size_of(box);
}

/// Leaves rays as they are, to the bit.
Transform identity(const mesh::Box&, nif::Random&) { return mesh::kIdentity; }

/// Often exact.
Transform translation(const mesh::Box& box, nif::Random& random) {
  const double step = random.below(2) ? 1 : step_of(box, random);
  return transform_of(diagonal(1, 1, 1), whole_vector(random, 16) * step);
}

/// So far that rounding the origin moves a ray by more than what may be called certain.
Transform large_translation(const mesh::Box& box, nif::Random& random) {
  return transform_of(diagonal(1, 1, 1), arrow(random, 1e3, 1e6) * extent_of(box));
}

/// Rounded: it moves rays by little.
Transform rotation(const mesh::Box& box, nif::Random& random) {
  const auto rows = random_rotation(random);
  return transform_of(rows, any_translation(box, random));
}

/// Swaps axes, and mirrors some: exact.
Transform quarter_turn(const mesh::Box&, nif::Random& random) {
  std::array<Double3, 3> rows{};
  const size_t first = random.below(3), step = 1 + random.below(2);
  for (size_t r = 0; r < 3; ++r) rows[r][(first + step * r) % 3] = sign(random);
  return transform_of(rows);
}

/// Turns triangles around: what is inside stays so.
Transform mirror(const mesh::Box& box, nif::Random& random) {
  const Double3 n = random.direction();
  std::array<Double3, 3> rows = diagonal(1, 1, 1);
  for (size_t r = 0; r < 3; ++r) rows[r] = rows[r] - n * (2 * n[r]);
  if (random.below(2)) {
    const double x = sign(random), y = sign(random);
    rows = diagonal(x, y, -1);
  }
  return transform_of(rows, any_translation(box, random));
}

Transform uniform_scale(const mesh::Box& box, nif::Random& random) {
  const double scale = random.below(2) ? spread(random, 1e-3, 1e3) : power(random, -10, 10);
  return transform_of(diagonal(scale, scale, scale), any_translation(box, random));
}

/// Directions turn: what was long may become short.
Transform uneven_scale(const mesh::Box& box, nif::Random& random) {
  const double most = random.below(2) ? 4 : 100;
  const auto scale = [&] {
    const double size = spread(random, 1 / most, most);
    return size * sign(random);
  };
  const double x = scale(), y = scale(), z = scale();
  return transform_of(diagonal(x, y, z), any_translation(box, random));
}

/// Up to the condition number of 3 * 4096 at which answers are no more certain, close to it, and beyond. That
/// of a shear by s is s * s + 3.
Transform shear(const mesh::Box& box, nif::Random& random) {
  constexpr double kLimit = 110.837;
  const uint32_t kind = random.below(4);
  const double by = kind == 0   ? kLimit + arrow(random, 1e-4, 1)[0]
                    : kind == 1 ? kLimit * random.uniform(1, 1.1)
                                : spread(random, 0.01, kLimit);
  std::array<Double3, 3> rows = diagonal(1, 1, 1);
  const size_t row = random.below(3);
  rows[row][(row + 1 + random.below(2)) % 3] = by * sign(random);
  if (random.below(2)) {  // turned, which changes no condition number
    const auto turn = random_rotation(random);
    std::array<Double3, 3> turned{};
    for (size_t r = 0; r < 3; ++r)
      for (size_t k = 0; k < 3; ++k) turned[r] = turned[r] + rows[k] * turn[r][k];
    rows = turned;
  }
  return transform_of(rows, any_translation(box, random));
}

/// Lengths of directions in object space come close to the ends of what is valid.
Transform extreme_scale(const mesh::Box& box, nif::Random& random) {
  const double scale = chance(random, 3) ? power(random, -40, 30) : random.below(2) ? 0x1p-40 : 0x1p30;
  return transform_of(diagonal(scale, scale, scale), any_translation(box, random) * scale);
}

/// One after the other, as hierarchies of scenes make them.
Transform combined(const mesh::Box& box, nif::Random& random) {
  constexpr Transform (*kParts[])(const mesh::Box&, nif::Random&) = {
      translation, rotation, quarter_turn, mirror, uniform_scale, uneven_scale, shear, large_translation};
  for (;;) {
    Transform t = mesh::kIdentity;
    for (int count = between(random, 2, 3); count > 0; --count) {
      const size_t part = random.below(chance(random, 4) ? 8 : 6);  // most stay certain
      t = mesh::compose(kParts[part](box, random), t);
    }
    if (!mesh::flattens(t)) return t;
  }
}

constexpr TransformGenerator kTransforms[] = {
    {"identity", identity},
    {"translation", translation},
    {"large translation", large_translation},
    {"rotation", rotation},
    {"quarter turn", quarter_turn},
    {"mirror", mirror},
    {"uniform scale", uniform_scale},
    {"uneven scale", uneven_scale},
    {"shear", shear},
    {"extreme scale", extreme_scale},
    {"combined", combined},
};

}  // namespace

std::span<const MeshGenerator> mesh_generators() {
  static const std::vector<MeshGenerator> all = [] {
    std::vector<MeshGenerator> meshes(std::begin(kPlainMeshes), std::end(kPlainMeshes));
    meshes.insert(meshes.end(),
                  {{"moved far", moved_far}, {"scaled", scaled}, {"large", large}, {"rotated", rotated}});
    return meshes;
  }();
  return all;
}

std::span<const RayGenerator> ray_generators() { return kRays; }
std::span<const TransformGenerator> transform_generators() { return kTransforms; }

}  // namespace nif::test
