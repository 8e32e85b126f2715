// Polygons become triangles that cover them and nothing else, whatever their form and their first corner.
// Checked on grids of integers, in arithmetic of its own.
#include "formats/mesh/polygon.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <set>

#include "formats/base/status.hpp"
#include "formats/mesh/read.hpp"
#include "tests/support/polygons.hpp"

namespace nif::test {
namespace {

using mesh::Float3;
using mesh::NoteKind;
using mesh::Scene;
using mesh::Triangle;
using mesh::detail::PolygonCutter;

std::vector<Triangle> fan(size_t count, size_t first = 0) {
  const auto corner = [&](size_t i) { return uint32_t((first + i) % count); };
  std::vector<Triangle> triangles;
  for (size_t i = 2; i < count; ++i) triangles.push_back({corner(0), corner(i - 1), corner(i)});
  return triangles;
}

/// Triangles by position, without those of zero area.
std::multiset<std::set<Float3>> places(const std::vector<Float3>& positions,
                                       const std::vector<Triangle>& triangles) {
  std::multiset<std::set<Float3>> out;
  for (const auto& [a, b, c] : triangles) out.insert({positions[a], positions[b], positions[c]});
  return out;
}

double area(const std::vector<Float3>& p, const Triangle& t) {
  const auto edge = [&](size_t i, size_t a) { return double(p[t[i]][a]) - double(p[t[0]][a]); };
  double sum = 0;
  for (size_t a = 0; a < 3; ++a) {
    const size_t b = (a + 1) % 3;
    const double n = edge(1, a) * edge(2, b) - edge(1, b) * edge(2, a);
    sum += n * n;
  }
  return std::sqrt(sum) / 2;
}

double area(const std::vector<Float3>& p, const std::vector<Triangle>& triangles) {
  double sum = 0;
  for (const Triangle& t : triangles) sum += area(p, t);
  return sum;
}

/// Whether the triangles cover the polygon exactly once: they have its area and orientation, and none has its
/// centre outside or (with `detail`, which takes most of the time) crosses the outline. Edges that are used
/// twice are not part of the outline.
void expect_covers(const GridPolygon& polygon, const std::vector<Triangle>& triangles, bool detail) {
  const size_t count = polygon.size();
  ASSERT_EQ(triangles.size(), count - 2);
  std::set<std::pair<GridPoint, GridPoint>> edges;
  for (size_t i = 0; i < count; ++i) edges.insert({polygon[i], polygon[(i + 1) % count]});
  const int way = sign_of(area_of(polygon));
  int64_t sum = 0;
  for (const auto& [i, j, k] : triangles) {
    const GridPoint &a = polygon[i], &b = polygon[j], &c = polygon[k];
    const int64_t size = area_of(a, b, c);
    sum += std::abs(size);
    if (size == 0) continue;
    ASSERT_EQ(sign_of(size), way);
    ASSERT_EQ(winding_around_middle(polygon, a, b, c), way);
    if (!detail) continue;
    for (const auto& [from, to] : edges) {
      if (edges.contains({to, from})) continue;
      ASSERT_FALSE(cross(a, b, from, to) || cross(b, c, from, to) || cross(c, a, from, to));
    }
  }
  ASSERT_EQ(sum, std::abs(area_of(polygon)));
}

void check_random(size_t polygons, uint64_t seed) {
  RandomPolygons random(seed);
  PolygonCutter cutter;
  size_t not_convex = 0;
  for (size_t k = 0; k < polygons; ++k) {
    SCOPED_TRACE(k);
    const GridPolygon polygon = random.next(3 + random.below(198));
    const size_t count = polygon.size();
    if (count < 4) continue;
    // On a plane of integers through space, where floats are exact.
    const int64_t u = int64_t(random.below(17)) - 8, v = int64_t(random.below(17)) - 8;
    const uint64_t axis = random.below(3);
    std::vector<Float3> positions, turned;
    const double angle = double(random.below(1000));
    for (const GridPoint& p : polygon) {
      const std::array<float, 3> q{float(p.x), float(p.y), float(u * p.x + v * p.y)};
      positions.push_back({q[axis], q[(axis + 1) % 3], q[(axis + 2) % 3]});
      const double x = std::cos(angle) * double(p.x) - std::sin(angle) * double(p.y);
      const double y = std::sin(angle) * double(p.x) + std::cos(angle) * double(p.y);
      turned.push_back({float(x), float(0.6 * y), float(0.8 * y)});
    }
    std::vector<Triangle> triangles = fan(count);
    const PolygonCutter::Found found = cutter.cut(positions, triangles);
    EXPECT_FALSE(found.crosses || found.bent);
    ASSERT_NO_FATAL_FAILURE(expect_covers(polygon, triangles, k % 10 == 0));
    if (triangles != fan(count)) {
      ++not_convex;
      std::vector<Triangle> other = fan(count, random.below(count));
      (void)cutter.cut(positions, other);
      ASSERT_EQ(places(positions, other), places(positions, triangles));
    }
    // Rotated by any angle, so its corners are rounded.
    triangles = fan(count);
    (void)cutter.cut(turned, triangles);
    const double wanted = double(std::abs(area_of(polygon))) / 2;
    EXPECT_NEAR(area(turned, triangles), wanted, 1e-6 * wanted + 1e-3 * RandomPolygons::kSide);
  }
  EXPECT_GT(not_convex, polygons / 2);
}

TEST(Polygon, TrianglesCoverRandomPolygons) { check_random(1000, 1); }
TEST(Polygon, TrianglesCoverManyRandomPolygons) {
#ifdef NIF_SANITIZED
  check_random(5'000, 2);
#else
  check_random(100'000, 2);
#endif
}

Scene read_text(const std::string& name, const std::string& text) { return mesh::read(name, text); }

double area(const Scene& scene) { return area(scene.meshes.at(0).positions, scene.meshes.at(0).triangles); }

/// A face of all vertices of the plan, in one of the formats.
std::string file_of(const std::string& ending, const std::vector<Float3>& plan,
                    const std::vector<size_t>& face) {
  std::string vertices, corners;
  for (const Float3& p : plan)
    vertices += (ending == "obj" ? "v " : "") + std::to_string(p[0]) + " " + std::to_string(p[1]) + " " +
                std::to_string(p[2]) + "\n";
  for (const size_t v : face) corners += " " + std::to_string(v + (ending == "obj" ? 1 : 0));
  const std::string count = std::to_string(face.size());
  if (ending == "obj") return "f" + corners + "\n" + vertices;  // refers to later vertices
  if (ending == "off")
    return "OFF " + std::to_string(plan.size()) + " 1 0\n" + vertices + count + corners + "\n";
  return "ply\nformat ascii 1.0\nelement vertex " + std::to_string(plan.size()) +
         "\nproperty float x\nproperty float y\nproperty float z\nelement face 1\n"
         "property list uchar int vertex_indices\nend_header\n" +
         vertices + count + corners + "\n";
}

TEST(Polygon, TheCourtOfAHouseStaysOpen) {
  const std::vector<Float3> plan{{0, 4, 0}, {0, 0, 0}, {4, 0, 0}, {4, 4, 0},
                                 {3, 4, 0}, {3, 1, 0}, {1, 1, 0}, {1, 4, 0}};
  for (const char* ending : {"obj", "off", "ply"})
    for (size_t first = 0; first < 16; ++first) {
      std::vector<size_t> face;
      for (size_t i = 0; i < 8; ++i) face.push_back(first < 8 ? (first + i) % 8 : (first + 8 - i) % 8);
      const Scene scene = read_text("court." + std::string(ending), file_of(ending, plan, face));
      EXPECT_FLOAT_EQ(float(area(scene)), 10);
      EXPECT_EQ(scene.meshes[0].triangles.size(), 6u);
      EXPECT_TRUE(scene.notes.empty());
    }
}

TEST(Polygon, AWindowInAWallIsOpen) {
  // The outline passes the slit to the window twice; the wall is tilted.
  const std::vector<Float3> wall{{0, 0, 0}, {4, 4, 0}, {4, 4, 3}, {0, 0, 3},
                                 {1, 1, 1}, {1, 1, 2}, {2, 2, 2}, {2, 2, 1}};
  const Scene scene = read_text("wall.obj", file_of("obj", wall, {0, 1, 2, 3, 0, 4, 5, 6, 7, 4}));
  EXPECT_FLOAT_EQ(float(area(scene)), float(std::sqrt(2.0) * 11));
  EXPECT_TRUE(scene.notes.empty());
}

TEST(Polygon, ConvexOnesAreFans) {
  const auto triangles = [](const std::vector<Float3>& plan, const std::vector<size_t>& face) {
    return read_text("a.obj", file_of("obj", plan, face)).meshes.at(0).triangles;
  };
  EXPECT_EQ(triangles({{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}, {2, 3, 0, 1}), fan(4, 2));
  // A corner on a straight line, and the first corner repeated at the end.
  const std::vector<Float3> house{{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {2, 0, 2}, {1, 0, 3}, {0, 0, 2}};
  EXPECT_EQ(triangles(house, {0, 1, 2, 3, 4, 5}), fan(6));
  std::vector<Triangle> closed = fan(6, 1);
  closed.push_back({1, 0, 1});
  EXPECT_EQ(triangles(house, {1, 2, 3, 4, 5, 0, 1}), closed);
  // Bent, like quads at a character's elbow.
  const Scene bent =
      read_text("a.obj", file_of("obj", {{0, 0, 0}, {1, 0, 0}, {1, 1, 0.8f}, {0, 1, 0}}, {0, 1, 2, 3}));
  EXPECT_EQ(bent.meshes[0].triangles, fan(4));
  EXPECT_TRUE(bent.notes.empty());
}

TEST(Polygon, OutlinesThatCrossThemselvesAreNoted) {
  const std::string text =
      "o bow\nv 0 0 0\nv 2 2 0\nv 2 0 0\nv 0 2 0\nf 1 2 3 4\nf 2 3 4 1\no flat\nf 1 3 2 4\n"
      "o star\nv 0 3 0\nv 2 -3 0\nv -3 1 0\nv 3 1 0\nv -2 -3 0\nf 5 6 7 8 9\n";
  const Scene scene = read_text("a.obj", text);
  ASSERT_EQ(scene.notes.size(), 1u);
  EXPECT_EQ(scene.notes[0].kind, NoteKind::crossing_polygons);
  EXPECT_EQ(scene.notes[0].text,
            "a.obj: the outlines of 3 polygons of 'bow' (2) and 'star' (1) cross themselves; some of their "
            "triangles may lie outside of them");
  EXPECT_EQ(scene.meshes.at(0).triangles.size(), 4u);
  // A small kink changes little: the rest is triangulated as without it.
  std::vector<Float3> plan{{0, 4, 0}, {0, 0, 0}, {4, 0, 0}, {4, 4, 0},
                           {3, 4, 0}, {3, 1, 0}, {1, 1, 0}, {1, 4, 0}};
  plan.insert(plan.begin() + 2, {{2, 0, 0}, {1.9f, -0.01f, 0}, {1.95f, 0.02f, 0}});
  std::vector<size_t> face;
  for (size_t i = 0; i < plan.size(); ++i) face.push_back(i);
  const Scene kinked = read_text("a.obj", file_of("obj", plan, face));
  EXPECT_NEAR(area(kinked), 10, 0.1);  // a fan has 13
  EXPECT_EQ(kinked.notes.size(), 1u);
}

TEST(Polygon, ThoseFarFromFlatAreRemarkedOn) {
  const Scene scene = read_text(
      "a.obj", file_of("obj", {{0, 0, 0}, {2, 0, 1}, {3, 2, 0}, {1, 3, 1}, {-1, 2, -1}}, {0, 1, 2, 3, 4}));
  ASSERT_EQ(scene.notes.size(), 1u);
  EXPECT_EQ(scene.notes[0].kind, NoteKind::bent_polygons);
  EXPECT_FALSE(mesh::is_loss(scene.notes[0].kind));
  EXPECT_NE(scene.notes[0].text.find("1 polygon of 'a' is far from flat"), std::string::npos)
      << scene.notes[0].text;
}

struct Shape {
  const char* name;
  std::vector<Float3> corners;
  bool crosses;
};

std::vector<Shape> large_shapes(size_t count) {
  std::vector<Shape> shapes{{"comb", {}, false},   {"aslant", {}, false}, {"star", {}, false},
                            {"spiral", {}, false}, {"petals", {}, false}, {"line", {}, false},
                            {"point", {}, false},  {"random", {}, true},  {"folded", {}, true}};
  RandomPolygons random(3);
  const auto at = [](double x, double y) { return Float3{float(x), float(y), 1}; };
  const auto polar = [&](double angle, double r) { return at(r * std::cos(angle), r * std::sin(angle)); };
  for (size_t i = 0; i < count; ++i) {
    const double x = double(4 * (i / 4) + (i % 4 > 1 ? 2 : 0)),
                 y = i % 4 == 1 || i % 4 == 2 ? double(count) : 1;
    shapes[0].corners.push_back(at(x, y));
    shapes[1].corners.push_back(at(x - y, x + y));
    const double turn = 6.2831853 * double(i) / double(count);
    shapes[2].corners.push_back(polar(turn, i % 2 == 0 ? 1 : 0.5));
    const size_t arm = std::min(i, count - 1 - i);
    shapes[3].corners.push_back(polar(10 + 0.05 * double(arm), 10 + 0.05 * double(arm) + (i == arm ? 0 : 3)));
    const double petal = 6.2831853 * double(i - i % 3 + (i % 3 == 2 ? 2 : 0)) / double(count);
    shapes[4].corners.push_back(polar(petal, i % 3 == 0 ? 0 : 1));
    shapes[5].corners.push_back(at(double(random.below(1000)), 2));
    shapes[6].corners.push_back(at(1, 2));
    shapes[7].corners.push_back(at(double(random.below(1 << 20)), double(random.below(1 << 20))));
    shapes[8].corners.push_back(at(double(i % 1000), double(i / 2 % 7)));
  }
  for (size_t shape : {0, 1}) {
    const double x = double(count + 4);
    shapes[shape].corners.push_back(at(x, shape == 0 ? 0 : x));
    shapes[shape].corners.push_back(at(-1, shape == 0 ? 0 : -1));
  }
  return shapes;
}

/// This would take minutes if time were quadratic in the number of corners.
TEST(Polygon, ManyCornersTakeTimeInProportion) {
  PolygonCutter cutter;
  for (const Shape& shape : large_shapes(30'000)) {
    std::vector<Triangle> triangles = fan(shape.corners.size());
    EXPECT_EQ(cutter.cut(shape.corners, triangles).crosses, shape.crosses) << shape.name;
    double signed_area = 0;
    for (const auto& [a, b, c] : triangles) {
      const Float3 &p = shape.corners[a], &q = shape.corners[b], &r = shape.corners[c];
      signed_area += (double(q[0]) - double(p[0])) * (double(r[1]) - double(p[1])) -
                     (double(q[1]) - double(p[1])) * (double(r[0]) - double(p[0]));
    }
    if (shape.crosses) continue;
    EXPECT_NEAR(area(shape.corners, triangles), std::abs(signed_area) / 2, 1e-6 * std::abs(signed_area))
        << shape.name;
  }
}

TEST(Polygon, CoordinatesOfAnySizeAreDecided) {
  const std::vector<Float3> arrow{{0, 0, 0}, {2, 1, 0}, {0, 2, 0}, {0.5f, 1, 0}};
  for (const float scale : {1.5e38f, 1.4e-45f * 4, 1e-42f, 1.0f}) {
    std::vector<Float3> positions = arrow;
    for (Float3& p : positions)
      for (float& x : p) x *= scale;
    std::vector<Triangle> triangles = fan(4, 1);
    EXPECT_FALSE(PolygonCutter().cut(positions, triangles).crosses);
    for (const Triangle& t : triangles)
      EXPECT_TRUE(std::ranges::count(t, 1u) == 1 && std::ranges::count(t, 3u) == 1) << scale;
  }
  // Corners that are not numbers, or out of range, are refused with their position.
  for (const char* bad : {"nan", "inf", "-1e99"}) try {
      read_text("a.obj", "v 0 0 0\nv 2 1 0\nv 0 " + std::string(bad) + " 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4 5\n");
      ADD_FAILURE() << bad;
    } catch (const Error& error) {
      EXPECT_EQ(error.status(), Status::non_finite_vertex);
    }
  try {
    read_text("a.obj", "v 0 0 0\nv 2 1 0\nv 0 2 0\nv 1 1 0\nf 1 2 3 4 9\n");
    ADD_FAILURE();
  } catch (const Error& error) {
    EXPECT_EQ(error.status(), Status::index_out_of_range);
  }
}

}  // namespace
}  // namespace nif::test
