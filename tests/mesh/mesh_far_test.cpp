// A house at coordinates of surveys, which floats round by up to half a metre: it is read as if it stood near
// the origin, placed by its instance, and written back with the digits that it had.
#include "formats/mesh/far_from_origin.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

#include "formats/mesh/read.hpp"
#include "formats/mesh/transform.hpp"
#include "formats/mesh/write.hpp"
#include "tests/support/temp_dir.hpp"

namespace nif::test {
namespace {

using mesh::Scene;

constexpr Double3 kUtm{447326.137, 5411987.482, 512.31}, kEcef{-2487002.8817, -4684683.6766, 3529638.9835},
    kMicrometres{1e9 + 12.5, -7e9 - 0.25, 3e9}, kHere{};

/// A room with walls of 0.2: two boxes, by their corners relative to the first one.
std::vector<Double3> house() {
  std::vector<Double3> corners;
  for (const double wall : {0.0, 0.2})
    for (int i = 0; i < 8; ++i)
      corners.push_back({i & 1 ? 8.35 - wall : wall, i & 2 ? 6.15 - wall : wall, i & 4 ? 3.05 - wall : wall});
  return corners;
}
constexpr int kSides[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4},
                              {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};

std::vector<mesh::Triangle> triangles() {
  std::vector<mesh::Triangle> all;
  for (const uint32_t box : {0u, 8u})
    for (const auto& s : kSides)
      for (const uint32_t second : {1u, 2u})
        all.push_back({box + uint32_t(s[0]), box + uint32_t(s[second]), box + uint32_t(s[second + 1])});
  return all;
}

std::string point(const Double3& p) { return fmt::format("{:.4f} {:.4f} {:.4f}\n", p[0], p[1], p[2]); }

std::string obj_at(const Double3& at, const char* name = "house", uint32_t first = 1) {
  std::string text = fmt::format("o {}\n", name);
  for (const Double3& p : house()) text += "v " + point(p + at);
  for (const mesh::Triangle& t : triangles())
    text += fmt::format("f {} {} {}\n", t[0] + first, t[1] + first, t[2] + first);
  return text;
}

std::string off_at(const Double3& at) {
  std::string text = "OFF\n16 24 0\n";
  for (const Double3& p : house()) text += point(p + at);
  for (const mesh::Triangle& t : triangles()) text += fmt::format("3 {} {} {}\n", t[0], t[1], t[2]);
  return text;
}

std::string stl_at(const Double3& at) {
  std::string text = "solid house\n";
  const std::vector<Double3> corners = house();
  for (const mesh::Triangle& t : triangles()) {
    text += "facet normal 0 0 0\nouter loop\n";
    for (const uint32_t v : t) text += "vertex " + point(corners[v] + at);
    text += "endloop\nendfacet\n";
  }
  return text + "endsolid\n";
}

template <class Number>
std::string ply_at(const Double3& at, const char* type, double unit = 1) {
  std::string text = fmt::format(
      "ply\nformat binary_little_endian 1.0\nelement vertex 16\nproperty {0} x\nproperty {0} y\nproperty {0} "
      "z\nelement face 24\nproperty list uchar int vertex_indices\nend_header\n",
      type);
  const auto put = [&](const auto& value) {
    text.append(reinterpret_cast<const char*>(&value), sizeof(value));
  };
  for (const Double3& p : house())
    for (const double x : p + at) put(Number(std::is_integral_v<Number> ? std::round(x / unit) : x / unit));
  for (const mesh::Triangle& t : triangles()) put(uint8_t{3}), put(t);
  return text;
}

/// Each triangle corner of the scene, and where it should be.
void expect_house(const Scene& scene, const Double3& at, double within) {
  ASSERT_EQ(scene.instances.size(), 1u);
  const mesh::Mesh& mesh = scene.meshes[0];
  ASSERT_EQ(mesh.triangles.size(), 24u);
  const std::vector<Double3> corners = house();
  const std::vector<mesh::Triangle> wanted = triangles();
  for (size_t t = 0; t < wanted.size(); ++t)
    for (size_t c = 0; c < 3; ++c) {
      const Double3 is = mesh::placed(scene.instances[0], mesh.positions[mesh.triangles[t][c]]),
                    should = corners[wanted[t][c]] + at;
      for (size_t a = 0; a < 3; ++a) EXPECT_NEAR(is[a], should[a], within) << t << ' ' << c << ' ' << a;
    }
}

Scene read_text(const std::string& name, const std::string& bytes) { return mesh::read(name, bytes); }

TEST(Far, EveryFormatKeepsWhatItSays) {
  constexpr double kNear = 5e-7;  // a float of some metres, and the double in the file
  for (const Double3& at : {kUtm, kEcef}) {
    expect_house(read_text("a.obj", obj_at(at)), at, kNear);
    expect_house(read_text("a.off", off_at(at)), at, kNear);
    expect_house(read_text("a.stl", stl_at(at)), at, kNear);
    expect_house(read_text("a.ply", ply_at<double>(at, "double")), at, kNear);
  }
  expect_house(read_text("a.obj", obj_at(kMicrometres)), kMicrometres, 2e-6);
  // The same for whole numbers of half millimetres.
  Scene scene = read_text("a.ply", ply_at<int32_t>({447326, 541198, 512}, "int", 0.0005));
  for (const mesh::Mesh& mesh : scene.meshes)
    for (const mesh::Float3& p : mesh.positions)
      for (const float x : p) EXPECT_LT(std::abs(x), 3e4f);
}

TEST(Far, TheOffsetIsARoundNumberThatFloatsHold) {
  const Scene scene = read_text("a.obj", obj_at(kUtm));
  const mesh::Transform wanted{1, 0, 0, 447332, 0, 1, 0, 5411992, 0, 0, 1, 512};
  EXPECT_EQ(scene.instances[0].transform, wanted);
  EXPECT_EQ(scene.instances[0].remainder, Double3{});
  EXPECT_TRUE(scene.notes.empty());
}

TEST(Far, WhatIsNearOrLosesNothingStaysAsItIs) {
  for (const std::string& text : {obj_at(kHere), obj_at({100, -50, 20}),
                                  obj_at({3.7e3, 0, 0}) /* a five hundredth millimetre of 3 m */}) {
    const Scene scene = read_text("a.obj", text);
    EXPECT_EQ(scene.instances[0].transform, mesh::kIdentity);
    float first = 0;
    std::sscanf(text.c_str(), "o house\nv %f", &first);
    EXPECT_EQ(scene.meshes[0].positions[0][0], first);
  }
  // Far away, but all coordinates are exact floats; in PLY also by type.
  std::string text = "OFF\n3 1 0\n5411987.5 0 0\n5411988 0 0\n5411987.5 1 0\n3 0 1 2\n";
  EXPECT_EQ(read_text("a.off", text).instances[0].transform, mesh::kIdentity);
  EXPECT_EQ(read_text("a.ply", ply_at<float>(kUtm, "float")).instances[0].transform, mesh::kIdentity);
}

TEST(Far, EachObjectHasItsOwnOffset) {
  const Scene scene =
      read_text("a.obj", obj_at(kHere, "here") + obj_at(kUtm, "utm", 17) + obj_at(kEcef, "ecef", 33));
  ASSERT_EQ(scene.instances.size(), 3u);
  const Double3 places[3] = {kHere, kUtm, kEcef};
  for (size_t i = 0; i < 3; ++i) {
    Scene one;
    one.meshes = {scene.meshes[i]};
    one.instances = {scene.instances[i]};
    one.instances[0].mesh = 0;
    expect_house(one, places[i], 5e-7);
  }
  EXPECT_EQ(scene.instances[0].transform, mesh::kIdentity);
  const Scene alone = read_text("a.obj", obj_at(kHere));
  EXPECT_EQ(scene.meshes[0].positions, alone.meshes[0].positions);
}

/// A thin sheet, an unused vertex, and a triangle that is a point in floats.
TEST(Far, IsFoundWhereFloatsHideIt) {
  const char* kSheet =
      "v 0 0 5000000.1\nv 10 0 5000000.1\nv 0 10 5000000.1\nv 0 0 5000000.3\nf 1 2 3\nf 1 2 4\n";
  const Scene sheet = read_text("a.obj", kSheet);
  EXPECT_NEAR(sheet.meshes[0].positions[3][2] - sheet.meshes[0].positions[0][2], 0.2, 1e-6);
  const Scene stray = read_text("a.obj", "v 0 0 0\nv 1e30 nan inf\n" + obj_at(kUtm, "house", 3));
  Scene house = stray;
  expect_house(house, kUtm, 5e-7);
  const Scene point =
      read_text("a.obj", "v 5411987.42 7 0\nv 5411987.43 7 0\nv 5411987.42 7.00000001 0\nf 1 2 3\n");
  EXPECT_NEAR(point.meshes[0].positions[1][0] - point.meshes[0].positions[0][0], 0.01, 1e-6);
  EXPECT_NE(point.instances[0].transform, mesh::kIdentity);
}

/// A U of a few centimetres: its corners would coincide if rounded.
TEST(Far, PolygonsAreCutByTheirExactCorners) {
  const int outline[8][2] = {{0, 4}, {0, 0}, {4, 0}, {4, 4}, {3, 4}, {3, 1}, {1, 1}, {1, 4}};
  for (size_t first = 0; first < 8; ++first) {
    std::string text, face = "f";
    for (const auto& p : outline) text += "v " + point(kUtm + Double3{0.02 * p[0], 0.02 * p[1], 0});
    for (size_t i = 0; i < 8; ++i) face += fmt::format(" {}", (first + i) % 8 + 1);
    const Scene scene = read_text("a.obj", text + face + "\n");
    EXPECT_TRUE(scene.notes.empty()) << scene.notes[0].text;
    double area = 0;
    for (const mesh::Triangle& t : scene.meshes.at(0).triangles) {
      const auto at = [&](size_t k) { return to_double(scene.meshes[0].positions[t[k]]); };
      const double z = cross(at(1) - at(0), at(2) - at(0))[2] / 2;
      EXPECT_GE(z, 0);
      area += z;
    }
    EXPECT_NEAR(area, 10 * 0.02 * 0.02, 1e-6 * 10 * 0.02 * 0.02);
  }
}

TEST(Far, ANoteSaysWhatEvenAnOffsetLoses) {
  // Sides of 1e-8, 5 million away: even relative to an offset, floats near 0.25 are no finer.
  const Scene scene = read_text(
      "a.obj", "v 5000000.20000001 0 0\nv 5000000.20000002 0 0\nv 5000000.20000001 1.1e-8 0\nf 1 2 3\n");
  ASSERT_EQ(scene.notes.size(), 1u);
  EXPECT_EQ(scene.notes[0].kind, mesh::NoteKind::rounding);
  EXPECT_TRUE(mesh::is_loss(mesh::NoteKind::rounding));
  EXPECT_NE(scene.notes[0].text.find("by up to"), std::string::npos) << scene.notes[0].text;
}

TEST(Far, AbsurdNumbersAreRefusedOrStayAsTheyAre) {
  const auto with = [](const char* x) {
    return fmt::format("v {0} 0 0\nv {0} 1 0\nv {0} 0 1\nf 1 2 3\n", x);
  };
  for (const char* x : {"1e300", "-1e300", "nan", "inf", "1e400"})
    EXPECT_THROW(read_text("a.obj", with(x)), Error) << x;
  for (const char* x : {"1e-320", "1e-40", "3.4028235e38", "-3.4e38", "0", "-0", "1e15", "1e-400"})
    EXPECT_EQ(read_text("a.obj", with(x)).meshes[0].triangles.size(), 1u) << x;
  // One vertex far away: the others must stay as exact as they are.
  const Scene scene = read_text("a.obj", "v 1e15 0 0\nv 0.1 0.25 0\nv 0 0.1 0.3\nf 1 2 3\n");
  EXPECT_EQ(scene.instances[0].transform, mesh::kIdentity);
  EXPECT_EQ(scene.meshes[0].positions[1][0], 0.1f);
}

/// All formats that can hold it, and the scene read back from each.
TEST(Far, ConvertingKeepsTheDigits) {
  const TempDir folder;
  const std::atomic<bool> go_on{false};
  const mesh::WriteOptions text{.text = true, .draco = false, .draco_bits = {}};
  for (const Double3& at : {kUtm, kEcef}) {
    const Scene scene = read_text("house.obj", obj_at(at));
    for (const char* name : {"a.obj", "a.off", "a.stl", "a.ply", "a.glb"}) {
      SCOPED_TRACE(name);
      const std::string path = (folder.path() / name).string();
      const bool stl = std::string_view(name) == "a.stl";
      const mesh::Written written = mesh::write(
          path, scene, stl ? text : mesh::WriteOptions(), [](double) {}, go_on);
      for (const std::string& note : written.notes) EXPECT_EQ(note.find("rounded"), note.npos) << note;
      const Scene back = mesh::read(path);
      expect_house(back, at, 5e-7);
      if (!stl) {
        EXPECT_EQ(back.meshes[0].positions, scene.meshes[0].positions);
      }
      EXPECT_EQ(back.instances[0].transform, scene.instances[0].transform);
      if (std::string_view(name) == "a.glb" || std::string_view(name) == "a.ply") continue;
      std::ifstream file(path);
      const std::string written_text{std::istreambuf_iterator<char>(file), {}};
      const std::string first = fmt::format("{} {} {}\n", at[0], at[1], at[2]);
      EXPECT_NE(written_text.find(first), std::string::npos) << first << written_text.substr(0, 300);
    }
    for (const char* name : {"b.stl", "b.drc"}) {
      const mesh::Written written =
          mesh::write((folder.path() / name).string(), scene, {}, [](double) {}, go_on);
      EXPECT_TRUE(std::ranges::any_of(written.notes, [](const std::string& note) {
        return note.find("positions were rounded by up to 0.") != note.npos;
      })) << name;
    }
  }
}

TEST(Far, PlyIsWrittenInDoubles) {
  const TempDir folder;
  const std::atomic<bool> go_on{false};
  const std::string path = (folder.path() / "a.ply").string();
  mesh::write(
      path, read_text("house.obj", obj_at(kUtm)), {}, [](double) {}, go_on);
  std::ifstream file(path, std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(file), {}};
  EXPECT_NE(bytes.find("property double x"), std::string::npos);
  Double3 first;
  std::memcpy(&first, bytes.data() + bytes.find("end_header\n") + 11, sizeof(first));
  EXPECT_EQ(first, kUtm);
}

TEST(Far, FloatsThatAreFarAreWrittenToTheBit) {
  const Scene scene = read_text("a.ply", ply_at<float>(kUtm, "float"));
  const TempDir folder;
  const std::atomic<bool> go_on{false};
  for (const char* name : {"a.obj", "a.off", "a.ply", "a.glb"}) {
    const std::string path = (folder.path() / name).string();
    mesh::write(
        path, scene, {}, [](double) {}, go_on);
    const Scene back = mesh::read(path);
    EXPECT_EQ(back.meshes[0].positions, scene.meshes[0].positions) << name;
    EXPECT_EQ(back.instances[0].transform, mesh::kIdentity) << name;
  }
}

/// Two copies of one mesh at nodes of a glTF, half a metre apart: finer than floats are there.
TEST(Far, NodesOfGltfKeepTheirDoubles) {
  Scene scene = read_text("a.obj", obj_at(kHere));
  for (const double x : {kUtm[0], kUtm[0] + 0.01}) {
    mesh::Instance instance{"house", 0};
    const Double3 at{x, kUtm[1], kUtm[2]};
    for (size_t a = 0; a < 3; ++a) {
      instance.transform[4 * a + 3] = float(at[a]);
      instance.remainder[a] = at[a] - double(float(at[a]));
    }
    scene.instances.push_back(instance);
  }
  scene.instances.erase(scene.instances.begin());
  const TempDir folder;
  const std::atomic<bool> go_on{false};
  for (const char* name : {"a.glb", "a.obj", "a.ply"}) {
    SCOPED_TRACE(name);
    const std::string path = (folder.path() / name).string();
    mesh::write(
        path, scene, {}, [](double) {}, go_on);
    const Scene back = mesh::read(path);
    const double within = std::string_view(name) == "a.glb" ? 1e-9 : 5e-7;
    const mesh::Instance &first = back.instances.front(), &second = back.instances.back();
    const bool one = back.instances.size() == 1;
    const Double3 a = mesh::placed(first, back.meshes[first.mesh].positions[0]),
                  b = mesh::placed(second, back.meshes[second.mesh].positions[one ? 16 : 0]);
    for (size_t axis = 0; axis < 3; ++axis) {
      EXPECT_NEAR(a[axis], kUtm[axis], within);
      EXPECT_NEAR(b[axis] - a[axis], axis == 0 ? 0.01 : 0, within);
    }
  }
}

TEST(Far, NodesNearTheOriginAreFloatsAsEver) {
  Scene scene = read_text("a.obj", obj_at(kHere));
  scene.instances[0].transform[3] = 0.1f;
  scene.instances[0].remainder[0] = 0.1 - double(0.1f);
  const TempDir folder;
  const std::atomic<bool> go_on{false};
  const std::string path = (folder.path() / "a.glb").string();
  mesh::write(
      path, scene, {}, [](double) {}, go_on);
  EXPECT_EQ(mesh::read(path).instances[0].remainder, Double3{});
  EXPECT_EQ(mesh::read(path).instances[0].transform[3], 0.1f);
}

TEST(Far, PlacingWhatIsPlacedIsExact) {
  mesh::Instance instance{"", 0};
  instance.transform[3] = 5411987.5f;
  instance.remainder[0] = -0.018;
  mesh::Transform back = mesh::kIdentity;
  back[3] = -5411987.0f;
  const mesh::Instance moved = mesh::placed(back, instance);
  EXPECT_NEAR(double(moved.transform[3]) + moved.remainder[0], 0.482, 1e-9);
}

TEST(Far, ShortNumbersAreTheSameFloatBesideTheOffset) {
  EXPECT_EQ(mesh::shortest_near(5411992 + double(float(5411987.482 - 5411992)), 5411992), 5411987.482);
  EXPECT_EQ(mesh::shortest_near(512 + double(float(512.31 - 512)), 512), 512.31);
  EXPECT_EQ(mesh::shortest_near(7, 7), 7);
  EXPECT_EQ(mesh::shortest_near(double(0.1f), 0), 0.1);
  uint64_t state = 1;
  for (int i = 0; i < 2000; ++i) {
    state = state * 6364136223846793005u + 1442695040888963407u;
    const double offset = double(int32_t(state >> 40)) * std::ldexp(1.0, int(state >> 8 & 31) - 16);
    const double value =
        offset + double(float(int32_t(state >> 32)) * 1e-9f) * std::ldexp(1.0, int(state & 15));
    const double read = mesh::shortest_near(value, offset);
    ASSERT_EQ(float(read - offset), float(value - offset)) << value << ' ' << offset;
  }
}

}  // namespace
}  // namespace nif::test
