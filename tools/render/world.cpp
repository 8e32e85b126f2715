// Builds up to three Embree scenes: everything, the objects without assets, and the objects without primary
// fields. Commits run on one thread: with more, which of two triangles is hit on their common edge may vary.
#include "tools/render/world.hpp"

#include <embree3/rtcore.h>
#include <fmt/format.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <set>

#include "bake/ground_truth/prepare.hpp"
#include "bake/ground_truth/ray_sets.hpp"
#include "formats/base/status.hpp"
#include "formats/mesh/poser.hpp"
#include "tools/common/baked_scene.hpp"
#include "tools/common/progress.hpp"

namespace nif::render {
namespace {

using mesh::Transform;

constexpr float kInfinity = std::numeric_limits<float>::infinity();

RTCRay to_ray(const Segment& segment) {
  RTCRay ray;
  ray.org_x = segment.origin[0], ray.org_y = segment.origin[1], ray.org_z = segment.origin[2];
  ray.dir_x = segment.direction[0], ray.dir_y = segment.direction[1], ray.dir_z = segment.direction[2];
  ray.tnear = segment.tmin, ray.tfar = segment.tmax;
  ray.time = 0;
  ray.mask = ~0u;
  ray.id = 0;
  ray.flags = 0;
  return ray;
}

/// Embree builds with assertions abort on other rays.
bool is_ray(const Segment& segment) {
  constexpr float kLargest = 1.8e18f;
  bool within = true;
  for (size_t a = 0; a < 3; ++a)
    within = within && std::abs(segment.origin[a]) <= kLargest && std::abs(segment.direction[a]) <= kLargest;
  return within;
}

/// Invalid rays hit nothing.
void ask(RTCScene scene, std::span<const Segment> rays, uint8_t* visible) {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  for (size_t i = 0; i < rays.size(); ++i) {
    visible[i] = true;
    if (!is_ray(rays[i])) continue;
    RTCRay ray = to_ray(rays[i]);
    rtcOccluded1(scene, &context, &ray);
    visible[i] = ray.tfar != -kInfinity;
  }
}

/// Without the triangles that let all light through.
std::shared_ptr<const mesh::Scene> without_clear(std::shared_ptr<const mesh::Scene> meshes) {
  if (std::ranges::all_of(meshes->meshes, [](const mesh::Mesh& mesh) { return mesh.alpha.empty(); }))
    return meshes;
  mesh::Scene blocking = *meshes;
  mesh::drop_clear(blocking);
  return std::make_shared<const mesh::Scene>(std::move(blocking));
}

}  // namespace

void World::Release::operator()(RTCDeviceTy* device) const { rtcReleaseDevice(device); }
void World::Release::operator()(RTCSceneTy* scene) const { rtcReleaseScene(scene); }

World::World(const SceneDescription& scene, ObjectMeshes object_meshes, const std::string& configuration,
             tools::Progress& progress)
    : device_(rtcNewDevice(nullptr)), assets_(configuration) {
  if (!device_) throw Error(Status::internal, "Embree cannot create a device on this machine");
  rtcSetDeviceErrorFunction(
      device_.get(), [](void* user, RTCError, const char* text) { static_cast<World*>(user)->error_ = text; },
      this);
  rtcSetDeviceMemoryMonitorFunction(
      device_.get(),
      [](void* user, ssize_t bytes, bool) {
        static_cast<World*>(user)->embree_bytes_ += bytes;
        return true;
      },
      this);
  std::vector<EmbreePointer*> tops{&everything_, &beside_assets_};
  if (std::any_of(scene.objects.begin(), scene.objects.end(), [](const auto& o) { return o.primary; }))
    tops.push_back(&beside_primaries_);
  for (EmbreePointer* top : tops) {
    top->reset(rtcNewScene(device_.get()));
    rtcSetSceneFlags(top->get(), RTC_SCENE_FLAG_ROBUST);
  }
  box_.min.fill(kInfinity);
  box_.max.fill(-kInfinity);

  progress.begin();
  for (size_t i = 0; i < scene.objects.size(); ++i) {
    const ObjectDescription& object = scene.objects[i];
    progress.update(double(i) / double(scene.objects.size()), "building a BVH over " + object.mesh);
    std::shared_ptr<const mesh::Scene> owned = std::move(object_meshes.at(i));
    owned = object.nif ? add_asset(object, std::move(owned)) : without_clear(std::move(owned));
    const mesh::Scene& meshes = *owned;
    std::vector<std::vector<Transform>> places(meshes.meshes.size());
    for (const mesh::Instance& instance : meshes.instances) {
      const Transform place = mesh::compose(object.transform, instance.transform);
      if (mesh::determinant(place) != 0) places[instance.mesh].push_back(place);
    }
    for (size_t m = 0; m < meshes.meshes.size(); ++m) add_mesh(meshes.meshes[m], places[m], object);
    if (object.primary) primaries_.add(object, fmt::format("{}: object {}", scene.file, i + 1));
  }
  if (scene.ground) add_ground(scene);
  // On one thread: with more, which of two triangles is hit on their common edge may vary.
  tbb::task_arena(1).execute([&] {
    for (EmbreePointer* top : tops) rtcCommitScene(top->get());
  });
  // Beyond this, products of three coordinates overflow in Embree's triangle test, and so do its hits.
  constexpr double kFarthest = 1e12;
  double farthest = 0;
  for (size_t a = 0; a < 3; ++a)
    farthest = std::max({farthest, std::abs(double(box_.min[a])), std::abs(double(box_.max[a])), reach_});
  if (!(farthest <= kFarthest))
    throw Error(Status::too_large,
                fmt::format("{}: reaches to {:.3g} from the origin, but pictures show only what "
                            "lies within {:.0e}",
                            scene.file, farthest, kFarthest));
  if (!error_.empty()) throw Error(Status::out_of_memory, "Embree cannot build the scene's BVH: " + error_);
  assets_.commit();
}

World::~World() = default;

void World::add_mesh(const mesh::Mesh& mesh, std::span<const Transform> places,
                     const ObjectDescription& object) {
  if (places.empty()) return;
  const mesh::Box own = mesh::bounds(mesh.positions, mesh.triangles);
  const Answered answered{object.nif.has_value(), object.primary};
  for (const Transform& place : places) {
    box_.add(mesh::bounds(own, place));
    const double size = std::cbrt(std::abs(mesh::determinant(place)));
    parts_.push_back({{object.albedo, double(bake::bias_of(mesh, own)) * size, own.diagonal() * size,
                       object.primary, object.mirror, object.nif.has_value()},
                      mesh::cofactors(place)});
  }
  if (object.nif)
    for (const Transform& place : places) asset_boxes_.push_back({own, mesh::ToObject(place)});
  triangles_ += mesh.triangles.size() * places.size();
  if (places.size() == 1) {
    std::vector<mesh::Float3> positions(mesh.positions.size());
    std::transform(mesh.positions.begin(), mesh.positions.end(), positions.begin(),
                   [&](const mesh::Float3& p) { return mesh::transformed(places[0], p); });
    bake::EmbreeObject placed(mesh);
    placed.positions = positions;
    add_triangles(placed, answered);
    return;
  }
  EmbreePointer child(rtcNewScene(device_.get()));
  rtcSetSceneFlags(child.get(), RTC_SCENE_FLAG_ROBUST);
  RTCGeometry geometry = make_geometry(mesh);
  rtcAttachGeometry(child.get(), geometry);
  rtcReleaseGeometry(geometry);
  tbb::task_arena(1).execute([&] { rtcCommitScene(child.get()); });
  for (const Transform& place : places) {
    RTCGeometry instance = rtcNewGeometry(device_.get(), RTC_GEOMETRY_TYPE_INSTANCE);
    rtcSetGeometryInstancedScene(instance, child.get());
    rtcSetGeometryTransform(instance, 0, RTC_FORMAT_FLOAT3X4_ROW_MAJOR, place.data());
    attach(instance, answered);
  }
  children_.push_back(std::move(child));
}

RTCGeometryTy* World::make_geometry(const bake::EmbreeObject& object) {
  const auto& positions = object.positions;
  const auto& triangles = object.triangles;
  bake::HolesFilter* const filter =
      filters_.emplace_back(bake::HolesFilter::make(object, bake::HoleTest::exact)).get();
  RTCGeometry geometry = rtcNewGeometry(device_.get(), RTC_GEOMETRY_TYPE_TRIANGLE);
  void* vertices =
      rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 12, positions.size());
  void* indices =
      rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 12, triangles.size());
  if (vertices == nullptr || indices == nullptr) {
    rtcReleaseGeometry(geometry);
    throw Error(Status::out_of_memory,
                fmt::format("Embree cannot store {} triangles: {}", triangles.size(), error_));
  }
  std::memcpy(vertices, positions.data(), positions.size_bytes());
  std::memcpy(indices, triangles.data(), triangles.size_bytes());
  if (filter) filter->attach(geometry);
  rtcCommitGeometry(geometry);
  return geometry;
}

