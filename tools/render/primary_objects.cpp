// Transforms each ray into the space of every instance and queries the scalar reference, without a BVH.
// Normals are transformed back by cofactors, and flipped for mirroring transforms.
#include "tools/render/primary_objects.hpp"

#include <fmt/format.h>

#include <cmath>
#include <limits>

#include "bake/ground_truth/ray_sets.hpp"
#include "formats/base/status.hpp"
#include "kernels/reference/spherical/primary.hpp"

namespace nif::render {

void PrimaryObjects::add(const ObjectDescription& object, const std::string& place) {
  assets_.push_back(std::make_unique<const Asset>(*object.nif));
  const format::AssetView& asset = assets_.back()->view;
  const auto add_instance = [&](uint32_t index, const mesh::Transform& own) {
    const format::PrimaryView* primary = asset.primary_of(index);
    const format::ObjectView& about = asset.objects[index];
    if (primary == nullptr)
      throw Error(Status::malformed_scene,
                  fmt::format("{0}: 'primary' is true, but object '{2}' of {1} has no field for primary "
                              "rays; bake one with nif bake --primary",
                              place, *object.nif, about.name));
    const mesh::Transform placed = mesh::compose(object.transform, own);
    const double size = std::cbrt(std::abs(mesh::determinant(placed)));
    if (size == 0) return;
    std::array<Double3, 3> normals = mesh::rows_of(mesh::cofactors(placed));
    if (mesh::determinant(placed) < 0)
      for (Double3& row : normals) row = row * -1;
    const double diagonal = 2 / double(primary->field.distance_scale);
    instances_.push_back({&primary->field,
                          mesh::ToObject(placed),
                          normals,
                          {object.albedo, double(about.bias) * size, diagonal * size, true}});
  };
  asset.for_each_placed([&](uint32_t index, const format::InstanceView* instance) {
    add_instance(index, instance ? instance->transform : mesh::kIdentity);
  });
}

std::optional<SurfacePoint> PrimaryObjects::trace(const Double3& origin, const Double3& direction,
                                                  double farthest) const {
  std::optional<SurfacePoint> nearest;
  for (const Instance& instance : instances_) {
    const kernels::PrimaryAnswer answer = kernels::query_primary(
        *instance.field,
        bake::make_segment(instance.to_object.point(origin), instance.to_object.direction(direction),
                           static_cast<float>(nearest ? nearest->distance : farthest)));
    if (!answer.hit) continue;
    const Double3 normal = mesh::product(instance.normals, to_double(std::to_array(answer.normal)));
    nearest = {origin + direction * double(answer.start), normal * (1 / length(normal)), double(answer.t),
               instance.kind};
  }
  return nearest;
}

}  // namespace nif::render
