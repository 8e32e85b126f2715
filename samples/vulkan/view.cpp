#include "view.hpp"

#include <cmath>
#include <limits>

namespace {

constexpr float kDegree = 3.14159265f / 180;

Vec3 operator+(const Vec3& a, const Vec3& b) { return {a[0] + b[0], a[1] + b[1], a[2] + b[2]}; }
Vec3 operator-(const Vec3& a, const Vec3& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
Vec3 operator*(float s, const Vec3& v) { return {s * v[0], s * v[1], s * v[2]}; }
Vec3 cross(const Vec3& a, const Vec3& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
float length(const Vec3& v) { return std::hypot(v[0], v[1], v[2]); }
Vec3 unit(const Vec3& v) { return 1 / length(v) * v; }

}  // namespace

Vec3 towards(int up, float azimuth, float elevation) {
  Vec3 direction{};
  direction[up] = std::sin(elevation * kDegree);
  direction[(up + 1) % 3] = std::cos(elevation * kDegree) * std::cos(azimuth * kDegree);
  direction[(up + 2) % 3] = std::cos(elevation * kDegree) * std::sin(azimuth * kDegree);
  return direction;
}

void place(View& view, const NifObjectInfo& object) {
  Vec3 low, high;
  std::copy_n(object.bounds_min, 3, low.begin());
  std::copy_n(object.bounds_max, 3, high.begin());
  view.target = 0.5f * (low + high);
  const float half = std::min(1.0f, float(view.width) / float(view.height)) * std::tan(kFov / 2 * kDegree);
  const float distance = 0.42f * length(high - low) / std::sin(std::atan(half));
  view.position = view.target + distance * towards(view.up, view.azimuth, view.elevation);
}

std::vector<Pixel> look(const View& view, const nifkit::Scene& scene, const NifObjectInfo& object) {
  const float infinity = std::numeric_limits<float>::infinity();
  const Vec3 forward = unit(view.target - view.position);
  Vec3 vertical{};
  vertical[view.up] = 1;
  const float half = std::tan(kFov / 2 * kDegree);
  const Vec3 right = half * float(view.width) / float(view.height) * unit(cross(forward, vertical));
  const Vec3 down = half * unit(cross(forward, right));
  const size_t count = size_t(view.width) * view.height;
  std::vector<NifRay> rays(count);
  for (uint32_t y = 0; y < view.height; ++y)
    for (uint32_t x = 0; x < view.width; ++x) {
      const float u = 2 * (float(x) + 0.5f) / float(view.width) - 1,
                  v = 2 * (float(y) + 0.5f) / float(view.height) - 1;
      const Vec3 direction = unit(forward + u * right + v * down);
      NifRay& ray = rays[size_t(y) * view.width + x];
      std::copy_n(view.position.begin(), 3, ray.origin);
      std::copy_n(direction.begin(), 3, ray.direction);
      ray.tmin = 0, ray.tmax = infinity;
    }
  std::vector<float> t(count), normals(3 * count);
  scene.intersect(nifkit::Rays(rays), nifkit::Hits().t(t).normal(normals));

  std::vector<Pixel> pixels(count);
  for (size_t i = 0; i < count; ++i) {
    Pixel& pixel = pixels[i];
    const Vec3 direction{rays[i].direction[0], rays[i].direction[1], rays[i].direction[2]};
    const float to_ground = (object.bounds_min[view.up] - view.position[view.up]) / direction[view.up];
    float distance = t[i];
    if (distance < infinity) pixel.kind = kObject, std::copy_n(&normals[3 * i], 3, pixel.normal.begin());
    if (to_ground > 0 && to_ground < distance)
      pixel.kind = kGround, distance = to_ground, pixel.normal = vertical;
    // Shadow rays start the bias off the surface.
    if (pixel.kind != kNothing)
      pixel.start = view.position + distance * direction + object.bias * pixel.normal;
  }
  return pixels;
}
