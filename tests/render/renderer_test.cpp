// Whole pictures: against what can be computed by hand, and the same for any number of threads.
#include "tools/render/renderer.hpp"
#include "bake/ground_truth/ray_sets.hpp"

#include <gtest/gtest.h>
#include <tbb/task_arena.h>

#include <cmath>
#include <memory>
#include <numbers>

#include "formats/base/status.hpp"
#include "tests/cli/mesh_text.hpp"
#include "tests/support/gltf.hpp"
#include "tests/support/temp_dir.hpp"
#include "tests/support/test_shapes.hpp"
#include "tools/common/progress.hpp"
#include "tools/render/compare_pictures.hpp"
#include "tools/render/scene_file.hpp"

namespace nif::render {
namespace {

class Renderer : public testing::Test {
 protected:
  /// A sphere of radius 1 that stands on white ground.
  SceneDescription sphere_on_ground(Light light) {
    SceneDescription scene;
    scene.picture.width = 48;
    scene.picture.height = 32;
    scene.picture.samples = 4;
    scene.objects.emplace_back().mesh =
        folder_.write("sphere.obj", test::obj_text(test::icosphere(3))).string();
    scene.ground = GroundDescription{};
    scene.lights.push_back(std::move(light));
    scene.cameras.push_back({.name = "c", .where = Orbit{.azimuth = 20, .elevation = 35, .fill = 0.5}});
    return scene;
  }
  /// Completes the scene.
  static std::unique_ptr<World> make_world(SceneDescription& scene, const std::string& configuration = "") {
    tools::Progress quiet(true);
    std::vector<std::string> notes;
    ObjectMeshes meshes = read_meshes(scene, {}, notes, quiet);
    EXPECT_TRUE(notes.empty());
    return std::make_unique<World>(scene, std::move(meshes), configuration, quiet);
  }
  Rendering render_scene(SceneDescription scene) {
    const auto owned = make_world(scene, "queries=8");
    const World& world = *owned;
    const Lighting lighting(scene);
    const Camera camera =
        place_camera(scene.cameras[0], world.box(), scene.up, scene.picture.width, scene.picture.height);
    const std::atomic<bool> cancel{false};
    return render(
        world, lighting, camera, {scene.picture, find_exposure(scene, world, lighting)},
        [](double, const std::function<Rendering()>&) {}, cancel);
  }
  const Image& reference(const Rendering& rendering) { return rendering.images[size_t(Mode::reference)]; }

