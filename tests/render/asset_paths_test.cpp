// Pictures that assets make alone: those of exact assets are Embree's, and those of fields come close.
#include "tools/render/asset_paths.hpp"

#include <gtest/gtest.h>
#include <tbb/task_arena.h>

#include <cmath>

#include "formats/base/output_file.hpp"
#include "formats/mesh/read.hpp"
#include "formats/nif/writer.hpp"
#include "tests/bake/quiet_bake.hpp"
#include "tests/cli/mesh_text.hpp"
#include "tests/support/temp_dir.hpp"
#include "tests/support/test_shapes.hpp"
#include "tools/common/progress.hpp"
#include "tools/render/compare_pictures.hpp"
#include "tools/render/renderer.hpp"

namespace nif::render {
namespace {

/// Moved, rotated, scaled by 2 and mirrored.
constexpr mesh::Transform kTurnedAndMirrored{0, 0, 2, 3, 0, 2, 0, 1, 2, 0, 0, -1};

class AssetPictures : public testing::Test {
 protected:
  std::string write(const std::string& name, const mesh::Mesh& mesh) const {
    return folder_.write(name, test::obj_text(mesh)).string();
  }
  ObjectDescription object(const std::string& name, const mesh::Mesh& shape,
                           const std::string& encoding) const {
    ObjectDescription object;
    object.mesh = write(name + ".obj", shape);
    bake::BakeOptions options = test::small_field(0.5);
    options.encoding = encoding;
    options.evaluation_rays = 0;
    if (encoding == "bvh") options.resolution.reset();
    object.nif = (folder_.path() / (name + "." + encoding + ".nif")).string();
    write_output(*object.nif, format::encode(test::bake_quietly(mesh::read(object.mesh), options).asset));
    return object;
  }
  static SceneDescription scene_of(std::vector<ObjectDescription> objects) {
    SceneDescription scene;
    scene.file = "scene.toml";
    scene.picture.width = 64;
    scene.picture.height = 48;
    scene.picture.samples = 16;
    scene.objects = std::move(objects);
    scene.lights = {Sun{{0.6, 0.8, 0}, {2, 2, 2}, 1}, Sky{}};
    scene.cameras.push_back({.name = "c", .where = Orbit{.azimuth = 20, .elevation = 35, .fill = 0.8}});
    return scene;
  }
  static Rendering render_scene(SceneDescription& scene) {
    tools::Progress quiet(true);
    std::vector<std::string> notes;
    ObjectMeshes meshes = read_meshes(scene, {}, notes, quiet);
    const World world(scene, std::move(meshes), "queries=8", quiet);
    EXPECT_FALSE(world.assets().no_first_hits()) << *world.assets().no_first_hits();
    EXPECT_GT(world.embree_bytes(), 30 * world.triangles());
    const Lighting lighting(scene);
    const Camera camera =
        place_camera(scene.cameras[0], world.box(), scene.up, scene.picture.width, scene.picture.height);
    const std::atomic<bool> cancel{false};
    RenderOptions options{scene.picture, scene.picture.exposure.value_or(0.3)};
    options.by_assets = true;
    return render(
        world, lighting, camera, options, [](double, const std::function<Rendering()>&) {}, cancel);
  }
  static const Image& reference(const Rendering& rendering) {
    return rendering.images[size_t(Mode::reference)];
  }
  static const Image& by_assets(const Rendering& rendering) { return rendering.images[size_t(Mode::asset)]; }

