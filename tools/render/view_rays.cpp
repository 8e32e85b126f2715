#include "tools/render/view_rays.hpp"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <filesystem>

#include "formats/status.hpp"
#include "tools/render/paths.hpp"
#include "tools/render/transform.hpp"

namespace nif::render {
namespace {

using bake::dot;

/// Does the segment meet the box, or pass it closely? What does not is no training ray.
bool meets(const bake::Box& box, const Segment& s) {
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
      const mesh::Transform place = compose(object.transform, instance.transform);
      if (determinant(place) == 0) continue;
      Placement placement;
      placement.mesh = instance.mesh;
      placement.inverse = inverse_rows(place);
      placement.origin = {place[3], place[7], place[11]};
      const mesh::Mesh& own = meshes.meshes[instance.mesh];
      placement.box = bake::bounds(own.positions, own.triangles);
      placements_.push_back(placement);
    }
  }
  if (placements_.empty())
    throw Error(Status::usage,
                fmt::format("{}: no object of this scene is {}, which is to be baked", scene.file, mesh));
}

bake::MeshRays ViewRays::draw(uint64_t round) const {
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
    for (uint32_t x = 0; x < picture.width; ++x)
      paths.follow(
          paths.samples_of(x, y), uint32_t(round), x, y,
          [&](const ShadowRay& ray) {
            for (const Placement& placement : placements_) {
              const Segment& s = ray.segment;
              const Double3 from = Double3{s.origin[0], s.origin[1], s.origin[2]} - placement.origin;
              const Double3 along{s.direction[0], s.direction[1], s.direction[2]};
              Double3 origin, direction;
              for (size_t a = 0; a < 3; ++a) {
                origin[a] = dot(placement.inverse[a], from);
                direction[a] = dot(placement.inverse[a], along);
              }
              const Segment own = bake::make_segment(origin, direction, s.tmax);
              if (!meets(placement.box, own)) continue;
              part.segments.push_back(own);
              part.meshes.push_back(placement.mesh);
            }
          },
          [](const Double3&) {});
  });
  bake::MeshRays all;
  for (const bake::MeshRays& part : parts) {
    all.segments.insert(all.segments.end(), part.segments.begin(), part.segments.end());
    all.meshes.insert(all.meshes.end(), part.meshes.begin(), part.meshes.end());
  }
  return all;
}

}  // namespace nif::render