  const test::TempDir folder_;
};

TEST_F(Renderer, LitGroundIsShownAtItsLevel) {
  const Rendering rendering = render_scene(sphere_on_ground(Sun{{0, 1, 0}, {2, 2, 2}, 0}));
  const Image shown = srgb_encoded(reference(rendering));
  EXPECT_NEAR(shown.at(1, 31)[0], 0.8, 1e-3);  // lower left corner: ground far from the sphere
  EXPECT_GT(rendering.shadow_rays.rays, 0u);
  EXPECT_TRUE(rendering.images[size_t(Mode::bits)].values.empty());
}

/// Under a sky, distant ground sees the whole upper half; ground right below a sphere sees nothing.
TEST_F(Renderer, SkyIsHiddenBelowTheSphere) {
  SceneDescription scene = sphere_on_ground(Sky{});
  scene.picture.samples = 64;
  scene.cameras[0].where = Place{{0.2, -0.97, 0.001}, {0.05, -1, 0}};
  const Image shown = srgb_encoded(reference(render_scene(scene)));
  double darkest = 1;
  for (size_t i = 0; i < shown.values.size(); ++i) darkest = std::min(darkest, double(shown.values[i]));
  EXPECT_LT(darkest, 0.2);
}

TEST_F(Renderer, SunCastsAShadowWhereItShould) {
  SceneDescription scene = sphere_on_ground(Sun{Double3{0.6, 0.8, 0}, {2, 2, 2}, 0});
  // From above: the shadow lies towards -x.
  scene.cameras[0].where = Place{{0, 12, 0}, {0, 0, 0}};
  const auto owned = make_world(scene);
  const World& world = *owned;
  uint8_t visible[2];
  const Segment rays[] = {bake::make_segment({-1.6, -0.99, 0}, {0.6, 0.8, 0}, 1e30f),
                          bake::make_segment({1.6, -0.99, 0}, {0.6, 0.8, 0}, 1e30f)};
  world.ask_embree(rays, visible);
  EXPECT_EQ(visible[0], 0);
  EXPECT_EQ(visible[1], 1);
}

TEST_F(Renderer, BouncesAddLight) {
  SceneDescription scene = sphere_on_ground(Sun{{0, 1, 0}, {2, 2, 2}, 0});
  scene.picture.samples = 16;
  const auto mean = [&] {
    double sum = 0;
    const Rendering rendering = render_scene(scene);
    for (const float value : reference(rendering).values) sum += double(value);
    return sum;
  };
  const double direct = mean();
  scene.picture.bounces = 3;
  EXPECT_GT(mean(), 1.01 * direct);
}

TEST_F(Renderer, SameForAnyNumberOfThreads) {
  SceneDescription scene = sphere_on_ground(Sky{});
  scene.picture.samples = 6;
  scene.picture.bounces = 1;
  Rendering one, two;
  tbb::task_arena(1).execute([&] { one = render_scene(scene); });
  tbb::task_arena(2).execute([&] { two = render_scene(scene); });
  EXPECT_EQ(reference(one).values, reference(two).values);
  scene.picture.seed = 2;
  EXPECT_NE(reference(render_scene(scene)).values, reference(one).values);
}

TEST_F(Renderer, InstancesStandWhereTheirTransformsSay) {
  SceneDescription scene = sphere_on_ground(Sun{{0, 1, 0}, {2, 2, 2}, 0});
  scene.objects[0].transform = {2, 0, 0, 10, 0, 2, 0, 0, 0, 0, -2, 0};  // mirrored
  scene.ground.reset();
  const auto owned = make_world(scene);
  const World& world = *owned;
  EXPECT_NEAR(world.box().max[0], 12, 1e-5);
  const auto hit = world.trace({10, 50, 0.001}, {0, -1, 0});
  ASSERT_TRUE(hit);
  EXPECT_NEAR(hit->position[1], 2, 0.01);
  EXPECT_NEAR(hit->normal[1], 1, 0.05);
  EXPECT_NEAR(hit->kind.bias, 2 * 2 * 1e-3, 1e-4);
  EXPECT_FALSE(world.trace({0, 50, 0}, {0, -1, 0}));
}

TEST_F(Renderer, OrbitsShowTheBoxAsLargeAsAsked) {
  SceneDescription scene = sphere_on_ground(Sky{});
  const mesh::Box box{{-1, -1, -1}, {1, 1, 1}};
  for (const double fill : {0.3, 0.9}) {
    const Camera camera = place_camera({"c", Orbit{0, 0, fill}, 40}, box, 1, 100, 100);
    // From the front, the upper edge of the near face is highest.
    const double distance = length(camera.position) - 1;
    EXPECT_NEAR(1 / distance / std::tan(20 * std::numbers::pi / 180), fill, 1e-6);
  }
}

TEST_F(Renderer, ViewsLookAlongTheirLineAndMayRoll) {
  const double fov = 90;
  const Camera camera = place_camera({"c", View{{1, 2, 3}, {0, 0, -1}, {1, 0, 0}}, fov}, {}, 1, 200, 100);
  EXPECT_EQ(camera.position, (Double3{1, 2, 3}));
  const auto expect_near = [](const Double3& a, const Double3& b) {
    for (size_t k = 0; k < 3; ++k) EXPECT_NEAR(a[k], b[k], 1e-12) << k;
  };
  expect_near(camera.direction(0.5, 0.5), {0, 0, -1});
  // A quarter turn to the left: the picture's upper edge is at +x, its right edge at -y.
  const double half = std::sqrt(0.5), wide = std::sqrt(0.2);
  expect_near(camera.direction(0.5, 0), {half, 0, -half});
  expect_near(camera.direction(1, 0.5), {0, -2 * wide, -wide});
  // "up" need not be perpendicular to the view.
  const Camera leaning =
      place_camera({"c", View{{1, 2, 3}, {0, 0, -1}, {0.6, 0, -0.8}}, fov}, {}, 1, 200, 100);
  expect_near(leaning.direction(0.5, 0), {half, 0, -half});
}

TEST_F(Renderer, ASpotLightsItsCone) {
  SceneDescription scene = sphere_on_ground(SpotLight{{6, 3, 0}, {0, -1, 0}, {5, 5, 5}, 5, 10});
  scene.picture.exposure = 1;
  // The ground below the spot light, from above: lit in the middle, dark at the edges.
  scene.cameras[0].where = Place{{6, 3, 0}, {6, -1, 0}};
  const Image picture = reference(render_scene(scene));
  EXPECT_NEAR(picture.at(24, 16)[0], 5.0 / 16 * 0.8 / std::numbers::pi, 1e-3);
  EXPECT_EQ(picture.at(1, 1)[0], 0);
}

/// The same camera and lights, from a scene file and from a mesh file.
TEST_F(Renderer, GltfGivesThePictureOfTheSceneThatSaysTheSame) {
  constexpr double kDegrees = 180 / std::numbers::pi;
  test::Gltf gltf = test::gltf_of(test::cube());
  // From (3, 0, 4) along (-0.6, 0, -0.8).
  const double turn = std::atan2(0.6, 0.8) / 2;
  gltf.camera({{"type", "perspective"}, {"perspective", {{"yfov", 0.8}}}},
              {{"translation", {3, 0, 4}}, {"rotation", {0, std::sin(turn), 0, std::cos(turn)}}});
  gltf.light({{"type", "directional"}, {"intensity", 2}});
  gltf.light({{"type", "spot"}, {"intensity", 9}, {"spot", {{"outerConeAngle", 0.6}}}},
             {{"translation", {0, 4, 0}}, {"rotation", {-std::sqrt(0.5), 0, 0, std::sqrt(0.5)}}});
  SceneDescription scene = read_scene(folder_.write("a.glb", gltf.glb()));
  scene.picture.width = 64;
  scene.picture.height = 48;
  const Image by_gltf = srgb_encoded(reference(render_scene(scene)));

  scene.objects[0].lights = scene.objects[0].cameras = false;
  scene.lights = {Sun{{0, 0, 1}, {2, 2, 2}, 0},
                  SpotLight{{0, 4, 0}, {0, -1, 0}, {9, 9, 9}, 0, 0.6 * kDegrees}};
  scene.cameras = {{"c", Place{{3, 0, 4}, {0, 0, 0}}, 0.8 * kDegrees}};
  const Image by_scene = srgb_encoded(reference(render_scene(scene)));
  EXPECT_GT(psnr(by_gltf, by_scene), 50);
  // Both lights are visible.
  scene.lights.pop_back();
  EXPECT_LT(psnr(by_gltf, srgb_encoded(reference(render_scene(scene)))), 40);
}

TEST_F(Renderer, Cancelled) {
  SceneDescription scene = sphere_on_ground(Sky{});
  const auto owned = make_world(scene);
  const World& world = *owned;
  const Lighting lighting(scene);
  const Camera camera = place_camera(scene.cameras[0], world.box(), 1, 48, 32);
  const std::atomic<bool> cancel{true};
  EXPECT_THROW(
      render(
          world, lighting, camera, {scene.picture}, [](double, const std::function<Rendering()>&) {}, cancel),
      Error);
}

}  // namespace
}  // namespace nif::render