void World::add_triangles(const bake::EmbreeObject& object, Answered answered) {
  attach(make_geometry(object), answered);
}

void World::attach(RTCGeometryTy* geometry, Answered answered) {
  rtcCommitGeometry(geometry);
  const unsigned number = rtcAttachGeometry(everything_.get(), geometry);
  if (!answered.by_asset) rtcAttachGeometryByID(beside_assets_.get(), geometry, number);
  if (beside_primaries_ && !answered.by_primary)
    rtcAttachGeometryByID(beside_primaries_.get(), geometry, number);
  rtcReleaseGeometry(geometry);
}

void World::add_ground(const SceneDescription& scene) {
  const auto up = size_t(scene.up), a = (up + 1) % 3, b = (up + 2) % 3;
  const double half = scene.ground->size * box_.diagonal() / 2;
  std::vector<mesh::Float3> corners(4);
  for (size_t corner = 0; corner < 4; ++corner) {
    const bool far_a = corner == 1 || corner == 2, far_b = corner >= 2;
    corners[corner][up] = scene.ground->height ? float(*scene.ground->height) : box_.min[up];
    corners[corner][a] = float((double(box_.min[a]) + box_.max[a]) / 2 + (far_a ? half : -half));
    corners[corner][b] = float((double(box_.min[b]) + box_.max[b]) / 2 + (far_b ? half : -half));
  }
  for (const mesh::Float3& corner : corners)
    for (const float x : corner) reach_ = std::max(reach_, std::abs(double(x)));
  const mesh::Triangle triangles[] = {{0, 1, 2}, {0, 2, 3}};
  parts_.push_back(
      {{scene.ground->albedo, double(bake::kBiasFraction) * box_.longest_side()}, mesh::kIdentity});
  add_triangles({corners, triangles}, {});
}