  const test::TempDir folder_;
};

TEST_F(AssetPictures, ExactAssetsGiveEmbreesPicture) {
  for (const std::string encoding : {"bvh", "exact"}) {
    SceneDescription scene = scene_of({object("ring", test::torus(48, 24), encoding)});
    scene.objects.push_back(object("ball", test::icosphere(3), encoding));
    scene.objects[1].transform = kTurnedAndMirrored;
    scene.objects[1].mirror = true;
    scene.objects[1].albedo = {0.9, 0.8, 0.7};
    scene.ground = GroundDescription{};
    scene.picture.bounces = 1;
    const Rendering rendering = render_scene(scene);
    EXPECT_GT(psnr(srgb_encoded(reference(rendering)), srgb_encoded(by_assets(rendering))), 45) << encoding;
    const CameraRays& rays = rendering.camera_rays;
    EXPECT_EQ(rays.rays, 64u * 48 * 16);
    EXPECT_GT(rays.hits, rays.rays / 10);
    EXPECT_LE(rays.differ, rays.rays / 10000);
    EXPECT_LT(rays.depth_error / double(rays.both), 1e-6);
    EXPECT_LT(rays.normal_error / double(rays.both), 0.01);
    for (const Mode mode : {Mode::bits, Mode::probability, Mode::hybrid, Mode::primary})
      EXPECT_TRUE(rendering.images[size_t(mode)].values.empty()) << name_of(mode);
    EXPECT_EQ(rendering.normals[1].values.size(), 3u * 64 * 48);

    Rendering alone;
    tbb::task_arena(1).execute([&] { alone = render_scene(scene); });
    EXPECT_EQ(by_assets(alone).values, by_assets(rendering).values);
    EXPECT_EQ(alone.camera_rays.normal_error, rays.normal_error);

    // Mirror and bounce have an effect: without them the picture differs.
    scene.objects[1].mirror = false;
    const Rendering dull = render_scene(scene);
    EXPECT_LT(psnr(srgb_encoded(by_assets(dull)), srgb_encoded(by_assets(rendering))), 30);
    scene.picture.bounces = 0;
    const Rendering direct = render_scene(scene);
    EXPECT_LT(psnr(srgb_encoded(by_assets(dull)), srgb_encoded(by_assets(direct))), 40);
  }
}

TEST_F(AssetPictures, FieldsComeClose) {
  SceneDescription scene = scene_of({object("ring", test::torus(48, 24), "segment")});
  scene.objects[0].transform = kTurnedAndMirrored;
  scene.ground = GroundDescription{};
  scene.picture.bounces = 1;
  const Rendering rendering = render_scene(scene);
  EXPECT_GT(psnr(srgb_encoded(reference(rendering)), srgb_encoded(by_assets(rendering))), 27);
  const CameraRays& rays = rendering.camera_rays;
  EXPECT_LT(double(rays.differ), 0.005 * double(rays.rays));
  EXPECT_GT(rays.both, rays.hits * 9 / 10);
  EXPECT_LT(rays.depth_error / double(rays.both), 0.005);
  EXPECT_LT(rays.normal_error / double(rays.both), 12);
}

/// A flat mirror reflects what it sees, times its albedo. Here that is only sky, independent of lights.
TEST_F(AssetPictures, AMirrorShowsTheSky) {
  SceneDescription scene = scene_of({object("cube", test::cube(), "bvh")});
  scene.objects[0].mirror = true;
  scene.objects[0].albedo = {0.5, 0.25, 1};
  Sky sky;
  sky.radiance = {0.8, 0.6, 0.4};
  scene.lights = {sky, Sun{{0, 1, 0}, {5, 5, 5}, 0}};
  scene.picture.exposure = 1;
  scene.cameras[0] = {"c", Place{{0.1, 6, 0.1}, {0, 0, 0}}, 5};  // sees the top alone
  const Rendering rendering = render_scene(scene);
  for (const Image* image : {&reference(rendering), &by_assets(rendering)}) {
    EXPECT_NEAR(image->at(32, 24)[0], 0.5 * 0.8, 1e-5);
    EXPECT_NEAR(image->at(32, 24)[1], 0.25 * 0.6, 1e-5);
    EXPECT_NEAR(image->at(32, 24)[2], 1 * 0.4, 1e-5);
  }
  EXPECT_EQ(rendering.shadow_rays.rays, 0u);
}

/// A path between two parallel mirrors ends and is black.
TEST_F(AssetPictures, ReflectionsEnd) {
  SceneDescription scene = scene_of({object("cube", test::cube(), "bvh")});
  scene.objects[0].mirror = true;
  scene.objects.push_back(scene.objects[0]);
  scene.objects[1].transform[7] = 4;  // above
  scene.picture.exposure = 1;
  scene.cameras[0] = {"c", Place{{0, 2, 0}, {0.001, 0, 0}}, 1};
  const Rendering rendering = render_scene(scene);
  EXPECT_EQ(reference(rendering).at(32, 24)[0], 0);
  EXPECT_EQ(by_assets(rendering).at(32, 24)[0], 0);
}

/// Inside a closed object everything is dark, even with bounces. Inside a ring's box one sees the ring.
TEST_F(AssetPictures, CamerasMayBeInside) {
  SceneDescription scene = scene_of({object("ball", test::icosphere(3), "segment")});
  scene.cameras[0] = {"c", Place{{0.1, 0, 0}, {1, 0, 0}}, 60};
  Rendering rendering = render_scene(scene);
  EXPECT_EQ(rendering.camera_rays.hits, rendering.camera_rays.rays);
  EXPECT_EQ(rendering.camera_rays.differ, 0u);
  EXPECT_GT(psnr(srgb_encoded(reference(rendering)), srgb_encoded(by_assets(rendering))), 40);

  scene = scene_of({object("ring", test::torus(48, 24), "segment")});
  scene.cameras[0] = {"c", Place{{0, 0, 0}, {1, 0.3, 0.2}}, 60};
  rendering = render_scene(scene);
  EXPECT_GT(rendering.camera_rays.hits, rendering.camera_rays.rays / 10);
  EXPECT_LT(double(rendering.camera_rays.differ), 0.02 * double(rendering.camera_rays.rays));
}

}  // namespace
}  // namespace nif::render
