// Holds meshes in Embree. Beware: Embree's BVH may differ with the number of threads, so the first build
// takes one thread to make bakes repeatable. Callbacks of Embree's device collect its error messages and
// count its bytes.
#include "bake/ground_truth/embree_scene.hpp"

#include <embree3/rtcore.h>
#include <tbb/task_arena.h>

#include <cstring>
#include <new>

#include "formats/base/status.hpp"

namespace nif::bake {

std::string embree_version() {
  RTCDevice device = rtcNewDevice(nullptr);
  const long version = long(rtcGetDeviceProperty(device, RTC_DEVICE_PROPERTY_VERSION));
  rtcReleaseDevice(device);
  return std::to_string(version / 10000) + "." + std::to_string(version / 100 % 100) + "." +
         std::to_string(version % 100);
}

void throw_no_device() {
  if (rtcGetDeviceError(nullptr) == RTC_ERROR_OUT_OF_MEMORY) throw std::bad_alloc();
  throw Error(Status::internal, "Embree cannot create a device on this machine");
}

void EmbreeScene::Release::operator()(RTCDeviceTy* device) const { rtcReleaseDevice(device); }
void EmbreeScene::Release::operator()(RTCSceneTy* scene) const { rtcReleaseScene(scene); }

void EmbreeScene::make_device() {
  device_.reset(rtcNewDevice(nullptr));
  RTCDevice device = device_.get();
  if (!device) throw_no_device();
  rtcSetDeviceErrorFunction(
      device, [](void* user, RTCError, const char* text) { static_cast<EmbreeScene*>(user)->error_ = text; },
      this);
  rtcSetDeviceMemoryMonitorFunction(
      device,
      [](void* user, ssize_t bytes, bool) {
        static_cast<EmbreeScene*>(user)->bytes_ += bytes;
        return true;
      },
      this);
}

EmbreeScene::ScenePointer EmbreeScene::make_scene(EmbreeBuild build) {
  ScenePointer scene(rtcNewScene(device_.get()));
  switch (build) {
    case EmbreeBuild::robust:
      rtcSetSceneFlags(scene.get(), RTC_SCENE_FLAG_ROBUST);
      break;
    case EmbreeBuild::compact:
      rtcSetSceneFlags(scene.get(), RTC_SCENE_FLAG_COMPACT);
      break;
    case EmbreeBuild::high:
      rtcSetSceneBuildQuality(scene.get(), RTC_BUILD_QUALITY_HIGH);
      break;
    case EmbreeBuild::refitted:
      rtcSetSceneFlags(scene.get(), RTC_SCENE_FLAG_DYNAMIC);
      rtcSetSceneBuildQuality(scene.get(), RTC_BUILD_QUALITY_LOW);  // others rebuild, whatever the mesh says
      break;
    case EmbreeBuild::standard:
      break;
  }
  return scene;
}

void EmbreeScene::add_triangles(RTCScene scene, const EmbreeObject& object, EmbreeBuild build,
                                HoleTest test) {
  HolesFilter* const filter = filters_.emplace_back(HolesFilter::make(object, test)).get();
  if (filter) filter_bytes_ += int64_t(filter->bytes());
  const int64_t before = bytes_;
  RTCGeometry geometry = rtcNewGeometry(device_.get(), RTC_GEOMETRY_TYPE_TRIANGLE);
  auto* vertices = static_cast<float*>(rtcSetNewGeometryBuffer(
      geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 12, object.positions.size()));
  auto* indices = static_cast<uint32_t*>(rtcSetNewGeometryBuffer(
      geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 12, object.triangles.size()));
  if (!vertices || !indices) {
    rtcReleaseGeometry(geometry);
    throw Error(Status::out_of_memory,
                "Embree cannot hold " + std::to_string(object.triangles.size()) + " triangles: " + error_);
  }
  std::memcpy(vertices, object.positions.data(), object.positions.size() * 12);
  std::memcpy(indices, object.triangles.data(), object.triangles.size() * 12);
  buffers_ += bytes_ - before;
  if (filter) filter->attach(geometry);
  if (build == EmbreeBuild::refitted) rtcSetGeometryBuildQuality(geometry, RTC_BUILD_QUALITY_REFIT);
  rtcCommitGeometry(geometry);
  rtcAttachGeometry(scene, geometry);
  rtcReleaseGeometry(geometry);
  commit_alone(scene, std::to_string(object.triangles.size()) + " triangles");
}

void EmbreeScene::commit_alone(RTCScene scene, const std::string& what) {
  // On one thread: with more, the order of triangles within a leaf may vary, and with it which of two
  // triangles is reported for a hit on their common edge. A bake must not depend on that.
  tbb::task_arena(1).execute([&] { rtcCommitScene(scene); });
  if (!error_.empty() || rtcGetDeviceError(device_.get()) != RTC_ERROR_NONE)
    throw Error(Status::out_of_memory, "Embree cannot build a BVH over " + what + ": " + error_);
}

EmbreeScene::EmbreeScene(const EmbreeObject& object, EmbreeBuild build, HoleTest test) {
  make_device();
  scene_ = make_scene(build);
  add_triangles(scene_.get(), object, build, test);
}

EmbreeScene::EmbreeScene(std::span<const EmbreeObject> objects, std::span<const Placed> instances,
                         EmbreeBuild build, HoleTest test) {
  make_device();
  for (const EmbreeObject& object : objects) {
    objects_.push_back(make_scene(build));
    add_triangles(objects_.back().get(), object, build, test);
  }
  scene_ = make_scene(build);
  for (const Placed& placed : instances) {
    RTCGeometry geometry = rtcNewGeometry(device_.get(), RTC_GEOMETRY_TYPE_INSTANCE);
    rtcSetGeometryInstancedScene(geometry, objects_.at(placed.object).get());
    rtcSetGeometryTransform(geometry, 0, RTC_FORMAT_FLOAT3X4_ROW_MAJOR, placed.transform.data());
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene_.get(), geometry);
    rtcReleaseGeometry(geometry);
  }
  commit_alone(scene_.get(), std::to_string(instances.size()) + " instances");
}

void EmbreeScene::move(uint32_t instance, const mesh::Transform& transform) {
  RTCGeometry geometry = rtcGetGeometry(scene_.get(), instance);
  rtcSetGeometryTransform(geometry, 0, RTC_FORMAT_FLOAT3X4_ROW_MAJOR, transform.data());
  rtcCommitGeometry(geometry);
}

void EmbreeScene::move_vertices(std::span<const mesh::Float3> positions) {
  RTCGeometry geometry = rtcGetGeometry(scene_.get(), 0);
  std::memcpy(rtcGetGeometryBufferData(geometry, RTC_BUFFER_TYPE_VERTEX, 0), positions.data(),
              positions.size_bytes());
  rtcUpdateGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0);
  rtcCommitGeometry(geometry);
}

void EmbreeScene::commit() { rtcCommitScene(scene_.get()); }

}  // namespace nif::bake
