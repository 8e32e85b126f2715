// Hits report instances by number, so kinds_ must follow the order in which nifAddAsset() adds instances: one
// for each instance of the file, or one for each object of level 0 if it has no instances.
#include "tools/render/asset_scene.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "formats/base/status.hpp"
#include "formats/mesh/box.hpp"
#include "formats/mesh/transform.hpp"
#include "tools/common/clip_frames.hpp"
#include "tools/common/segment_query.hpp"

namespace nif::render {
namespace {

bool knows_first_hits(uint32_t encoding) {
  return encoding == NIF_ENCODING_SEGMENT || encoding == NIF_ENCODING_BVH || encoding == NIF_ENCODING_EXACT ||
         encoding == NIF_ENCODING_CUTOUT;
}

SurfaceKind kind_of(const ObjectDescription& object, const NifObjectInfo& about,
                    const mesh::Transform& place) {
  mesh::Box box;
  std::copy_n(about.bounds_min, 3, box.min.begin());
  std::copy_n(about.bounds_max, 3, box.max.begin());
  const double size = std::cbrt(std::abs(mesh::determinant(place)));
  return {.albedo = object.albedo,
          .bias = double(about.bias) * size,
          .diagonal = box.diagonal() * size,
          .primary = false,
          .mirror = object.mirror,
          .asset = true};
}

}  // namespace

AssetScene::AssetScene(const std::string& configuration) {
  const NifError error = nifNewDevice(configuration.c_str(), nullptr, &runtime_.handle);
  if (error == NIF_ERROR_INVALID_ARGUMENT || error == NIF_ERROR_NOT_AVAILABLE)
    throw Error(Status::usage, nifGetErrorMessage());
  tools::check(error);
  tools::check(nifNewScene(runtime_.handle, &scene_.handle));
}

AssetScene::Added AssetScene::add(const ObjectDescription& object) {
  tools::Asset asset;
  tools::check(nifLoadAssetFile(runtime_.handle, object.nif->c_str(), NIF_LOAD_COPY, &asset.handle));
  NifAssetInfo info{};
  info.struct_size = sizeof(info);
  tools::check(nifGetAssetInfo(asset.handle, &info));
  Added added{tools::metadata_of(info), {}, 0};
  for (uint32_t i = 0; i < info.object_count; ++i) {
    NifObjectInfo about{};
    about.struct_size = sizeof(about);
    tools::check(nifGetObjectInfo(asset.handle, i, &about));
    added.objects.push_back(about);
    if (!no_first_hits_ && about.level == 0 && !*about.unsupported && !knows_first_hits(about.encoding))
      no_first_hits_ = fmt::format("object '{}' of {} has an encoding that does not report where rays hit it",
                                   about.name, *object.nif);
  }
  tools::check(nifAddAsset(scene_.handle, asset.handle, object.transform.data(), &added.first, nullptr));
  for (uint32_t i = 0; i < info.instance_count; ++i) {
    NifAssetInstanceInfo about{};
    about.struct_size = sizeof(about);
    tools::check(nifGetAssetInstanceInfo(asset.handle, i, &about));
    mesh::Transform own;
    std::copy_n(about.transform, own.size(), own.begin());
    kinds_.push_back(kind_of(object, added.objects[about.object], mesh::compose(object.transform, own)));
  }
  if (info.instance_count == 0 && !info.places_nothing)
    for (const NifObjectInfo& about : added.objects)
      if (about.level == 0) kinds_.push_back(kind_of(object, about, object.transform));
  asset_bytes_ += info.file_bytes;
  resident_bytes_ += info.resident_bytes;
  assets_.push_back(std::move(asset));
  return added;
}

void AssetScene::pose(const Added& added, std::span<const mesh::PosedInstance> instances,
                      const mesh::Transform& outer) {
  tools::pose_instances(scene_.handle, added.first, instances, outer);
}

void AssetScene::commit() { tools::check(nifCommitScene(scene_.handle)); }

void AssetScene::ask(std::span<const Segment> rays, const Answers& answers) const {
  if (rays.empty()) return;
  const NifRays asked = tools::rays_of(rays);
  auto to = nifkit::sized<NifAnswers>();
  to.visible = answers.visible;
  to.probability = answers.probability;
  to.certain = answers.certain;
  tools::check(nifQuery(scene_.handle, &asked, &to));
}

void AssetScene::intersect(std::span<const Segment> rays, std::span<std::optional<SurfacePoint>> hits) const {
  if (rays.empty()) return;
  std::vector<float> t(rays.size());
  std::vector<std::array<float, 3>> normal(rays.size());
  std::vector<uint32_t> instance(rays.size());
  NifHits found{};
  found.struct_size = sizeof(found);
  found.t = t.data();
  found.normal = normal.front().data();
  found.instance = instance.data();
  const NifRays asked = tools::rays_of(rays);
  tools::check(nifIntersect(scene_.handle, &asked, &found));
  for (size_t i = 0; i < rays.size(); ++i) {
    hits[i].reset();
    if (instance[i] == NIF_NONE) continue;
    const Double3 origin = to_double(std::to_array(rays[i].origin)),
                  direction = to_double(std::to_array(rays[i].direction));
    hits[i] = SurfacePoint{origin + direction * double(t[i]), to_double(normal[i]), double(t[i]),
                           kinds_[instance[i]]};
  }
}

}  // namespace nif::render
