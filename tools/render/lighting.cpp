// Samples each kind of light in its own way. Environment maps and glowing skies invert cumulative tables,
// first of rows and then of texels. Samples are already divided by their density.
#include "tools/render/lighting.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "formats/base/status.hpp"

namespace nif::render {
namespace {

using std::numbers::pi;

constexpr double kInfinitelyFar = std::numeric_limits<double>::infinity();

double luminance(const float* rgb) { return 0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2]; }
Colour operator*(const Colour& a, const Colour& b) { return {a[0] * b[0], a[1] * b[1], a[2] * b[2]}; }

/// The entry of a cumulative table (from 0 to 1) that u falls into, and the position within it.
std::pair<size_t, double> invert(std::span<const double> table, double u) {
  const auto above = std::upper_bound(table.begin() + 1, table.end() - 1, u);
  const size_t entry = size_t(above - table.begin()) - 1;
  const double width = table[entry + 1] - table[entry];
  return {entry, width > 0 ? std::clamp((u - table[entry]) / width, 0.0, 1.0) : 0.5};
}

/// Divides the sums of an increasing table by the last one.
void normalise(std::span<double> table) {
  const double sum = table.back();
  for (double& value : table) value = sum > 0 ? value / sum : 0;
  table.back() = 1;
}

/// The factor on a tabulated sky's values: the table of a glow already contains the radiance.
Colour scale_of(const Sky& sky) { return sky.map ? sky.radiance : Colour{1, 1, 1}; }

/// A direction within a cone about an axis, uniform in solid angle.
Double3 cone_direction(const Double3& axis, double angle_degrees, const Pair& u) {
  if (angle_degrees == 0) return axis;
  const double narrow = 1 - std::cos(angle_degrees / 2 * pi / 180);
  const double c = 1 - u[0] * narrow, s = std::sqrt(std::max(0.0, 1 - c * c));
  const auto [x, y] = tangents(axis);
  return axis * c + x * (s * std::cos(2 * pi * u[1])) + y * (s * std::sin(2 * pi * u[1]));
}

Double3 hemisphere_direction(const Double3& normal, const Pair& u) {
  const double c = u[0], s = std::sqrt(std::max(0.0, 1 - c * c));
  const auto [x, y] = tangents(normal);
  return normal * c + x * (s * std::cos(2 * pi * u[1])) + y * (s * std::sin(2 * pi * u[1]));
}

/// For a point light, without regard to what blocks it.
LightSample from_point(const Double3& position, const Colour& intensity, const Double3& point) {
  const Double3 to = position - point;
  const double distance = length(to);
  if (!(distance > 0)) return {{0, 0, 1}, 1, {}};
  return {to * (1 / distance), distance, Colour(intensity * (1 / (distance * distance)))};
}

}  // namespace

std::array<Double3, 2> tangents(const Double3& normal) {
  const Double3 other = std::abs(normal[0]) < 0.6 ? Double3{1, 0, 0} : Double3{0, 1, 0};
  Double3 x = cross(other, normal);
  x = x * (1 / length(x));
  return {x, cross(normal, x)};
}

Double3 cosine_direction(const Double3& normal, const Pair& u) {
  const double s = std::sqrt(u[0]), c = std::sqrt(1 - u[0]);
  const auto [x, y] = tangents(normal);
  return normal * c + x * (s * std::cos(2 * pi * u[1])) + y * (s * std::sin(2 * pi * u[1]));
}

EnvironmentMap::EnvironmentMap(const std::string& path, int up, double rotation_degrees)
    : image_(read_environment(path)), up_(up), rotation_(rotation_degrees * pi / 180) {
  if (!tabulate()) throw Error(Status::not_an_image, path + ": is black, so it gives no light");
}

EnvironmentMap::EnvironmentMap(const Sky& sky, int up) : image_(1024, 512), up_(up), rotation_(0) {
  const Glow& glow = *sky.glow;
  for (uint32_t y = 0; y < image_.height; ++y)
    for (uint32_t x = 0; x < image_.width; ++x) {
      const double away =
          std::acos(std::clamp(dot(direction_of(x + 0.5, y + 0.5), glow.direction), -1.0, 1.0));
      const double part = away / (glow.angle * pi / 180), share = std::exp(-part * part);
      for (size_t c = 0; c < 3; ++c) image_.at(x, y)[c] = float(sky.radiance[c] + share * glow.radiance[c]);
    }
  tabulate();
}

bool EnvironmentMap::tabulate() {
  const uint32_t width = image_.width, height = image_.height;
  rows_.assign(height + 1, 0);
  texels_.assign(size_t(height) * (width + 1), 0);
  for (uint32_t y = 0; y < height; ++y) {
    const double solid_angle = std::cos(pi * y / height) - std::cos(pi * (y + 1) / height);
    double* row = &texels_[size_t(y) * (width + 1)];
    for (uint32_t x = 0; x < width; ++x) row[x + 1] = row[x] + luminance(image_.at(x, y)) * solid_angle;
    rows_[y + 1] = rows_[y] + row[width];
    normalise({row, width + 1});
  }
  if (!(rows_.back() > 0)) return false;
  normalise(rows_);
  return true;
}

Double3 EnvironmentMap::direction_of(double x, double y) const {
  const double theta = pi * y / image_.height, phi = 2 * pi * x / image_.width + rotation_;
  Double3 direction;
  direction[size_t(up_)] = std::cos(theta);
  direction[size_t((up_ + 1) % 3)] = std::sin(theta) * std::cos(phi);
  direction[size_t((up_ + 2) % 3)] = std::sin(theta) * std::sin(phi);
  return direction;
}

