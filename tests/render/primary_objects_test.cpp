// Camera rays that fields answer: placed as the meshes are, nearest first, and compared with Embree's
// answers.
#include "tools/render/primary_objects.hpp"

#include <gtest/gtest.h>
#include <tbb/task_arena.h>

#include <cmath>

#include "bake/bake.hpp"
#include "formats/base/output_file.hpp"
#include "formats/base/status.hpp"
#include "formats/mesh/read.hpp"
#include "formats/nif/writer.hpp"
#include "tests/cli/mesh_text.hpp"
#include "tests/support/temp_dir.hpp"
#include "tests/support/test_shapes.hpp"
#include "tools/common/progress.hpp"
#include "tools/render/lighting.hpp"
#include "tools/render/renderer.hpp"
#include "tools/render/view_rays.hpp"

namespace nif::render {
namespace {

class PrimaryScenes : public testing::Test {
 protected:
  void SetUp() override { mesh_ = folder_.write("ball.obj", test::obj_text(test::icosphere(3))).string(); }

  SceneDescription scene_with(const mesh::Transform& place) const {
    SceneDescription scene;
    scene.file = "scene.toml";
    scene.picture.width = 64;
    scene.picture.height = 48;
    scene.picture.samples = 500;
    scene.objects.emplace_back().mesh = mesh_;
    scene.objects[0].transform = place;
    scene.lights.push_back(Sun{{0.6, 0.8, 0}, {2, 2, 2}, 0});
    scene.cameras.push_back({.name = "c", .where = Orbit{.azimuth = 20, .elevation = 35, .fill = 0.7}});
    return scene;
  }
  static std::unique_ptr<World> make_world(SceneDescription& scene) {
    tools::Progress quiet(true);
    std::vector<std::string> notes;
    ObjectMeshes meshes = read_meshes(scene, {}, notes, quiet);
    return std::make_unique<World>(scene, std::move(meshes), "queries=8", quiet);
  }
  /// Trained on the scene's camera.
  std::string bake(SceneDescription scene, bool with_primary = true) const {
    const auto world = make_world(scene);
    const Lighting lighting(scene);
    const mesh::Scene meshes = mesh::read(mesh_);
    const ViewRays rays(scene, *world, lighting, mesh_, meshes);
    bake::BakeOptions options;
    options.encoding = "spherical";
    options.evaluation_rays = 0;
    options.spherical.fields.primary.resolution = 32;
    options.spherical.given = bake::GivenRays{
        "a view", scene.picture.samples, [&](uint64_t round) { return rays.draw(round); }, {}};
    if (with_primary)
      options.spherical.given->draw_primary = [&](uint64_t round) { return rays.draw_primary(round); };
    const std::atomic<bool> cancel{false};
    const std::string path = (folder_.path() / "ball.nif").string();
    write_output(path, format::encode(bake::bake(meshes, options, {}, cancel).asset));
    return path;
  }
  static Rendering render_scene(const SceneDescription& scene, const World& world) {
    const Lighting lighting(scene);
    const Camera camera =
        place_camera(scene.cameras[0], world.box(), scene.up, scene.picture.width, scene.picture.height);
    const std::atomic<bool> cancel{false};
    return render(
        world, lighting, camera, {scene.picture, 1}, [](double, const std::function<Rendering()>&) {},
        cancel);
  }

