// Asks Embree ray by ray. Meshes of extreme size are first scaled by a power of two, which is exact. A point
// is inside if a ray from it passes more surfaces from one side than from the other.
#include "bake/ground_truth/embree_truth.hpp"

#include <embree3/rtcore.h>

#include <numbers>

#include "formats/base/vector.hpp"
#include "formats/mesh/box.hpp"
#include "formats/mesh/transform.hpp"

namespace nif::bake {
namespace {

constexpr float kMostOfEmbree = 1.8e18f;

float largest(const float (&v)[3]) { return std::max({std::abs(v[0]), std::abs(v[1]), std::abs(v[2])}); }

/// A segment in the form that Embree is asked about.
struct Question {
  RTCRay ray{};
  int shift = 0;  ///< the segment's t is the ray's times 2^shift
  bool valid;

  Question(Segment segment, int exponent) {
    if (exponent != 0) {
      const float size = largest(segment.direction);
      const int turn = size > 0 && size < kInfinity ? -std::ilogb(size) : 0;
      shift = turn - exponent;
      for (float& x : segment.origin) x = std::ldexp(x, exponent);
      for (float& x : segment.direction) x = std::ldexp(x, turn);
      segment.tmin = std::ldexp(segment.tmin, -shift);
      segment.tmax = std::ldexp(segment.tmax, -shift);
    }
    valid = largest(segment.origin) < kMostOfEmbree && largest(segment.direction) < kMostOfEmbree;
    ray.org_x = segment.origin[0], ray.org_y = segment.origin[1], ray.org_z = segment.origin[2];
    ray.dir_x = segment.direction[0], ray.dir_y = segment.direction[1], ray.dir_z = segment.direction[2];
    ray.tnear = segment.tmin;
    ray.tfar = segment.tmax;
    ray.mask = 0xffffffffu;
  }
};

double reach_of(const EmbreeObject& object) {
  double reach = 0;
  for (const mesh::Triangle& triangle : object.triangles)
    for (const uint32_t corner : triangle)
      for (const float x : object.positions[corner]) reach = std::max(reach, std::abs(double(x)));
  return reach;
}

/// 0 if Embree computes accurately with the mesh as it is.
int exponent_for(const EmbreeObject& object) {
  constexpr double kSmall = 1e-6, kLarge = 1e9;
  const double reach = reach_of(object);
  const float longest = mesh::bounds(object.positions, object.triangles).longest_side();
  return (longest >= float(kSmall) && reach <= kLarge) || reach == 0 ? 0 : -std::ilogb(reach);
}

EmbreeScene scaled_scene(EmbreeObject object, int exponent) {
  if (exponent == 0) return EmbreeScene(object, EmbreeBuild::robust, HoleTest::exact);
  std::vector<mesh::Float3> scaled(object.positions.begin(), object.positions.end());
  for (mesh::Float3& position : scaled)
    for (float& x : position) x = std::ldexp(x, exponent);
  object.positions = scaled;
  return EmbreeScene(object, EmbreeBuild::robust, HoleTest::exact);
}

}  // namespace

EmbreeTruth::EmbreeTruth(const EmbreeObject& object)
    : scene_(scaled_scene(object, exponent_for(object))),
      reach_(reach_of(object)),
      exponent_(exponent_for(object)) {}

EmbreeTruth::EmbreeTruth(std::span<const EmbreeObject> objects, std::span<const Placed> instances)
    : scene_(objects, instances, EmbreeBuild::robust, HoleTest::exact) {
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

bool EmbreeTruth::occluded(const Segment& segment) const {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  Question question(segment, exponent_);
  if (!question.valid) return false;
  rtcOccluded1(scene_.handle(), &context, &question.ray);
  return question.ray.tfar == -kInfinity;
}

std::array<Segment, 10> EmbreeTruth::beside(const Segment& segment) const {
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
  // Embree accepts no negative t, so the longer one starts farther back.
  Segment &shorter = all[8], &longer = all[9];
  for (size_t a = 0; a < 3; ++a) longer.origin[a] = static_cast<float>(origin[a] - along * direction[a]);
  longer.tmax += static_cast<float>(2 * along);
  shorter.tmin += static_cast<float>(along), shorter.tmax -= static_cast<float>(along);
  return all;
}

bool EmbreeTruth::in_doubt(const Segment& segment) const {
  const bool answer = occluded(segment);
  const std::array<Segment, 10> others = beside(segment);
  return std::any_of(others.begin(), others.end(), [&](const Segment& other) {
    return other.tmin > other.tmax || occluded(other) != answer;
  });
}

std::optional<EmbreeTruth::Hit> EmbreeTruth::first_hit(const Segment& segment) const {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  const Question question(segment, exponent_);
  if (!question.valid) return std::nullopt;
  RTCRayHit query{};
  query.ray = question.ray;
  query.hit.geomID = query.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
  rtcIntersect1(scene_.handle(), &context, &query);
  if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return std::nullopt;
  const Double3 normal{query.hit.Ng_x, query.hit.Ng_y, query.hit.Ng_z};
  const float t = std::ldexp(query.ray.tfar, question.shift);
  if (normals_.empty()) return Hit{t, query.hit.primID, normal};
  const uint32_t instance = query.hit.instID[0];
  return Hit{t, query.hit.primID, mesh::product(mesh::rows_of(normals_[instance]), normal), instance};
}

InsideTest::InsideTest(const mesh::CleanMesh& surface, const ClosedComponents& closed) {
  if (closed.members.empty()) return;
  std::vector<mesh::Triangle> triangles(closed.members.size());
  for (size_t t = 0; t < triangles.size(); ++t) triangles[t] = closed.triangle(surface, t);
  embree_ = std::make_unique<EmbreeTruth>(EmbreeObject(surface.positions, triangles));
}

InsideTest::InsideTest(std::span<const EmbreeObject> objects, std::span<const Placed> instances) {
  // Embree does not accept scenes without triangles.
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
  if (!placed.empty()) embree_ = std::make_unique<EmbreeTruth>(kept, placed);
}

bool InsideTest::inside(const std::array<float, 3>& point) const {
  if (!embree_) return false;
  // An arbitrary direction, unlikely to be aligned with a model. Each hit counts by the side that is met.
  Segment ray{{point[0], point[1], point[2]}, {0.3625f, 0.5413f, 0.7587f}, 0, kInfinity};
  const Double3 direction{ray.direction[0], ray.direction[1], ray.direction[2]};
  int winding = 0;
  for (int hits = 0; hits < 1000; ++hits) {
    const std::optional<EmbreeTruth::Hit> hit = embree_->first_hit(ray);
    if (!hit) break;
    winding += dot(hit->normal, direction) > 0 ? 1 : -1;
    ray.tmin = std::nextafter(hit->t, kInfinity);
  }
  return winding != 0;
}

}  // namespace nif::bake
