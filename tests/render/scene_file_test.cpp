// Scene files: what they say, and that a mistake in one is named with its line and field.
#include "tools/render/scene_file.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "formats/base/status.hpp"
#include "tests/support/temp_dir.hpp"

namespace nif::render {
namespace {

constexpr const char* kSmall =
    "[[object]]\nmesh = 'a.ply'\n[[light]]\ntype = 'sky'\n[[camera]]\nname = 'front'\n";

class SceneFile : public testing::Test {
 protected:
  SceneDescription read(const std::string& text) { return read_scene(folder_.write("scene.toml", text)); }
  /// The message that refuses a scene.
  std::string refusal(const std::string& text, Status status = Status::malformed_scene) {
    try {
      read(text);
    } catch (const Error& error) {
      EXPECT_EQ(error.status(), status) << error.what();
      return error.what();
    }
    ADD_FAILURE() << "accepted: " << text;
    return "";
  }
  void expect_refusal(const std::string& text, const std::string& fragment) {
    const std::string sentence = refusal(text);
    EXPECT_NE(sentence.find("scene.toml"), std::string::npos) << sentence;
    EXPECT_NE(sentence.find(fragment), std::string::npos) << "'" << fragment << "' in: " << sentence;
    EXPECT_EQ(sentence.find('\n'), std::string::npos) << sentence;
  }

