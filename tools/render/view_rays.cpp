// Follows the renderer's own paths, and keeps a ray once for each instance whose AABB it meets, in object
// space. Rows are generated in parallel and joined in order.
#include "tools/render/view_rays.hpp"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <filesystem>
#include <limits>

#include "formats/base/status.hpp"
#include "tools/render/paths.hpp"

namespace nif::render {
namespace {

/// Whether the segment meets the box or passes close to it. Other segments are not used for training.
bool meets(const mesh::Box& box, const Segment& s) {
  const double slack = 1e-5 * box.diagonal();
  double enter = double(s.tmin), leave = double(s.tmax);
  for (size_t a = 0; a < 3; ++a) {
    const double low = double(box.min[a]) - slack - double(s.origin[a]),
                 high = double(box.max[a]) + slack - double(s.origin[a]);
    const double d = double(s.direction[a]);
    if (d == 0) {
      if (low > 0 || high < 0) return false;
      continue;
    }
    enter = std::max(enter, std::min(low / d, high / d));
    leave = std::min(leave, std::max(low / d, high / d));
  }
  return enter <= leave;
}

}  // namespace

ViewRays::ViewRays(const SceneDescription& scene, const World& world, const Lighting& lighting,
                   const std::string& mesh, const mesh::Scene& meshes)
    : scene_(scene), world_(world), lighting_(lighting) {
  for (const ObjectDescription& object : scene.objects) {
    std::error_code none;
    if (!std::filesystem::equivalent(object.mesh, mesh, none)) continue;
    for (const mesh::Instance& instance : meshes.instances) {
      const mesh::Transform place = mesh::compose(object.transform, instance.transform);
      if (mesh::determinant(place) == 0) continue;
      const mesh::Mesh& own = meshes.meshes[instance.mesh];
      placements_.push_back(
          {instance.mesh, mesh::ToObject(place), mesh::bounds(own.positions, own.triangles)});
    }
  }
  if (placements_.empty())
    throw Error(Status::usage,
                fmt::format("{}: no object of this scene uses {}, the mesh to bake", scene.file, mesh));
}

template <class Ask>
bake::MeshRays ViewRays::collect(const Ask& ask) const {
  const PictureDescription& picture = scene_.picture;
  const uint32_t rows = picture.height * uint32_t(scene_.cameras.size());
  std::vector<Camera> cameras;
  for (const CameraDescription& camera : scene_.cameras)
    cameras.push_back(place_camera(camera, world_.box(), scene_.up, picture.width, picture.height));
  std::vector<bake::MeshRays> parts(rows);
  tbb::parallel_for(uint32_t{0}, rows, [&](uint32_t row) {
    const uint32_t y = row % picture.height;
    const Paths paths(world_, lighting_, cameras[row / picture.height], picture);
    bake::MeshRays& part = parts[row];
    const auto keep = [&](const Double3& origin, const Double3& direction, float tmax) {
      for (const Placement& placement : placements_) {
        const Segment own = bake::make_segment(placement.to_object.point(origin),
                                               placement.to_object.direction(direction), tmax);
        if (!meets(placement.box, own)) continue;
        part.segments.push_back(own);
        part.meshes.push_back(placement.mesh);
      }
    };
    for (uint32_t x = 0; x < picture.width; ++x) ask(paths, paths.samples_of(x, y), x, y, keep);
  });
  bake::MeshRays all;
  for (const bake::MeshRays& part : parts) {
    all.segments.insert(all.segments.end(), part.segments.begin(), part.segments.end());
    all.meshes.insert(all.meshes.end(), part.meshes.begin(), part.meshes.end());
  }
  return all;
}

bake::MeshRays ViewRays::draw(uint64_t round) const {
  return collect(
      [&](const Paths& paths, const PixelSamples& numbers, uint32_t x, uint32_t y, const auto& keep) {
        paths.follow(
            numbers, uint32_t(round), x, y,
            [&](const ShadowRay& ray) {
              const Segment& s = ray.segment;
              keep(Double3{s.origin[0], s.origin[1], s.origin[2]},
                   Double3{s.direction[0], s.direction[1], s.direction[2]}, s.tmax);
            },
            [](const Double3&, const Colour&) {});
      });
}

bake::MeshRays ViewRays::draw_primary(uint64_t round) const {
  return collect(
      [&](const Paths& paths, const PixelSamples& numbers, uint32_t x, uint32_t y, const auto& keep) {
        const CameraRay ray = paths.camera_ray(numbers, uint32_t(round), x, y);
        keep(ray.origin, ray.direction, std::numeric_limits<float>::infinity());
      });
}

}  // namespace nif::render
