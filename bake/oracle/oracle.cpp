#include "bake/oracle/oracle.hpp"

#include <embree3/rtcore.h>

#include <numbers>

#include "formats/base/vector.hpp"
#include "formats/mesh/box.hpp"
#include "formats/mesh/transform.hpp"

namespace nif::bake {
namespace {

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

Oracle::Oracle(std::span<const mesh::Float3> positions, std::span<const mesh::Triangle> triangles)
    : scene_(positions, triangles, EmbreeBuild::robust) {
  for (const mesh::Triangle& triangle : triangles)
    for (const uint32_t corner : triangle)
      for (const float x : positions[corner]) reach_ = std::max(reach_, std::abs(double(x)));
}

Oracle::Oracle(std::span<const EmbreeObject> objects, std::span<const Placed> instances)
    : scene_(objects, instances, EmbreeBuild::robust) {
  std::vector<mesh::Box> boxes;
  for (const EmbreeObject& object : objects)
    boxes.push_back(mesh::bounds(object.positions, object.triangles));
  for (const Placed& placed : instances) {
    normals_.push_back(mesh::cofactors(placed.transform));
    const mesh::Box box = mesh::bounds(boxes[placed.object], placed.transform);
    for (size_t a = 0; a < 3; ++a)
      reach_ = std::max({reach_, std::abs(double(box.min[a])), std::abs(double(box.max[a]))});
  }
}

bool Oracle::occluded(const Segment& segment) const {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  RTCRay ray = to_ray(segment);
  rtcOccluded1(scene_.handle(), &context, &ray);
  return ray.tfar == -kInfinity;
}

std::array<Segment, 10> Oracle::beside(const Segment& segment) const {
  const Double3 origin = to_double(std::to_array(segment.origin)),
                direction = to_double(std::to_array(segment.direction));
  double reach = reach_;
  for (const double x : origin) reach = std::max(reach, std::abs(x));
  const double aside = 1e-6 * reach, along = aside / length(direction);
  const size_t flattest =
      size_t(std::min_element(direction.begin(), direction.end(),
                              [](double a, double b) { return std::abs(a) < std::abs(b); }) -
             direction.begin());
  Double3 axis{};
  axis[flattest] = 1;
  Double3 across = cross(direction, axis);
  across = across * (aside / length(across));
  const Double3 other = cross(direction, across) * (1 / length(direction));

  std::array<Segment, 10> all;
  all.fill(segment);
  for (size_t turn = 0; turn < 8; ++turn) {
    const double angle = double(turn) * std::numbers::pi / 4;
    const Double3 moved = origin + across * std::cos(angle) + other * std::sin(angle);
    for (size_t a = 0; a < 3; ++a) all[turn].origin[a] = static_cast<float>(moved[a]);
  }
  // Embree takes no negative t, so the longer one starts from farther back.
  Segment &shorter = all[8], &longer = all[9];
  for (size_t a = 0; a < 3; ++a) longer.origin[a] = static_cast<float>(origin[a] - along * direction[a]);
  longer.tmax += static_cast<float>(2 * along);
  shorter.tmin += static_cast<float>(along), shorter.tmax -= static_cast<float>(along);
  return all;
}

bool Oracle::in_doubt(const Segment& segment) const {
  const bool answer = occluded(segment);
  const std::array<Segment, 10> others = beside(segment);
  return std::any_of(others.begin(), others.end(), [&](const Segment& other) {
    return other.tmin > other.tmax || occluded(other) != answer;
  });
}

std::optional<Oracle::Hit> Oracle::first_hit(const Segment& segment) const {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  RTCRayHit query{};
  query.ray = to_ray(segment);
  query.hit.geomID = query.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
  rtcIntersect1(scene_.handle(), &context, &query);
  if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return std::nullopt;
  const Double3 normal{query.hit.Ng_x, query.hit.Ng_y, query.hit.Ng_z};
  if (normals_.empty()) return Hit{query.ray.tfar, query.hit.primID, normal};
  const uint32_t instance = query.hit.instID[0];
  return Hit{query.ray.tfar, query.hit.primID, mesh::product(mesh::rows_of(normals_[instance]), normal),
             instance};
}

InsideTest::InsideTest(const mesh::CleanMesh& surface, const ClosedComponents& closed) {
  if (closed.members.empty()) return;
  std::vector<mesh::Triangle> triangles(closed.members.size());
  for (size_t t = 0; t < triangles.size(); ++t) triangles[t] = closed.triangle(surface, t);
  oracle_ = std::make_unique<Oracle>(surface.positions, triangles);
}

InsideTest::InsideTest(std::span<const EmbreeObject> objects, std::span<const Placed> instances) {
  // Embree has no scenes without triangles.
  std::vector<EmbreeObject> kept;
  std::vector<uint32_t> number(objects.size());
  for (size_t i = 0; i < objects.size(); ++i) {
    number[i] = uint32_t(kept.size());
    if (!objects[i].triangles.empty()) kept.push_back(objects[i]);
  }
  std::vector<Placed> placed;
  for (const Placed& instance : instances)
    if (!objects[instance.object].triangles.empty())
      placed.push_back({number[instance.object], instance.transform});
  if (!placed.empty()) oracle_ = std::make_unique<Oracle>(kept, placed);
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
