// Whole pictures: against what can be computed by hand, and the same for any number of threads.
#include "tools/render/renderer.hpp"

#include <gtest/gtest.h>
#include <tbb/task_arena.h>

#include <cmath>

#include "formats/status.hpp"
#include "tests/cli/mesh_text.hpp"
#include "tests/support/shapes.hpp"
#include "tests/support/temp_dir.hpp"
#include "tools/render/compare.hpp"

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
  Rendering render_scene(const SceneDescription& scene) {
    tools::Progress quiet(true);
    const World world(scene, "queries=8", quiet);
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

/// Under a sky, ground far away sees half of all directions; right below a sphere it sees none.
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
  tools::Progress quiet(true);
  const World world(scene, "", quiet);
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
  tools::Progress quiet(true);
  const World world(scene, "", quiet);
  EXPECT_NEAR(world.box().max[0], 12, 1e-5);
  const auto hit = world.trace({10, 50, 0.001}, {0, -1, 0});
  ASSERT_TRUE(hit);
  EXPECT_NEAR(hit->position[1], 2, 0.01);
  EXPECT_NEAR(hit->normal[1], 1, 0.05);
  EXPECT_NEAR(hit->bias, 2 * 2 * 1e-3, 1e-4);
  EXPECT_FALSE(world.trace({0, 50, 0}, {0, -1, 0}));
}

TEST_F(Renderer, OrbitsShowTheBoxAsLargeAsAsked) {
  SceneDescription scene = sphere_on_ground(Sky{});
  const bake::Box box{{-1, -1, -1}, {1, 1, 1}};
  for (const double fill : {0.3, 0.9}) {
    const Camera camera = place_camera({"c", Orbit{0, 0, fill}, 40}, box, 1, 100, 100);
    // Seen from the front, the near face's upper edge is what stands highest.
    const double distance = bake::length(camera.position) - 1;
    EXPECT_NEAR(1 / distance / std::tan(20 * std::numbers::pi / 180), fill, 1e-6);
  }
}

TEST_F(Renderer, Cancelled) {
  const SceneDescription scene = sphere_on_ground(Sky{});
  tools::Progress quiet(true);
  const World world(scene, "", quiet);
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
