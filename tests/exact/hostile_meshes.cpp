// Meshes that are as hard to answer as we know how to make them. Each says what it attacks.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "formats/mesh/transform.hpp"
#include "tests/exact/mesh_parts.hpp"
#include "tests/support/test_shapes.hpp"

namespace nif::test {
namespace {

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

}  // namespace nif::test
