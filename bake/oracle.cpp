#include "bake/oracle.hpp"

#include <embree3/rtcore.h>

#include <limits>

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

bool Oracle::occluded(const Segment& segment) const {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  RTCRay ray = to_ray(segment);
  rtcOccluded1(scene_.handle(), &context, &ray);
  return ray.tfar == -kInfinity;
}

std::optional<Oracle::Hit> Oracle::first_hit(const Segment& segment) const {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  RTCRayHit query{};
  query.ray = to_ray(segment);
  query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  rtcIntersect1(scene_.handle(), &context, &query);
  if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return std::nullopt;
  return Hit{query.ray.tfar, query.hit.primID, {query.hit.Ng_x, query.hit.Ng_y, query.hit.Ng_z}};
}

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
