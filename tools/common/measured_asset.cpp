// Reads the mesh as the bake read it, and refuses it if counts, triangles or bounds differ from the asset's:
// errors against another mesh would mean nothing.
#include "tools/common/measured_asset.hpp"

#include <fmt/format.h>

#include "formats/base/status.hpp"
#include "tools/common/baked_scene.hpp"
#include "tools/common/naming.hpp"
#include "tools/common/segment_query.hpp"

namespace nif::tools {
namespace {

/// Whether the asset can have been baked from this mesh, as far as one can tell.
bool match(const NifObjectInfo& object, const bake::Prepared& prepared) {
  bool same = object.triangles == prepared.triangle_count();
  if (object.source_triangles != 0)
    same = same && object.source_triangles == prepared.source->triangles.size();
  for (int a = 0; a < 3; ++a) {
    same = same && object.bounds_min[a] == prepared.box.min[a] && object.bounds_max[a] == prepared.box.max[a];
  }
  return same;
}

}  // namespace

MeasuredAsset::MeasuredAsset(const std::string& asset, const std::string& mesh,
                             const std::string& configuration, Progress& progress, const std::string& format)
    : path_(asset), mesh_file_(mesh), configuration_(configuration) {
  const NifError error = nifNewDevice(configuration.c_str(), nullptr, &device_.handle);
  if (error == NIF_ERROR_INVALID_ARGUMENT || error == NIF_ERROR_NOT_AVAILABLE)
    throw Error(Status::usage, nifGetErrorMessage());
  check(error);
  device_info_.struct_size = sizeof(device_info_);
  check(nifGetDeviceInfo(device_.handle, &device_info_));
  check(nifLoadAssetFile(device_.handle, asset.c_str(), NIF_LOAD_COPY, &asset_.handle));
  check(nifNewDevice("isa=scalar", nullptr, &reference_device_.handle));
  check(nifLoadAssetFile(reference_device_.handle, asset.c_str(), NIF_LOAD_COPY, &reference_asset_.handle));
  info_.struct_size = sizeof(info_);
  check(nifGetAssetInfo(asset_.handle, &info_));

  progress.update(0, "reading " + shown_name(mesh));
  limits_ = limits_as_baked(metadata_of(info_), asset);
  limits_.format = format;
  scene_ = mesh::read(mesh, limits_);
  check_alpha(scene_, metadata_of(info_), asset, shown_name(mesh));
  if (auto merged = merged_as_baked(scene_, metadata_of(info_), asset, mesh)) scene_ = *std::move(merged);
  prepared_ = naming(mesh, [&] { return bake::prepare(scene_, false, limits_.skins); });
  const size_t count = prepared_.objects.size();
  std::vector<NifObjectInfo> objects;
  for (uint32_t i = 0; i < info_.object_count; ++i) {
    NifObjectInfo object{};
    object.struct_size = sizeof(object);
    check(nifGetObjectInfo(asset_.handle, i, &object));
    if (object.level != 0) continue;
    if (*object.unsupported)
      throw Error(Status::unsupported_nif,
                  fmt::format("{}: object '{}' {}", asset, object.name, object.unsupported));
    numbers_.push_back(i);
    objects.push_back(object);
  }
  if (objects.size() != count) {
    throw Error(Status::mesh_mismatch,
                fmt::format("{} was not baked from {}: it has {} objects, but the mesh file has {}", asset,
                            shown_name(mesh), objects.size(), count));
  }
  for (uint32_t i = 0; i < count; ++i) {
    const NifObjectInfo& object = objects[i];
    const bake::Prepared& prepared = prepared_.objects[i];
    if (!match(object, prepared)) {
      throw Error(Status::mesh_mismatch,
                  fmt::format("{} was not baked from {}: object '{}' has {} triangles and mesh '{}' has {}, "
                              "or their bounds differ",
                              asset, mesh, object.name, object.triangles, prepared.source->name,
                              prepared.triangle_count()));
    }
    names_.emplace_back(object.name);
    proves_.push_back(object.proves != 0);
    has_source_triangles_.push_back(object.source_triangles != 0);
    any_spherical_ = any_spherical_ || object.encoding == NIF_ENCODING_SPHERICAL;
  }
}

std::vector<bake::Placed> MeasuredAsset::instances() const {
  std::vector<bake::Placed> placed;
  for (const uint32_t i : prepared_.instances) {
    const mesh::Instance& instance = scene_.instances[i];
    placed.push_back({prepared_.object_of[instance.mesh], instance.transform});
  }
  return placed;
}

uint64_t MeasuredAsset::gpu_bytes() const {
  NifAssetInfo info{};
  info.struct_size = sizeof(info);
  check(nifGetAssetInfo(asset_.handle, &info));
  return info.gpu_bytes;
}

uint64_t MeasuredAsset::triangles() const {
  uint64_t sum = 0;
  for (const bake::Prepared& object : prepared_.objects) sum += object.triangle_count();
  return sum;
}

namespace {

Scene scene_of(const Device& device, const Asset& asset, uint32_t object) {
  Scene scene;
  check(nifNewScene(device.handle, &scene.handle));
  check(nifAddInstance(scene.handle, asset.handle, object, nullptr, nullptr));
  check(nifCommitScene(scene.handle));
  return scene;
}

/// The outputs whose bits are promised to be the same everywhere.
struct ExactAnswers {
  std::vector<uint8_t> visible, certain;
  std::vector<int32_t> logit;
  ExactAnswers(NifScene scene, std::span<const kernels::Segment> segments)
      : visible(segments.size()), certain(segments.size()), logit(segments.size()) {
    const NifRays rays = rays_of(segments);
    auto answers = nifkit::sized<NifAnswers>();
    answers.visible = visible.data();
    answers.certain = certain.data();
    answers.logit = logit.data();
    check(nifQuery(scene, &rays, &answers));
  }
};

}  // namespace

namespace {

Scene scene_of_all(const Device& device, const Asset& asset) {
  Scene scene;
  check(nifNewScene(device.handle, &scene.handle));
  check(nifAddAsset(scene.handle, asset.handle, nullptr, nullptr, nullptr));
  return scene;
}

}  // namespace

Scene MeasuredAsset::whole() const { return scene_of_all(device_, asset_); }
Scene MeasuredAsset::whole_by_reference() const { return scene_of_all(reference_device_, reference_asset_); }

std::vector<Scene> MeasuredAsset::each_alone(uint32_t threads) const {
  const std::string configuration =
      fmt::format("{}{}threads={}", configuration_, configuration_.empty() ? "" : ",", threads);
  Device device;
  Asset asset;
  check(nifNewDevice(configuration.c_str(), nullptr, &device.handle));
  check(nifLoadAssetFile(device.handle, path_.c_str(), NIF_LOAD_COPY, &asset.handle));
  std::vector<Scene> scenes;
  for (const uint32_t object : numbers_) scenes.push_back(scene_of(device, asset, object));
  return scenes;
}

Scene MeasuredAsset::alone(size_t object) const { return scene_of(device_, asset_, numbers_[object]); }

Scene MeasuredAsset::alone_by_reference(size_t object) const {
  return scene_of(reference_device_, reference_asset_, numbers_[object]);
}

bake::Answerer runtime_answerer(NifScene scene) {
  return [scene](std::span<const kernels::Segment> segments, const bake::Answers& answers) {
    const NifRays rays = rays_of(segments);
    auto to = nifkit::sized<NifAnswers>();
    to.visible = answers.visible;
    to.certain = answers.certain;
    to.probability = answers.probability;
    check(nifQuery(scene, &rays, &to));
  };
}

bake::Answerer comparing_answerer(NifScene scene, NifScene reference, std::atomic<uint64_t>& different) {
  return [answer = runtime_answerer(scene), scene, reference, &different](
             std::span<const kernels::Segment> segments, const bake::Answers& answers) {
    answer(segments, answers);
    const ExactAnswers ours(scene, segments), theirs(reference, segments);
    uint64_t count = 0;
    for (size_t i = 0; i < segments.size(); ++i)
      count += ours.visible[i] != theirs.visible[i] || ours.certain[i] != theirs.certain[i] ||
               ours.logit[i] != theirs.logit[i] || answers.visible[i] != ours.visible[i];
    different += count;
  };
}

}  // namespace nif::tools
