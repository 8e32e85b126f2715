// Training rays from a view: those that a renderer would ask, in the space of the object they are for.
#include "tools/render/view_rays.hpp"

#include <gtest/gtest.h>
#include <tbb/task_arena.h>

#include "formats/base/status.hpp"
#include "formats/mesh/read.hpp"
#include "tests/cli/mesh_text.hpp"
#include "tests/support/temp_dir.hpp"
#include "tests/support/test_shapes.hpp"
#include "tools/common/progress.hpp"
#include "tools/render/scene_meshes.hpp"

namespace nif::render {
namespace {

class Views : public testing::Test {
 protected:
  void SetUp() override {
    mesh_ = folder_.write("sphere.obj", test::obj_text(test::icosphere(2))).string();
    meshes_ = mesh::read(mesh_);
  }
  SceneDescription scene_with(std::vector<mesh::Transform> places) {
    SceneDescription scene;
    scene.file = "scene.toml";
    scene.picture.width = 40;
    scene.picture.height = 30;
    scene.picture.samples = 2;
    for (const mesh::Transform& place : places) {
      ObjectDescription& object = scene.objects.emplace_back();
      object.mesh = mesh_;
      object.transform = place;
    }
    scene.ground = GroundDescription{};
    scene.lights.push_back(Sky{});
    CameraDescription& camera = scene.cameras.emplace_back();
    camera.name = "c";
    camera.where = Orbit{.azimuth = 20, .elevation = 35, .fill = 0.5};
    return scene;
  }
  using Draw = bake::MeshRays (ViewRays::*)(uint64_t) const;
  bake::MeshRays draw(SceneDescription scene, uint64_t round, Draw which = &ViewRays::draw) {
    tools::Progress quiet(true);
    std::vector<std::string> notes;
    ObjectMeshes meshes = read_meshes(scene, {}, notes, quiet);
    const World world(scene, std::move(meshes), "", quiet);
    const Lighting lighting(scene);
    return (ViewRays(scene, world, lighting, mesh_, meshes_).*which)(round);
  }

  const test::TempDir folder_;
  std::string mesh_;
  mesh::Scene meshes_;
};

constexpr mesh::Transform kMoved{0, 0, 3, 10, 0, 3, 0, -2, -3, 0, 0, 7};

TEST_F(Views, RaysMeetTheObjectInItsOwnSpace) {
  const bake::MeshRays rays = draw(scene_with({kMoved}), 0);
  ASSERT_GT(rays.segments.size(), 100u);
  ASSERT_EQ(rays.meshes.size(), rays.segments.size());
  const bake::EmbreeTruth embree(meshes_.meshes[0]);
  size_t on_sphere = 0, blocked = 0;
  for (const Segment& ray : rays.segments) {
    const Double3 origin = to_double({ray.origin[0], ray.origin[1], ray.origin[2]});
    const Double3 direction = to_double({ray.direction[0], ray.direction[1], ray.direction[2]});
    on_sphere += std::abs(length(origin) - 1) < 0.05;
    blocked += embree.occluded(ray);
    // The sphere's box is within a ball of sqrt 3.
    const double along = std::max(0.0, -dot(origin, direction) / dot(direction, direction));
    EXPECT_LT(length(origin + direction * along), 1.75);
  }
  EXPECT_GT(on_sphere, 40u);
  EXPECT_GT(blocked, 20u);                               // from the ground
  EXPECT_LT(blocked, rays.segments.size() - on_sphere);  // a sphere does not block its own rays
}

TEST_F(Views, OneRayForEachBoxThatIsMet) {
  // Two spheres at the same position: every ray counts for both.
  EXPECT_EQ(draw(scene_with({kMoved, kMoved}), 1).segments.size(),
            2 * draw(scene_with({kMoved}), 1).segments.size());
}

TEST_F(Views, RoundsDifferAndThreadsDoNotMatter) {
  const SceneDescription scene = scene_with({mesh::kIdentity});
  bake::MeshRays one, two;
  tbb::task_arena(1).execute([&] { one = draw(scene, 0); });
  tbb::task_arena(2).execute([&] { two = draw(scene, 0); });
  ASSERT_EQ(one.segments.size(), two.segments.size());
  const auto differ = [](const bake::MeshRays& a, const bake::MeshRays& b) {
    for (size_t i = 0; i < std::min(a.segments.size(), b.segments.size()); ++i)
      if (a.segments[i].direction[0] != b.segments[i].direction[0] ||
          a.segments[i].origin[1] != b.segments[i].origin[1])
        return true;
    return false;
  };
  EXPECT_FALSE(differ(one, two));
  EXPECT_TRUE(differ(one, draw(scene, 1)));
}

/// Camera rays: for each camera, one through each pixel that meets the box, with the camera's jitter.
TEST_F(Views, RaysOfTheCamerasThemselves) {
  SceneDescription scene = scene_with({kMoved});
  scene.cameras.push_back(scene.cameras[0]);
  scene.cameras[1].where = Orbit{.azimuth = 200, .elevation = 10, .fill = 0.9};
  const bake::MeshRays rays = draw(scene, 0, &ViewRays::draw_primary);
  const bake::EmbreeTruth embree(meshes_.meshes[0]);
  size_t hits = 0, cameras = 1;
  for (size_t i = 0; i < rays.segments.size(); ++i) {
    const Segment& ray = rays.segments[i];
    cameras += i > 0 && ray.origin[0] != rays.segments[i - 1].origin[0];
    hits += embree.first_hit(ray).has_value();
    EXPECT_TRUE(std::isinf(ray.tmax));
  }
  EXPECT_EQ(cameras, 2u);
  EXPECT_GT(hits, rays.segments.size() / 3);
  EXPECT_LT(hits, rays.segments.size());
  EXPECT_LT(rays.segments.size(), 2u * 40 * 30);
  bake::MeshRays alone;
  tbb::task_arena(1).execute([&] { alone = draw(scene, 0, &ViewRays::draw_primary); });
  ASSERT_EQ(alone.segments.size(), rays.segments.size());
  for (size_t i = 0; i < rays.segments.size(); ++i)
    ASSERT_EQ(alone.segments[i].direction[1], rays.segments[i].direction[1]);
  EXPECT_NE(draw(scene, 1, &ViewRays::draw_primary).segments[0].direction[1], rays.segments[0].direction[1]);
}

TEST_F(Views, SceneWithoutTheMesh) {
  SceneDescription scene = scene_with({mesh::kIdentity});
  scene.objects[0].mesh = folder_.write("other.obj", test::obj_text(test::cube())).string();
  try {
    draw(scene, 0);
    ADD_FAILURE();
  } catch (const Error& error) {
    EXPECT_EQ(error.status(), Status::usage);
    EXPECT_NE(std::string(error.what()).find("scene.toml"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace nif::render