  const test::TempDir folder_;
};

TEST_F(SceneFile, DefaultsFillWhatIsLeftOut) {
  const SceneDescription scene = read(kSmall);
  EXPECT_EQ(scene.up, 1);
  EXPECT_EQ(scene.picture.width, 960u);
  EXPECT_EQ(scene.picture.samples, 16u);
  EXPECT_FALSE(scene.picture.exposure);
  EXPECT_FALSE(scene.ground);
  ASSERT_EQ(scene.objects.size(), 1u);
  EXPECT_EQ(scene.objects[0].mesh, (folder_.path() / "a.ply").string());
  EXPECT_FALSE(scene.objects[0].nif);
  EXPECT_EQ(scene.objects[0].transform, mesh::kIdentity);
  EXPECT_TRUE(scene.objects[0].lights);
  EXPECT_TRUE(scene.objects[0].cameras);
  EXPECT_FALSE(scene.objects[0].primary);
  EXPECT_FALSE(scene.objects[0].mirror);
  ASSERT_EQ(scene.cameras.size(), 1u);
  EXPECT_EQ(scene.cameras[0].name, "front");
  EXPECT_TRUE(std::holds_alternative<Orbit>(scene.cameras[0].where));
}

TEST_F(SceneFile, EverythingIsRead) {
  const SceneDescription scene = read(R"(
up = "z"
[picture]
width = 32
height = 16
samples = 4
bounces = 2
seed = 9
exposure = 2.5
ground_level = 0.5
background = [0.1, 0.2, 0.3]
[ground]
albedo = 0.5
height = -1
size = 3
[[object]]
mesh = "/m.obj"
nif = "m.nif"
albedo = [0.1, 0.2, 0.3]
primary = true
mirror = true
lights = false
cameras = false
scale = 2
rotate = [0, 0, 90]
translate = [1, 2, 3]
[[light]]
type = "sun"
direction = [0, 0, 4]
irradiance = 3
angle = 0.5
[[light]]
type = "sky"
map = "sky.exr"
radiance = [1, 2, 3]
rotation = 45
sampling = "uniform"
[[light]]
type = "area"
corner = [0, 0, 5]
edge_u = [1, 0, 0]
edge_v = [0, 1, 0]
radiance = 7
[[light]]
type = "point"
position = [1, 1, 1]
intensity = [1, 0, 0]
[[light]]
type = "spot"
position = [1, 2, 3]
direction = [0, -2, 0]
intensity = 4
inner_angle = 20
outer_angle = 30
[[camera]]
position = [5, 0, 1]
target = [0, 0, 0]
fov = 30
[[camera]]
azimuth = 10
elevation = -5
fill = 0.6
)");
  EXPECT_EQ(scene.up, 2);
  EXPECT_EQ(scene.picture.bounces, 2u);
  EXPECT_EQ(scene.picture.exposure, 2.5);
  EXPECT_EQ(scene.ground->height, -1.0);
  const ObjectDescription& object = scene.objects[0];
  EXPECT_EQ(object.mesh, "/m.obj");
  EXPECT_EQ(*object.nif, (folder_.path() / "m.nif").string());
  // (1, 0, 0) is scaled to (2, 0, 0), turned to (0, 2, 0) and moved to (1, 4, 3).
  const mesh::Transform& t = object.transform;
  EXPECT_NEAR(t[0] + t[3], 1, 1e-6);
  EXPECT_NEAR(t[4] + t[7], 4, 1e-6);
  EXPECT_NEAR(t[8] + t[11], 3, 1e-6);
  EXPECT_TRUE(object.primary);
  EXPECT_TRUE(object.mirror);
  EXPECT_FALSE(object.lights);
  EXPECT_FALSE(object.cameras);
  ASSERT_EQ(scene.lights.size(), 5u);
  EXPECT_EQ(std::get<Sun>(scene.lights[0]).direction, (Double3{0, 0, 1}));
  EXPECT_EQ(std::get<Sky>(scene.lights[1]).sampling, Sampling::uniform);
  EXPECT_EQ(std::get<AreaLight>(scene.lights[2]).radiance, (Colour{7, 7, 7}));
  EXPECT_EQ(std::get<PointLight>(scene.lights[3]).intensity, (Colour{1, 0, 0}));
  const auto& spot = std::get<SpotLight>(scene.lights[4]);
  EXPECT_EQ(spot.direction, (Double3{0, -1, 0}));
  EXPECT_EQ(spot.inner_angle, 20);
  EXPECT_EQ(spot.outer_angle, 30);
  EXPECT_EQ(scene.cameras[0].name, "camera1");
  EXPECT_EQ(std::get<Place>(scene.cameras[0].where).position, (Double3{5, 0, 1}));
  EXPECT_EQ(std::get<Orbit>(scene.cameras[1].where).fill, 0.6);
}

TEST_F(SceneFile, AGltfIsASceneOfOneObject) {
  for (const char* name : {"a.gltf", "a.glb", "a.GLB", "a.gltf.gz", "a.glb.zst"}) {
    const SceneDescription scene = read_scene(folder_.path() / name);  // not opened yet
    ASSERT_EQ(scene.objects.size(), 1u) << name;
    EXPECT_EQ(scene.objects[0].mesh, (folder_.path() / name).string());
    EXPECT_EQ(scene.up, 1);
  }
  EXPECT_THROW(read_scene(folder_.path() / "a.toml.gz"), Error);
}

TEST_F(SceneFile, MistakesAreNamed) {
  const std::string small = kSmall;
  expect_refusal("[[object]\n", "line 1");
  expect_refusal("", "no object");
  expect_refusal("[[object]]\n" + small, "line 1: object 1: 'mesh' is missing");
  expect_refusal("[[object]]\nmesh = 'a.ply'\nprimary = true\n", "line 3: object 1: 'primary' needs 'nif'");
  expect_refusal(small + "zoom = 2\n", "line 7: camera 1: 'zoom' is unknown here");
  expect_refusal(small + "fov = 500\n", "line 7: camera 1: 'fov' must be from 0.1 to 170");
  expect_refusal(small + "fov = nan\n", "'fov' must be from");
  expect_refusal(small + "position = [1, 2]\ntarget = [0, 0, 0]\n", "'position' must be three numbers");
  expect_refusal(small + "position = [1, 2, 3]\n", "'target' is missing");
  expect_refusal(small + "position = [1, 2, 3]\ntarget = [1, 2, 3]\n",
                 "'target' is the camera's own position");
  expect_refusal(small + "[[camera]]\nname = 'front'\n", "used by another camera");
  expect_refusal(small + "[[camera]]\nname = '../x'\n", "usable as a file name");
  expect_refusal("up = 'w'\n" + small, "'up' must be");
  expect_refusal(small + "[picture]\nwidth = 0\n", "'width' must be a whole number from 1 to 16384");
  expect_refusal(small + "[picture]\nheight = 1e3\n", "'height' must be a whole number");
  expect_refusal(small + "[picture]\nsamples = -1\n", "'samples' must be");
  expect_refusal(small + "[[light]]\ntype = 'laser'\n",
                 "is 'laser'; it must be sun, sky, area, point or spot");
  const std::string spot =
      small + "[[light]]\ntype = 'spot'\nposition = [0,0,0]\nintensity = 1\ndirection = ";
  expect_refusal(spot + "[0,0,0]\n", "'direction' must not be zero");
  expect_refusal(spot + "[0,0,1]\ninner_angle = 50\n", "'inner_angle' is larger than 'outer_angle'");
  expect_refusal(spot + "[0,0,1]\nouter_angle = 91\n", "'outer_angle' must be from 0.01 to 90");
  expect_refusal(spot + "[0,0,1]\nouter_angle = 0\n", "'outer_angle' must be from 0.01 to 90");
  expect_refusal("[[object]]\nmesh = 'a.glb'\nlights = 1\n" + small, "'lights' must be true or false");
  expect_refusal("[[object]]\nmesh = 'a.glb'\ncameras = 'no'\n" + small, "'cameras' must be true or false");
  expect_refusal(small + "[[light]]\ntype = 'sun'\ndirection = [0, 0, 0]\n", "'direction' must not be zero");
  expect_refusal(small + "[[light]]\ntype = 'sky'\nradiance = -1\n", "'radiance' must be from 0");
  expect_refusal(small + "[[light]]\ntype = 'sky'\nradiance = ['a', 1, 1]\n",
                 "'radiance' must contain only numbers");
  expect_refusal(
      small +
          "[[light]]\ntype = 'area'\ncorner = [0,0,0]\nedge_u = [1,0,0]\nedge_v = [2,0,0]\nradiance = 1\n",
      "spans no area");
  expect_refusal(small + "[[object]]\nmesh = 'b'\nscale = 2\ntransform = [1,0,0,0,0,1,0,0,0,0,1,0]\n",
                 "together with 'transform'");
  expect_refusal(small + "[[light]]\ntype = 'sky'\nglow = {direction = [0, 1, 0]}\n",
                 "glow: 'radiance' is missing");
  expect_refusal(
      small + "[[light]]\ntype = 'sky'\nmap = 'a.exr'\nglow = {direction = [0, 1, 0], radiance = 1}\n",
      "together with 'map'");
  expect_refusal(small + "[ground]\nalbedo = 2\n", "'albedo' must be from 0 to 1");
  expect_refusal("object = 3\n", "'object' must be an array of tables");
  expect_refusal("ground = 3\n" + small, "'ground' must be a table");
}

TEST_F(SceneFile, FilesThatCannotBeRead) {
  EXPECT_THROW(read_scene(folder_.path() / "none.toml"), Error);
  EXPECT_THROW(read_scene(folder_.path()), Error);
  refusal(std::string("\0\xff\xfe garbage", 11));
}

/// No prefix of a scene crashes the reader.
TEST_F(SceneFile, Truncations) {
  const std::string text = std::string(kSmall) + "[picture]\nwidth = 20 # ü\n";
  size_t refused = 0;
  for (size_t size = 0; size < text.size(); ++size) {
    try {
      read(text.substr(0, size));
    } catch (const Error&) {
      ++refused;
    }
  }
  EXPECT_GT(refused, text.size() / 2);
}

}  // namespace
}  // namespace nif::render