Colour EnvironmentMap::radiance(const Double3& direction) const {
  const int a = (up_ + 1) % 3, b = (up_ + 2) % 3;
  const double theta = std::acos(std::clamp(direction[size_t(up_)], -1.0, 1.0));
  double turn = (std::atan2(direction[size_t(b)], direction[size_t(a)]) - rotation_) / (2 * pi);
  turn -= std::floor(turn);
  const auto x = std::min(uint32_t(turn * image_.width), image_.width - 1);
  const auto y = std::min(uint32_t(theta / pi * image_.height), image_.height - 1);
  const float* rgb = image_.at(x, y);
  return {rgb[0], rgb[1], rgb[2]};
}

EnvironmentMap::Sample EnvironmentMap::draw(const Pair& u) const {
  const auto [y, down] = invert(rows_, u[0]);
  const std::span<const double> row(&texels_[y * (image_.width + 1)], image_.width + 1);
  const auto [x, across] = invert(row, u[1]);
  const double top = std::cos(pi * double(y) / image_.height),
               bottom = std::cos(pi * double(y + 1) / image_.height);
  const double c = top + (bottom - top) * down, s = std::sqrt(std::max(0.0, 1 - c * c));
  const double phi = 2 * pi * (double(x) + across) / image_.width + rotation_;
  Sample sample;
  sample.direction[size_t(up_)] = c;
  sample.direction[size_t((up_ + 1) % 3)] = s * std::cos(phi);
  sample.direction[size_t((up_ + 2) % 3)] = s * std::sin(phi);
  const float* rgb = image_.at(uint32_t(x), uint32_t(y));
  sample.radiance = {rgb[0], rgb[1], rgb[2]};
  const double share = (rows_[y + 1] - rows_[y]) * (row[x + 1] - row[x]);
  sample.density = share / ((top - bottom) * 2 * pi / image_.width);
  return sample;
}

Lighting::Lighting(const SceneDescription& scene) : lights_(scene.lights) {
  for (const Light& light : lights_) {
    const auto* sky = std::get_if<Sky>(&light);
    if (sky != nullptr && sky->map)
      maps_.emplace_back(EnvironmentMap(*sky->map, scene.up, sky->rotation));
    else if (sky != nullptr && sky->glow)
      maps_.emplace_back(EnvironmentMap(*sky, scene.up));
    else
      maps_.emplace_back(std::nullopt);
  }
}

double spot_share(const SpotLight& spot, double cosine) {
  const double inner = std::cos(spot.inner_angle * pi / 180), outer = std::cos(spot.outer_angle * pi / 180);
  if (cosine >= inner) return 1;
  if (cosine <= outer) return 0;
  const double share = (cosine - outer) / (inner - outer);
  return share * share;
}

LightSample Lighting::draw(size_t light, const Double3& point, const Double3& normal, const Pair& u) const {
  if (const auto* sun = std::get_if<Sun>(&lights_[light]))
    return {cone_direction(sun->direction, sun->angle, u), kInfinitelyFar, sun->irradiance};
  if (const auto* sky = std::get_if<Sky>(&lights_[light])) {
    const std::optional<EnvironmentMap>& map = maps_[light];
    if (sky->sampling == Sampling::uniform) {
      const Double3 direction = hemisphere_direction(normal, u);
      const Colour radiance = map ? scale_of(*sky) * map->radiance(direction) : sky->radiance;
      return {direction, kInfinitelyFar, Colour(radiance * (2 * pi))};
    }
    if (map) {
      const EnvironmentMap::Sample sample = map->draw(u);
      if (!(sample.density > 0)) return {sample.direction, kInfinitelyFar, {}};
      return {sample.direction, kInfinitelyFar,
              Colour(scale_of(*sky) * sample.radiance * (1 / sample.density))};
    }
    const Double3 direction = cosine_direction(normal, u);
    const double cosine = dot(direction, normal);
    return {direction, kInfinitelyFar, Colour(sky->radiance * (cosine > 1e-9 ? pi / cosine : 0.0))};
  }
  if (const auto* area = std::get_if<AreaLight>(&lights_[light])) {
    const Double3 to = area->corner + area->edge_u * u[0] + area->edge_v * u[1] - point;
    const Double3 facing = cross(area->edge_u, area->edge_v);  // its length is the light's area
    const double distance = length(to), shine = -dot(to, facing) / distance;
    if (!(distance > 0) || !(shine > 0)) return {{0, 0, 1}, 1, {}};
    return {to * (1 / distance), distance, Colour(area->radiance * (shine / (distance * distance)))};
  }
  if (const auto* spot = std::get_if<SpotLight>(&lights_[light])) {
    LightSample sample = from_point(spot->position, spot->intensity, point);
    sample.irradiance =
        Colour(sample.irradiance * spot_share(*spot, -dot(sample.direction, spot->direction)));
    return sample;
  }
  const auto& lamp = std::get<PointLight>(lights_[light]);
  return from_point(lamp.position, lamp.intensity, point);
}

Colour Lighting::background(const Double3& direction) const {
  Colour sum{};
  for (size_t i = 0; i < lights_.size(); ++i) {
    const auto* sky = std::get_if<Sky>(&lights_[i]);
    if (sky == nullptr) continue;
    const Colour radiance = maps_[i] ? scale_of(*sky) * maps_[i]->radiance(direction) : sky->radiance;
    for (size_t c = 0; c < 3; ++c) sum[c] += radiance[c];
  }
  return sum;
}

bool Lighting::has_sky() const {
  return std::any_of(lights_.begin(), lights_.end(),
                     [](const Light& light) { return std::holds_alternative<Sky>(light); });
}

}  // namespace nif::render