std::shared_ptr<const mesh::Scene> World::add_asset(const ObjectDescription& object,
                                                    std::shared_ptr<const mesh::Scene> meshes) {
  const AssetScene::Added added = assets_.add(object);
  tools::check_alpha(*meshes, added.metadata, *object.nif, object.mesh);
  if (auto merged = tools::merged_as_baked(*meshes, added.metadata, *object.nif, object.mesh))
    meshes = std::make_shared<const mesh::Scene>(*std::move(merged));
  meshes = without_clear(std::move(meshes));
  std::set<std::array<mesh::Float3, 2>> bounds;
  for (const mesh::Mesh& mesh : meshes->meshes) {
    const mesh::Box box = mesh::bounds(mesh.positions, mesh.triangles);
    bounds.insert({box.min, box.max});
  }
  for (const NifObjectInfo& about : added.objects) {
    std::array<mesh::Float3, 2> wanted;
    std::copy_n(about.bounds_min, 3, wanted[0].begin());
    std::copy_n(about.bounds_max, 3, wanted[1].begin());
    if (!bounds.contains(wanted))
      throw Error(Status::mesh_mismatch,
                  fmt::format("{} was not baked from {}: no mesh has the bounds of object '{}'", *object.nif,
                              object.mesh, about.name));
  }
  if (object.moment) return pose_asset(object, added, *meshes);
  return meshes;
}

