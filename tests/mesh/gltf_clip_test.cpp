// Animations of glTF: where nodes are at a moment, and what is wrong with clips.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "formats/base/status.hpp"
#include "formats/mesh/poser.hpp"
#include "formats/mesh/read.hpp"
#include "tests/support/character.hpp"
#include "tests/support/test_shapes.hpp"

namespace nif::test {
namespace {

using mesh::Transform;
using nlohmann::json;

class Clips : public testing::Test {
 protected:
  Clips() {
    gltf_.json["animations"] = {{{"name", "go"}, {"samplers", json::array()}, {"channels", json::array()}}};
  }

  /// Adds a channel to the clip. `per`: numbers of an element.
  void move(const char* path, const std::vector<float>& times, const std::vector<float>& values, size_t per,
            const char* mode = nullptr, size_t node = 0) {
    const int input = gltf_.accessor(raw(times), 5126, "SCALAR", times.size());
    const int output = gltf_.accessor(raw(values), 5126,
                                      per == 1   ? "SCALAR"
                                      : per == 3 ? "VEC3"
                                                 : "VEC4",
                                      values.size() / per);
    json sampler{{"input", input}, {"output", output}};
    if (mode) sampler["interpolation"] = mode;
    clip()["samplers"].push_back(sampler);
    clip()["channels"].push_back(
        {{"sampler", clip()["samplers"].size() - 1}, {"target", {{"node", node}, {"path", path}}}});
  }
  json& clip() { return gltf_.json["animations"][0]; }
  mesh::Scene read(double time, const std::string& name = "go") const {
    expect_posed_as_read("a.glb", gltf_.glb(), {name, time});
    return mesh::read("a.glb", gltf_.glb(), {.moment = mesh::Moment{name, time}});
  }
  Transform place(double time) const { return read(time).instances.at(0).transform; }
  void expect_place(double time, const Transform& expected) const {
    const Transform found = place(time);
    for (size_t i = 0; i < 12; ++i) EXPECT_NEAR(found[i], expected[i], 1e-6) << time << ' ' << i;
  }
  void expect_refused(Status status, const std::string& part, const std::string& name = "go") const {
    const auto refused = [&](const auto& work) {
      try {
        work();
        ADD_FAILURE() << "was read; expected: " << part;
      } catch (const Error& error) {
        EXPECT_EQ(error.status(), status) << error.what();
        EXPECT_NE(std::string(error.what()).find(part), std::string::npos) << error.what();
      }
    };
    const std::string bytes = gltf_.glb();
    refused([&] { mesh::read("a.glb", bytes, {.moment = mesh::Moment{name, 0}}); });
    const mesh::ReadLimits keeping{.skins = true};
    const mesh::Poser poser("a.glb", bytes, mesh::read("a.glb", bytes, keeping), keeping);
    refused([&] { poser.at({name, 0}); });
  }
  static Transform at(float x, float y, float z) { return {1, 0, 0, x, 0, 1, 0, y, 0, 0, 1, z}; }