  const test::TempDir folder_;
  std::string mesh_;
};

/// Moved, rotated, scaled by 3 and mirrored.
constexpr mesh::Transform kMirrored{0, 0, 3, 10, 0, 3, 0, -2, 3, 0, 0, 7};

TEST_F(PrimaryScenes, FieldsStandWhereTheirMeshesStand) {
  for (const mesh::Transform& place : {mesh::kIdentity, kMirrored}) {
    SceneDescription scene = scene_with(place);
    scene.objects[0].nif = bake(scene);
    EXPECT_FALSE(make_world(scene)->has_primaries());
    scene.objects[0].primary = true;
    const auto world = make_world(scene);
    ASSERT_TRUE(world->has_primaries());
    ASSERT_TRUE(world->assets().no_first_hits());  // fields for primary rays do not count
    EXPECT_NE(world->assets().no_first_hits()->find("ball.nif"), std::string::npos);

    scene.picture.samples = 4;
    scene.picture.seed = 2;
    const Rendering rendering = render_scene(scene, *world);
    const CameraRays& rays = rendering.camera_rays;
    EXPECT_EQ(rays.rays, 64u * 48 * 4);
    EXPECT_GT(rays.hits, rays.rays / 10);
    EXPECT_LT(double(rays.differ), 0.02 * double(rays.rays));
    EXPECT_GT(rays.both, rays.hits * 9 / 10);
    EXPECT_LT(rays.depth_error / double(rays.both), 0.01);
    EXPECT_LT(rays.normal_error / double(rays.both), 8);
    EXPECT_FALSE(rendering.images[size_t(Mode::primary)].values.empty());
    EXPECT_EQ(rendering.normals[0].values.size(), 3u * 64 * 48);

    // The same for one thread and two; shadow rays do not depend on it either.
    Rendering alone;
    tbb::task_arena(1).execute([&] { alone = render_scene(scene, *world); });
    EXPECT_EQ(alone.camera_rays.depth_error, rays.depth_error);
    EXPECT_EQ(alone.camera_rays.normal_error, rays.normal_error);
    for (const Mode mode : kModes)
      EXPECT_EQ(alone.images[size_t(mode)].values, rendering.images[size_t(mode)].values) << name_of(mode);
    scene.objects[0].primary = false;
    const Rendering plain = render_scene(scene, *make_world(scene));
    EXPECT_TRUE(plain.images[size_t(Mode::primary)].values.empty());
    EXPECT_TRUE(plain.normals[0].values.empty());
    for (const Mode mode : {Mode::reference, Mode::bits, Mode::probability, Mode::hybrid})
      EXPECT_EQ(plain.images[size_t(mode)].values, rendering.images[size_t(mode)].values) << name_of(mode);
  }
}

TEST_F(PrimaryScenes, TheNearestHitCounts) {
  SceneDescription scene = scene_with(mesh::kIdentity);
  scene.objects[0].nif = bake(scene);
  scene.objects[0].primary = true;
  const Camera camera = place_camera(scene.cameras[0], make_world(scene)->box(), 1, 64, 48);
  const Double3 along = camera.direction(0.5, 0.5);
  // A small ball between camera and object, then behind the object.
  const Double3 middle = camera.position + along * length(camera.position);
  ASSERT_LT(length(middle), 0.1);
  for (const double where : {-0.5, 0.5}) {
    SceneDescription both = scene;
    ObjectDescription& other = both.objects.emplace_back();
    other.mesh = mesh_;
    const Double3 at = along * (where * length(camera.position));
    for (size_t a = 0; a < 3; ++a) {
      other.transform[5 * a] = 0.1f;
      other.transform[4 * a + 3] = float(at[a]);
    }
    const auto world = make_world(both);
    const auto hit = world->trace_by_fields(camera.position, along);
    ASSERT_TRUE(hit);
    EXPECT_EQ(hit->kind.primary, where > 0);
    const auto exact = world->trace(camera.position, along);
    ASSERT_TRUE(exact);
    EXPECT_EQ(exact->kind.primary, hit->kind.primary);
    EXPECT_NEAR(exact->distance, hit->distance, 0.05);
    EXPECT_LE(length(hit->position - camera.position), hit->distance + 1e-6);
  }
}

TEST_F(PrimaryScenes, AnAssetWithoutAFieldIsRefused) {
  SceneDescription scene = scene_with(mesh::kIdentity);
  scene.picture.samples = 64;
  scene.objects[0].nif = bake(scene, false);
  scene.objects[0].primary = true;
  try {
    make_world(scene);
    FAIL() << "accepted";
  } catch (const Error& error) {
    const std::string sentence = error.what();
    EXPECT_EQ(error.status(), Status::malformed_scene);
    for (const char* part : {"scene.toml: object 1: 'primary'", "ball.nif", "--primary"})
      EXPECT_NE(sentence.find(part), std::string::npos) << "'" << part << "' in: " << sentence;
    EXPECT_EQ(sentence.find('\n'), std::string::npos);
  }
}

}  // namespace
}  // namespace nif::render
