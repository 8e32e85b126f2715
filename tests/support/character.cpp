// Written to be compared with the reader, so it uses nothing of it but scenes.
#include "tests/support/character.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "formats/mesh/read.hpp"
#include "tests/support/test_shapes.hpp"

namespace nif::test {
namespace {

constexpr size_t kJoints = 8;

Double3 world_of(const mesh::Affine& t, const mesh::Float3& p) {
  Double3 out;
  for (size_t row = 0; row < 3; ++row)
    out[row] = t[4 * row] * double{p[0]} + t[4 * row + 1] * double{p[1]} + t[4 * row + 2] * double{p[2]} +
               t[4 * row + 3];
  return out;
}

}  // namespace

void add_channel(Gltf& gltf, size_t node, const char* path, const std::vector<float>& times,
                 const std::vector<float>& values, size_t per, const char* mode) {
  if (!gltf.json.contains("animations"))
    gltf.json["animations"] = {
        {{"samplers", nlohmann::json::array()}, {"channels", nlohmann::json::array()}}};
  nlohmann::json& clip = gltf.json["animations"].back();
  const int input = gltf.accessor(raw(times), 5126, "SCALAR", times.size());
  const int output = gltf.accessor(raw(values), 5126,
                                   per == 1   ? "SCALAR"
                                   : per == 3 ? "VEC3"
                                              : "VEC4",
                                   values.size() / per);
  clip["channels"].push_back(
      {{"sampler", clip["samplers"].size()}, {"target", {{"node", node}, {"path", path}}}});
  clip["samplers"].push_back({{"input", input}, {"output", output}, {"interpolation", mode}});
}

Gltf tube_character(int around, int rings) {
  Gltf gltf;
  std::vector<mesh::Float3> positions, swollen;
  std::vector<uint32_t> corners;
  std::vector<uint8_t> joints[2];
  std::vector<float> weights[2];
  for (int r = 0; r <= rings; ++r)
    for (int k = 0; k < around; ++k) {
      const double y = double(kJoints) * r / rings, angle = 2 * std::numbers::pi * k / around;
      const auto x = float(std::cos(angle)), z = float(std::sin(angle));
      positions.push_back({x, float(y), z});
      swollen.push_back({x / 2, 0, z / 4});
      for (size_t j = 0; j < kJoints; ++j) {
        joints[j / 4].push_back(uint8_t(j));
        weights[j / 4].push_back(float(std::exp(-(y - double(j)) * (y - double(j)) / 8)));
      }
      if (r == rings) continue;
      const auto at = [&](int ring, int place) { return uint32_t(ring * around + place % around); };
      corners.insert(corners.end(), {at(r, k), at(r + 1, k), at(r, k + 1)});
      corners.insert(corners.end(), {at(r, k + 1), at(r + 1, k), at(r + 1, k + 1)});
    }
  const int points = gltf.positions(positions), triangles = gltf.indices(corners);
  gltf.mesh(points, triangles, "tube");
  nlohmann::json& tube = gltf.json["meshes"][0];
  tube["weights"] = {0.25};
  for (const size_t set : {0, 1}) {
    const std::string n = std::to_string(set);
    tube["primitives"][0]["attributes"]["JOINTS_" + n] =
        gltf.accessor(raw(joints[set]), 5121, "VEC4", positions.size());
    tube["primitives"][0]["attributes"]["WEIGHTS_" + n] =
        gltf.accessor(raw(weights[set]), 5126, "VEC4", positions.size());
  }
  tube["primitives"][0]["targets"] = {{{"POSITION", gltf.positions(swollen)}}};
  const mesh::Mesh box = cube();
  std::vector<uint32_t> box_corners;
  for (const mesh::Triangle& t : box.triangles) box_corners.insert(box_corners.end(), t.begin(), t.end());
  const int box_points = gltf.positions(box.positions), box_triangles = gltf.indices(box_corners);
  gltf.mesh(box_points, box_triangles, "hat");

  std::vector<float> inverses;
  std::vector<size_t> numbers;
  for (size_t j = 0; j < kJoints; ++j) {
    inverses.insert(inverses.end(), {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, -float(j), 0, 1});
    numbers.push_back(size_t(gltf.node({{"name", "joint " + std::to_string(j)},
                                        {"translation", {0, j == 0 ? 0 : 1, 0}},
                                        {"children", {j + 1}}})));
  }
  gltf.node({{"mesh", 1}, {"name", "hat"}, {"translation", {0, 1, 0}}, {"scale", {0.5, 0.25, 0.5}}});
  const int root = gltf.node({{"name", "root"},
                              {"children", {0}},
                              {"translation", {10, 0, 3}},
                              {"rotation", {0, 0.6, 0, 0.8}},
                              {"scale", {2, 2, 2}}});
  const int shown = gltf.node({{"mesh", 0}, {"skin", 0}, {"name", "tube"}});
  gltf.json["skins"] = {
      {{"joints", numbers}, {"inverseBindMatrices", gltf.accessor(raw(inverses), 5126, "MAT4", kJoints)}}};
  gltf.scene({root, shown});

  const auto turn = [](double angle) {
    return std::vector{0.0f, 0.0f, float(std::sin(angle / 2)), float(std::cos(angle / 2))};
  };
  for (const char* name : {"sway", "swell"}) {
    gltf.json["animations"].push_back(
        {{"name", name}, {"samplers", nlohmann::json::array()}, {"channels", nlohmann::json::array()}});
    if (name != std::string("sway")) continue;
    for (size_t j = 0; j < kJoints; ++j) {
      std::vector<float> turns;
      for (const double angle : {0.0, 0.3, -0.2}) {
        const std::vector<float> one = turn(angle * (j % 3 == 0 ? 1 : 0.5));
        turns.insert(turns.end(), one.begin(), one.end());
      }
      add_channel(gltf, j, "rotation", {0, 0.5f, 1.25f}, turns, 4);
    }
  }
  const char* cubic = "CUBICSPLINE";
  add_channel(gltf, 3, "translation", {0, 1}, {0, 0, 0, 0, 1, 0, 1, 0, 0, 0, 2, 0, 0.5f, 1.5f, 0, 0, 0, 0}, 3,
              cubic);
  add_channel(gltf, 5, "scale", {0, 1}, {0, 0, 0, 1, 1, 1, 0, 1, 0, 0, 0, 0, 1.5f, 0.5f, 1, 0, 0, 0}, 3,
              cubic);
  add_channel(gltf, size_t(shown), "weights", {0, 1}, {0, 0, 2, -1, 1, 0}, 1, cubic);
  return gltf;
}

void expect_posed_as_read(const mesh::Scene& kept, const std::vector<mesh::PosedInstance>& posed,
                          const mesh::Scene& read) {
  ASSERT_EQ(posed.size(), kept.instances.size());
  ASSERT_EQ(posed.size(), read.instances.size());
  // The reader takes joints that nearly agree for ones that do.
  const bool bound = std::ranges::any_of(
      read.notes, [](const mesh::Note& n) { return n.kind == mesh::NoteKind::bind_pose; });
  for (size_t i = 0; i < posed.size(); ++i) {
    const mesh::Instance& placed = read.instances[i];
    const mesh::Mesh &before = kept.meshes[kept.instances[i].mesh], &after = read.meshes[placed.mesh];
    ASSERT_EQ(before.triangles, after.triangles);
    const std::vector<mesh::Float3> positions = mesh::bent(before, posed[i].joints, posed[i].weights);
    ASSERT_EQ(positions.size(), after.positions.size());
    double farthest = 0, off = 0;
    for (size_t v = 0; v < positions.size(); ++v) {
      const Double3 a = world_of(posed[i].transform, positions[v]),
                    b = mesh::placed(placed, after.positions[v]);
      for (size_t k = 0; k < 3; ++k) {
        off = std::max(off, std::abs(a[k] - b[k]));
        farthest = std::max({farthest, std::abs(a[k]), std::abs(b[k])});
      }
    }
    EXPECT_LE(off, (bound ? 1e-3 : 1e-6) * (1 + farthest)) << placed.name;
  }
}

void expect_posed_as_read(const std::string& file, const std::string& bytes, const mesh::Moment& moment) {
  mesh::ReadLimits keeping, moving;
  keeping.skins = true;
  moving.moment = moment;
  const mesh::Scene kept = mesh::read(file, bytes, keeping);
  expect_posed_as_read(kept, mesh::Poser(file, bytes, kept, keeping).at(moment),
                       mesh::read(file, bytes, moving));
  if (testing::Test::HasFailure()) FAIL() << moment.clip << " at " << moment.time;
}

}  // namespace nif::test
