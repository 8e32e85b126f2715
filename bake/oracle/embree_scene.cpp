#include "bake/oracle/embree_scene.hpp"

#include <embree3/rtcore.h>
#include <tbb/task_arena.h>

#include <cstring>

#include "formats/base/status.hpp"

namespace nif::bake {

std::string embree_version() {
  RTCDevice device = rtcNewDevice(nullptr);
  const long version = long(rtcGetDeviceProperty(device, RTC_DEVICE_PROPERTY_VERSION));
  rtcReleaseDevice(device);
  return std::to_string(version / 10000) + "." + std::to_string(version / 100 % 100) + "." +
         std::to_string(version % 100);
}

void EmbreeScene::Release::operator()(RTCDeviceTy* device) const { rtcReleaseDevice(device); }
void EmbreeScene::Release::operator()(RTCSceneTy* scene) const { rtcReleaseScene(scene); }

EmbreeScene::EmbreeScene(std::span<const mesh::Float3> positions, std::span<const mesh::Triangle> triangles,
                         EmbreeBuild build)
    : device_(rtcNewDevice(nullptr)) {
  RTCDevice device = device_.get();
  if (!device) throw Error(Status::internal, "Embree cannot create a device on this machine");
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
  scene_.reset(rtcNewScene(device));
  RTCScene scene = scene_.get();
  switch (build) {
    case EmbreeBuild::robust:
      rtcSetSceneFlags(scene, RTC_SCENE_FLAG_ROBUST);
      break;
    case EmbreeBuild::compact:
      rtcSetSceneFlags(scene, RTC_SCENE_FLAG_COMPACT);
      break;
    case EmbreeBuild::high:
      rtcSetSceneBuildQuality(scene, RTC_BUILD_QUALITY_HIGH);
      break;
    case EmbreeBuild::standard:
      break;
  }
  RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
  auto* vertices = static_cast<float*>(
      rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 12, positions.size()));
  auto* indices = static_cast<uint32_t*>(
      rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 12, triangles.size()));
  if (!vertices || !indices) {
    rtcReleaseGeometry(geometry);
    throw Error(Status::out_of_memory,
                "Embree cannot hold " + std::to_string(triangles.size()) + " triangles: " + error_);
  }
  std::memcpy(vertices, positions.data(), positions.size() * 12);
  std::memcpy(indices, triangles.data(), triangles.size() * 12);
  buffers_ = bytes_;
  rtcCommitGeometry(geometry);
  rtcAttachGeometry(scene, geometry);
  rtcReleaseGeometry(geometry);
  // On one thread: with more, the order of triangles within a leaf may vary, and with it which of two
  // triangles is reported for a hit on their common edge. A bake must not depend on that.
  tbb::task_arena(1).execute([&] { rtcCommitScene(scene); });
  if (!error_.empty() || rtcGetDeviceError(device) != RTC_ERROR_NONE) {
    throw Error(Status::out_of_memory, "Embree cannot build a BVH over " + std::to_string(triangles.size()) +
                                           " triangles: " + error_);
  }
}

}  // namespace nif::bake
