// Finds the distance of an orbit by bisection, so that the box fills the wanted share of the picture's
// height. A camera that looks straight along the up axis takes another axis instead.
#include "tools/render/camera.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace nif::render {
namespace {

/// `up` must not be parallel to `forward`, which has unit length.
Camera look_along(const Double3& position, const Double3& forward, const Double3& up, double fov,
                  double aspect) {
  Camera camera;
  camera.position = position;
  camera.forward = forward;
  Double3 right = cross(forward, up);
  right = right * (1 / length(right));
  const double half = std::tan(fov / 2 * std::numbers::pi / 180);
  camera.down = cross(camera.forward, right) * half;
  camera.right = right * (half * aspect);
  return camera;
}

Camera look(const Double3& position, const Double3& target, int up, double fov, double aspect) {
  Double3 forward = target - position;
  forward = forward * (1 / length(forward));
  Double3 axis{};
  axis[size_t(up)] = 1;
  if (length(cross(forward, axis)) < 1e-6) {  // straight up or down
    axis = {};
    axis[size_t((up + 1) % 3)] = 1;
  }
  return look_along(position, forward, axis, fov, aspect);
}

/// The share of the picture's height that the box takes.
double height_of(const mesh::Box& box, const Camera& camera) {
  double lowest = 1e300, highest = -1e300;
  for (uint32_t corner = 0; corner < 8; ++corner) {
    Double3 p;
    for (size_t a = 0; a < 3; ++a) p[a] = (corner >> a & 1 ? box.max : box.min)[a];
    const Double3 to = p - camera.position;
    const double depth = dot(to, camera.forward);
    if (depth <= 0) return 1e300;
    const double y = dot(to, camera.down) / dot(camera.down, camera.down) / depth;
    lowest = std::min(lowest, y);
    highest = std::max(highest, y);
  }
  return (highest - lowest) / 2;
}

}  // namespace

Camera place_camera(const CameraDescription& camera, const mesh::Box& box, int up, uint32_t width,
                    uint32_t height) {
  const double aspect = double(width) / height;
  if (const auto* place = std::get_if<Place>(&camera.where))
    return look(place->position, place->target, up, camera.fov, aspect);
  if (const auto* view = std::get_if<View>(&camera.where))
    return look_along(view->position, view->forward, view->up, camera.fov, aspect);
  const auto& orbit = std::get<Orbit>(camera.where);
  const double azimuth = orbit.azimuth * std::numbers::pi / 180,
               elevation = orbit.elevation * std::numbers::pi / 180;
  Double3 from{}, middle;
  from[size_t(up)] = std::sin(elevation);
  from[size_t((up + 1) % 3)] = std::cos(elevation) * std::cos(azimuth);
  from[size_t((up + 2) % 3)] = std::cos(elevation) * std::sin(azimuth);
  for (size_t a = 0; a < 3; ++a) middle[a] = (double(box.min[a]) + box.max[a]) / 2;
  // The share decreases with distance, so bisection finds the distance, never within the box.
  double near = 0.51 * box.diagonal(), far = 1e4 * box.diagonal();
  for (int i = 0; i < 100; ++i) {
    const double distance = (near + far) / 2;
    const double taken = height_of(box, look(middle + from * distance, middle, up, camera.fov, aspect));
    (taken > orbit.fill ? near : far) = distance;
  }
  return look(middle + from * far, middle, up, camera.fov, aspect);
}

}  // namespace nif::render