  Gltf gltf_ = gltf_of(cube());
};

TEST_F(Clips, InterpolateOnALine) {
  move("translation", {1, 3}, {2, 0, 0, 6, 8, 0}, 3);
  expect_place(0, at(2, 0, 0));
  expect_place(1.5, at(3, 2, 0));
  expect_place(3, at(6, 8, 0));
  expect_place(100, at(6, 8, 0));
  clip()["samplers"][0]["interpolation"] = "LINEAR";
  expect_place(2, at(4, 4, 0));
}

TEST_F(Clips, Step) {
  move("translation", {0, 1, 2}, {1, 0, 0, 2, 0, 0, 3, 0, 0}, 3, "STEP");
  expect_place(0.999, at(1, 0, 0));
  expect_place(1, at(2, 0, 0));
  expect_place(2.5, at(3, 0, 0));
}

TEST_F(Clips, FollowSplines) {
  // p = 1, leaving by 3 a second; q = 5, arriving by -2 a second; two seconds between them.
  move("translation", {0, 2}, {9, 0, 0, 1, 0, 0, 3, 0, 0, -2, 0, 0, 5, 0, 0, 9, 0, 0}, 3, "CUBICSPLINE");
  expect_place(0, at(1, 0, 0));
  expect_place(2, at(5, 0, 0));
  // At a quarter: 0.84375 p + 2 * 0.140625 * 3 + 0.15625 q - 2 * 0.046875 * -2.
  expect_place(0.5, at(0.84375f + 0.84375f + 0.78125f + 0.1875f, 0, 0));
}

TEST_F(Clips, TurnTheShortWay) {
  const float half = float(std::numbers::sqrt2 / 2);
  // From no turn to a quarter about z; the second quaternion is the negative one of that.
  move("rotation", {0, 1}, {0, 0, 0, 1, 0, 0, -half, -half}, 4);
  const auto turned = [](double angle) {
    const auto c = float(std::cos(angle)), s = float(std::sin(angle));
    return Transform{c, -s, 0, 0, s, c, 0, 0, 0, 0, 1, 0};
  };
  expect_place(1, turned(std::numbers::pi / 2));
  expect_place(1.0 / 3, turned(std::numbers::pi / 6));
  move("scale", {0, 1}, {1, 1, 1, 3, 3, 3}, 3);
  Transform both = turned(std::numbers::pi / 4);
  for (const size_t i : {0, 1, 2, 4, 5, 6, 8, 9, 10}) both[i] *= 2;
  expect_place(0.5, both);
}

TEST_F(Clips, SetWeightsOfMorphTargets) {
  const std::vector<mesh::Float3> up(cube().positions.size(), {0, 4, 0}), left(up.size(), {-2, 0, 0});
  gltf_.json["meshes"][0]["primitives"][0]["targets"] = {{{"POSITION", gltf_.positions(up)}},
                                                         {{"POSITION", gltf_.positions(left)}}};
  move("weights", {0, 1}, {0, 1, 1, 0}, 1);
  const mesh::Scene scene = read(0.25);
  for (size_t i = 0; i < up.size(); ++i) {
    EXPECT_NEAR(scene.meshes[0].positions[i][0], cube().positions[i][0] - 1.5f, 1e-6);
    EXPECT_NEAR(scene.meshes[0].positions[i][1], cube().positions[i][1] + 1.0f, 1e-6);
  }
}

TEST_F(Clips, AreFoundByNumberAndPointTheWay) {
  move("translation", {0}, {7, 0, 0}, 3);
  clip().erase("name");
  EXPECT_EQ(read(0, "0").instances[0].transform, at(7, 0, 0));
  clip()["channels"][0]["target"] = {
      {"extensions", {{"KHR_animation_pointer", {{"pointer", "/nodes/0/translation"}}}}},
      {"path", "pointer"}};
  EXPECT_EQ(read(0, "0").instances[0].transform, at(7, 0, 0));
  EXPECT_EQ(mesh::read("a.glb", gltf_.glb()).instances[0].transform, mesh::kIdentity);
}

TEST_F(Clips, AreListed) {
  move("translation", {0.5f, 2}, {0, 0, 0, 1, 1, 1}, 3);
  move("scale", {1, 3}, {1, 1, 1, 2, 2, 2}, 3);
  gltf_.json["animations"].push_back(
      {{"name", "broken"}, {"channels", clip()["channels"]}, {"samplers", {json::object()}}});
  gltf_.json["animations"].push_back(clip());
  json& late = gltf_.json["animations"][2];
  late["name"] = "late";
  late["samplers"][0]["input"] = 99;
  const mesh::Scene scene = mesh::read("a.glb", gltf_.glb(), {.clips = true});
  ASSERT_EQ(scene.clips.size(), 2u);
  EXPECT_EQ(scene.clips[0].name, "go");
  EXPECT_EQ(scene.clips[0].begin, 0.5);
  EXPECT_EQ(scene.clips[0].end, 3);
  EXPECT_EQ(scene.clips[0].channels, 2u);
  EXPECT_EQ(scene.clips[1].channels, 0u);
  ASSERT_EQ(scene.notes.size(), 1u);
  EXPECT_NE(scene.notes[0].text.find("clip 'late' cannot be read"), std::string::npos) << scene.notes[0].text;
  EXPECT_TRUE(mesh::read("a.glb", gltf_.glb()).clips.empty());
}

TEST_F(Clips, ThatCannotBeReadAreRefused) {
  expect_refused(Status::malformed_mesh, "clip 'go' moves nothing");
  move("translation", {0, 1}, {0, 0, 0, 1, 1, 1}, 3);
  expect_refused(Status::usage, "has no clip 'walk', but: go", "walk");
  expect_refused(Status::usage, "has no clip '1', but: go", "1");
  const Gltf fine = gltf_;
  const auto refused = [&](const std::string& part, const auto& change) {
    gltf_ = fine;
    change();
    expect_refused(Status::malformed_mesh, part);
  };
  const auto instead = [&](const std::vector<float>& times, const std::vector<float>& values) {
    clip()["samplers"] = json::array();
    clip()["channels"] = json::array();
    move("translation", times, values, 3);
  };
  const float nan = std::numeric_limits<float>::quiet_NaN();
  refused("no times of keys", [&] { instead({1, 1}, {0, 0, 0, 1, 1, 1}); });
  refused("no times of keys", [&] { instead({0, nan}, {0, 0, 0, 1, 1, 1}); });
  refused("no times of keys", [&] { instead({}, {}); });
  refused("2 keys for node 0, and 3 numbers instead of 6", [&] { instead({0, 1}, {0, 0, 0}); });
  refused("not finite", [&] { instead({0, 1}, {nan, 0, 0, 1, 1, 1}); });
  refused("moves node 9, but there are only 1", [&] { clip()["channels"][0]["target"]["node"] = 9; });
  refused("has a matrix",
          [&] { gltf_.json["nodes"][0]["matrix"] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}; });
  refused("channels that cannot be read", [&] { clip()["samplers"][0]["interpolation"] = "WOBBLE"; });
  refused("channels that cannot be read", [&] { clip()["channels"][0]["sampler"] = 7; });
  refused("has a type that keys of animations cannot have",
          [&] { clip()["channels"][0]["target"]["path"] = "rotation"; });
  gltf_ = fine;
  gltf_.json.erase("animations");
  expect_refused(Status::usage, "has no clip 'go', nor any other");
  try {
    mesh::read("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", {.moment = mesh::Moment{"go", 0}});
    ADD_FAILURE();
  } catch (const Error& error) {
    EXPECT_EQ(error.status(), Status::usage);
  }
}

}  // namespace
}  // namespace nif::test
