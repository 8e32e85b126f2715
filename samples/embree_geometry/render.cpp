// Embree traces primary rays one by one, which gives a list of shadow rays. This list is then answered in
// several ways, each timed separately, so that nifkit and Embree are compared on the same rays.
#include "render.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>

namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr uint32_t kSamples = 4;
using Vector = std::array<float, 3>;

Vector operator*(float s, const Vector& v) { return {s * v[0], s * v[1], s * v[2]}; }
Vector operator+(const Vector& a, const Vector& b) { return {a[0] + b[0], a[1] + b[1], a[2] + b[2]}; }
float dot(const Vector& a, const Vector& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
Vector cross(const Vector& a, const Vector& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
Vector normalised(const Vector& v) { return 1 / std::sqrt(dot(v, v)) * v; }

const Vector kSun = normalised({-0.8f, 0.6f, 0.3f});

/// Numbers between 0 and 1, from the golden ratio and its analogue in two dimensions.
float spread(uint32_t i, double step) { return float(double(i) * step - std::floor(double(i) * step)); }

template <class Work>
double seconds_of(Work&& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

}  // namespace

Shading shade(const World& world, uint32_t width, uint32_t height, float soft) {
  Shading result{width, height, std::vector<float>(size_t(kSamples) * width * height), {}, {}};
  const Vector& middle = world.middle();
  const Vector eye = middle + world.size() * Vector{0.9f, 0.95f, 2.2f};
  const Vector ahead = normalised(middle + -1 * eye);
  const Vector right = normalised(cross(ahead, {0, 1, 0})), up = cross(right, ahead);
  const Vector across = normalised(cross(kSun, {0, 1, 0})), along = cross(kSun, across);
  const float field = 0.44f * 2 / float(width);

  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  for (uint32_t sample = 0; sample < result.light.size(); ++sample) {
    const uint32_t pixel = sample / kSamples, part = sample % kSamples;
    const float x = float(pixel % width) + 0.25f + 0.5f * float(part % 2) - float(width) / 2;
    const float y = float(pixel / width) + 0.25f + 0.5f * float(part / 2) - float(height) / 2;
    const Vector direction = normalised(ahead + field * x * right + -field * y * up);
    RTCRayHit hit{};
    hit.ray.org_x = eye[0], hit.ray.org_y = eye[1], hit.ray.org_z = eye[2];
    hit.ray.dir_x = direction[0], hit.ray.dir_y = direction[1], hit.ray.dir_z = direction[2];
    hit.ray.tfar = kInfinity;
    hit.ray.mask = ~0u;
    hit.hit.geomID = hit.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
    rtcIntersect1(world.own(), &context, &hit);
    if (hit.hit.geomID == RTC_INVALID_GEOMETRY_ID) continue;

    // The normal, towards the viewer. Under an instance Embree leaves it in the object's space.
    Vector normal{hit.hit.Ng_x, hit.hit.Ng_y, hit.hit.Ng_z};
    if (hit.hit.instID[0] != RTC_INVALID_GEOMETRY_ID) {
      // The copies are rotated and uniformly scaled, so the same matrix transforms normals.
      float t[12];
      rtcGetGeometryTransform(rtcGetGeometry(world.own(), hit.hit.instID[0]), 0,
                              RTC_FORMAT_FLOAT3X4_ROW_MAJOR, t);
      normal = {dot({t[0], t[1], t[2]}, normal), dot({t[4], t[5], t[6]}, normal),
                dot({t[8], t[9], t[10]}, normal)};
    }
    normal = normalised(normal);
    if (dot(normal, direction) > 0) normal = -1 * normal;
    result.light[sample] = std::max(0.0f, dot(normal, kSun));
    if (result.light[sample] == 0) continue;

    // Towards a point on the sun's disk, from a point that is off the surface by the asset's bias.
    const float radius = soft * std::sqrt(spread(sample, 0.7548776662466927));
    const float angle = 6.2831853f * spread(sample, 0.5698402909980532);
    const Vector origin = eye + hit.ray.tfar * direction + world.bias() * normal;
    const Vector to_sun =
        normalised(kSun + radius * std::cos(angle) * across + radius * std::sin(angle) * along);
    result.asker.push_back(sample);
    result.rays.push_back(
        {{origin[0], origin[1], origin[2]}, 0, {to_sun[0], to_sun[1], to_sun[2]}, kInfinity});
  }
  return result;
}

namespace {

void put(RTCRay16& packet, size_t k, const NifRay& ray, float tmin, float tmax) {
  packet.org_x[k] = ray.origin[0], packet.org_y[k] = ray.origin[1], packet.org_z[k] = ray.origin[2];
  packet.dir_x[k] = ray.direction[0], packet.dir_y[k] = ray.direction[1], packet.dir_z[k] = ray.direction[2];
  packet.tnear[k] = tmin, packet.tfar[k] = tmax;
  packet.mask[k] = ~0u;
}

/// The packet's first `count` rays.
void trace(RTCScene scene, RTCIntersectContext& context, RTCRay16& packet, size_t count) {
  alignas(64) int valid[16];
  for (size_t k = 0; k < 16; ++k) valid[k] = k < count ? -1 : 0;
  rtcOccluded16(valid, scene, &context, &packet);
}

}  // namespace

Asked ask_embree(RTCScene scene, const std::vector<NifRay>& rays) {
  std::vector<RTCRay16> packets((rays.size() + 15) / 16);
  for (size_t i = 0; i < rays.size(); ++i) put(packets[i / 16], i % 16, rays[i], rays[i].tmin, rays[i].tmax);
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  Asked result{Answers(rays.size()), 0};
  result.seconds = seconds_of([&] {
    for (size_t p = 0; p < packets.size(); ++p)
      trace(scene, context, packets[p], std::min<size_t>(16, rays.size() - 16 * p));
  });
  for (size_t i = 0; i < rays.size(); ++i) result.visible[i] = packets[i / 16].tfar[i % 16] != -kInfinity;
  return result;
}

FirstHits find_hits(RTCScene scene, const std::vector<NifRay>& rays) {
  std::vector<RTCRayHit16> packets((rays.size() + 15) / 16);
  for (size_t i = 0; i < rays.size(); ++i) {
    RTCRayHit16& packet = packets[i / 16];
    const NifRay& ray = rays[i];
    const size_t k = i % 16;
    packet.ray.org_x[k] = ray.origin[0], packet.ray.org_y[k] = ray.origin[1],
    packet.ray.org_z[k] = ray.origin[2];
    packet.ray.dir_x[k] = ray.direction[0], packet.ray.dir_y[k] = ray.direction[1],
    packet.ray.dir_z[k] = ray.direction[2];
    packet.ray.tnear[k] = ray.tmin, packet.ray.tfar[k] = ray.tmax;
    packet.ray.mask[k] = ~0u;
    packet.hit.geomID[k] = packet.hit.instID[0][k] = RTC_INVALID_GEOMETRY_ID;
  }
  FirstHits result{std::vector<float>(rays.size(), kInfinity), 0};
  result.seconds = seconds_of([&] {
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    for (size_t p = 0; p < packets.size(); ++p) {
      alignas(64) int valid[16];
      for (size_t k = 0; k < 16; ++k) valid[k] = 16 * p + k < rays.size() ? -1 : 0;
      rtcIntersect16(valid, scene, &context, &packets[p]);
    }
  });
  for (size_t i = 0; i < rays.size(); ++i)
    if (packets[i / 16].hit.geomID[i % 16] != RTC_INVALID_GEOMETRY_ID)
      result.t[i] = packets[i / 16].ray.tfar[i % 16];
  return result;
}

Asked ask_proofs_first(const nifkit::Scene& proofs, RTCScene triangles, const std::vector<NifRay>& rays,
                       size_t& open) {
  std::vector<uint32_t> numbers(rays.size());
  std::vector<float> tmin(rays.size()), tmax(rays.size());
  Asked result{Answers(rays.size()), 0};
  result.seconds = seconds_of([&] {
    open =
        proofs.query_open(nifkit::Rays(rays), nifkit::Answers().visible(result.visible), numbers, tmin, tmax);
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    for (size_t first = 0; first < open; first += 16) {
      const size_t count = std::min<size_t>(16, open - first);
      RTCRay16 packet;
      for (size_t k = 0; k < count; ++k)
        put(packet, k, rays[numbers[first + k]], tmin[first + k], tmax[first + k]);
      trace(triangles, context, packet, count);
      for (size_t k = 0; k < count; ++k) result.visible[numbers[first + k]] = packet.tfar[k] != -kInfinity;
    }
  });
  return result;
}

Asked ask_directly(const nifkit::Scene& scene, const std::vector<NifRay>& rays) {
  Asked result{Answers(rays.size()), 0};
  result.seconds =
      seconds_of([&] { scene.query(nifkit::Rays(rays), nifkit::Answers().visible(result.visible)); });
  return result;
}

void draw(const Shading& shading, const Answers& visible, Picture& picture, uint32_t left) {
  std::vector<float> light = shading.light;
  for (size_t i = 0; i < visible.size(); ++i)
    if (!visible[i]) light[shading.asker[i]] = 0;
  for (uint32_t y = 0; y < shading.height; ++y) {
    for (uint32_t x = 0; x < shading.width; ++x) {
      const float* samples = &light[size_t(kSamples) * (size_t(y) * shading.width + x)];
      float sum = 0;
      for (uint32_t s = 0; s < kSamples; ++s) sum += 0.08f + 0.85f * samples[s];  // ambient light
      const float grey = std::pow(sum / kSamples, 1 / 2.2f);
      const float tint[3] = {1, 0.97f, 0.9f};
      for (int c = 0; c < 3; ++c)
        picture.at(left + x, y)[c] = uint8_t(255 * std::min(1.0f, grey * tint[c]) + 0.5f);
    }
  }
}
