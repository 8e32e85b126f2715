#include "bake/oracle.hpp"

#include <embree3/rtcore.h>
#include <tbb/task_arena.h>

#include <atomic>
#include <cstring>
#include <limits>

#include "formats/status.hpp"

namespace nif::bake {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

RTCRay to_ray(const Segment& segment) {
  RTCRay ray{};
  ray.org_x = segment.origin[0], ray.org_y = segment.origin[1], ray.org_z = segment.origin[2];
  ray.dir_x = segment.direction[0], ray.dir_y = segment.direction[1], ray.dir_z = segment.direction[2];
  ray.tnear = segment.tmin;
  ray.tfar = segment.tmax;
  ray.mask = 0xffffffffu;
  return ray;
}

}  // namespace

struct Oracle::Impl {
  RTCDevice device = nullptr;
  RTCScene scene = nullptr;
  std::atomic<int64_t> bytes{0};
  int64_t buffers = 0;
  std::string error;

  ~Impl() {
    if (scene) rtcReleaseScene(scene);
    if (device) rtcReleaseDevice(device);
  }
};

Oracle::Oracle(std::span<const mesh::Float3> positions, std::span<const mesh::Triangle> triangles,
               EmbreeBuild build)
    : impl_(std::make_unique<Impl>()) {
  Impl& impl = *impl_;
  impl.device = rtcNewDevice(nullptr);
  if (!impl.device) throw Error(Status::internal, "Embree cannot create a device on this machine");
  rtcSetDeviceErrorFunction(
      impl.device, [](void* user, RTCError, const char* text) { static_cast<Impl*>(user)->error = text; },
      &impl);
  rtcSetDeviceMemoryMonitorFunction(
      impl.device,
      [](void* user, ssize_t bytes, bool) {
        static_cast<Impl*>(user)->bytes += bytes;
        return true;
      },
      &impl);
  impl.scene = rtcNewScene(impl.device);
  switch (build) {
    case EmbreeBuild::robust:
      rtcSetSceneFlags(impl.scene, RTC_SCENE_FLAG_ROBUST);
      break;
    case EmbreeBuild::compact:
      rtcSetSceneFlags(impl.scene, RTC_SCENE_FLAG_COMPACT);
      break;
    case EmbreeBuild::standard:
      break;
  }
  RTCGeometry geometry = rtcNewGeometry(impl.device, RTC_GEOMETRY_TYPE_TRIANGLE);
  auto* vertices = static_cast<float*>(
      rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 12, positions.size()));
  auto* indices = static_cast<uint32_t*>(
      rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 12, triangles.size()));
  if (!vertices || !indices) {
    rtcReleaseGeometry(geometry);
    throw Error(Status::out_of_memory,
                "Embree cannot hold " + std::to_string(triangles.size()) + " triangles: " + impl.error);
  }
  std::memcpy(vertices, positions.data(), positions.size() * 12);
  std::memcpy(indices, triangles.data(), triangles.size() * 12);
  impl.buffers = impl.bytes;
  rtcCommitGeometry(geometry);
  rtcAttachGeometry(impl.scene, geometry);
  rtcReleaseGeometry(geometry);
  // On one thread: with more, the order of triangles within a leaf may vary, and with it which of two
  // triangles is reported for a hit on their common edge. A bake must not depend on that.
  tbb::task_arena(1).execute([&] { rtcCommitScene(impl.scene); });
  if (!impl.error.empty() || rtcGetDeviceError(impl.device) != RTC_ERROR_NONE) {
    throw Error(Status::out_of_memory, "Embree cannot build a BVH over " + std::to_string(triangles.size()) +
                                           " triangles: " + impl.error);
  }
}

Oracle::~Oracle() = default;

bool Oracle::occluded(const Segment& segment) const {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  RTCRay ray = to_ray(segment);
  rtcOccluded1(impl_->scene, &context, &ray);
  return ray.tfar == -kInfinity;
}

std::optional<Oracle::Hit> Oracle::first_hit(const Segment& segment) const {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  RTCRayHit query{};
  query.ray = to_ray(segment);
  query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  rtcIntersect1(impl_->scene, &context, &query);
  if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return std::nullopt;
  return Hit{query.ray.tfar, query.hit.primID, {query.hit.Ng_x, query.hit.Ng_y, query.hit.Ng_z}};
}

Oracle::Memory Oracle::memory() const { return {impl_->bytes - impl_->buffers, impl_->buffers}; }

InsideTest::InsideTest(std::span<const mesh::Float3> positions, const ClosedComponents& closed) {
  if (!closed.triangles.empty()) oracle_ = std::make_unique<Oracle>(positions, closed.triangles);
}

bool InsideTest::inside(const std::array<float, 3>& point) const {
  if (!oracle_) return false;
  // Any direction that no model is aligned with. Each hit counts by the side it is met from.
  Segment ray{{point[0], point[1], point[2]}, {0.3625f, 0.5413f, 0.7587f}, 0, kInfinity};
  const Double3 direction{ray.direction[0], ray.direction[1], ray.direction[2]};
  int winding = 0;
  for (int hits = 0; hits < 1000; ++hits) {
    const std::optional<Oracle::Hit> hit = oracle_->first_hit(ray);
    if (!hit) break;
    winding += dot(hit->normal, direction) > 0 ? 1 : -1;
    ray.tmin = std::nextafter(hit->t, kInfinity);
  }
  return winding != 0;
}

}  // namespace nif::bake