/// Returns what is there at that moment.
std::shared_ptr<const mesh::Scene> World::pose_asset(const ObjectDescription& object,
                                                     const AssetScene::Added& added,
                                                     const mesh::Scene& meshes) {
  const mesh::Poser poser(object.mesh, meshes, tools::limits_of_asset(*object.nif));
  const std::vector<mesh::PosedInstance> all = poser.at(*object.moment);
  std::vector<mesh::PosedInstance> placed;
  for (const uint32_t i : bake::prepare(meshes).instances) placed.push_back(all[i]);
  assets_.pose(added, placed, object.transform);
  auto posed = std::make_shared<mesh::Scene>(meshes);
  posed->meshes.clear();
  posed->instances.clear();
  for (size_t i = 0; i < all.size(); ++i) {  // each instance has a mesh of its own
    mesh::Instance& instance = posed->instances.emplace_back(meshes.instances[i]);
    mesh::Mesh& mesh = posed->meshes.emplace_back(meshes.meshes[instance.mesh]);
    if (mesh.skin) mesh.positions = mesh::bent(mesh, all[i].joints, all[i].weights);
    instance.mesh = uint32_t(i);
    std::copy(all[i].transform.begin(), all[i].transform.end(), instance.transform.begin());
  }
  return posed;
}

std::optional<SurfacePoint> World::trace(const Double3& origin, const Double3& direction) const {
  return trace(everything_.get(), origin, direction);
}

std::optional<SurfacePoint> World::trace_by_fields(const Double3& origin, const Double3& direction) const {
  const std::optional<SurfacePoint> beside = trace(beside_primaries_.get(), origin, direction);
  const std::optional<SurfacePoint> learned =
      primaries_.trace(origin, direction, beside ? beside->distance : double(kInfinity));
  return learned ? learned : beside;
}

std::optional<SurfacePoint> World::trace(RTCSceneTy* scene, const Double3& origin,
                                         const Double3& direction) const {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  RTCRayHit hit;
  const Segment segment = bake::make_segment(origin, direction, kInfinity);
  if (!is_ray(segment)) return std::nullopt;
  hit.ray = to_ray(segment);
  hit.hit.geomID = hit.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
  rtcIntersect1(scene, &context, &hit);
  if (hit.hit.geomID == RTC_INVALID_GEOMETRY_ID || !std::isfinite(hit.ray.tfar)) return std::nullopt;
  const bool placed = hit.hit.instID[0] != RTC_INVALID_GEOMETRY_ID;
  const Part& part = parts_[placed ? hit.hit.instID[0] : hit.hit.geomID];
  Double3 normal{hit.hit.Ng_x, hit.hit.Ng_y, hit.hit.Ng_z};
  if (placed) normal = mesh::product(mesh::rows_of(part.normals), normal);
  const double size = length(normal);
  if (!(size > 0)) return std::nullopt;
  normal = normal * ((dot(normal, direction) > 0 ? -1 : 1) / size);
  const double t = double(hit.ray.tfar);
  return SurfacePoint{origin + direction * t, normal, t, part.kind};
}

void World::trace_by_assets(std::span<const Segment> rays,
                            std::span<std::optional<SurfacePoint>> hits) const {
  assets_.intersect(rays, hits);
  for (size_t i = 0; i < rays.size(); ++i) {
    const std::optional<SurfacePoint> beside =
        trace(beside_assets_.get(), to_double(std::to_array(rays[i].origin)),
              to_double(std::to_array(rays[i].direction)));
    if (beside && !(hits[i] && hits[i]->distance <= beside->distance)) hits[i] = beside;
  }
}

bool World::starts_in_asset(const Segment& ray) const {
  const Double3 start = to_double({ray.origin[0], ray.origin[1], ray.origin[2]});
  return std::any_of(asset_boxes_.begin(), asset_boxes_.end(), [&](const AssetBox& asset) {
    const Double3 own = asset.to_object.point(start);
    bool inside = true;
    for (size_t a = 0; a < 3; ++a)
      inside = inside && own[a] >= double(asset.box.min[a]) && own[a] <= double(asset.box.max[a]);
    return inside;
  });
}

void World::ask_embree(std::span<const Segment> rays, uint8_t* visible) const {
  ask(everything_.get(), rays, visible);
}

void World::ask_embree_beside_assets(std::span<const Segment> rays, uint8_t* visible) const {
  ask(beside_assets_.get(), rays, visible);
}

}  // namespace nif::render
