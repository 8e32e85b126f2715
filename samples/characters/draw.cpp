// Rays go in batches of many: all camera rays of some rows, then one ray to the sun's disk and one to a direction of the sky
// from all that they hit.
#include "draw.hpp"

#include <png.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace {

constexpr float kPi = 3.14159265f, kInfinity = std::numeric_limits<float>::infinity();
constexpr float kSunRadius = 0.012f;  // in radians: somewhat larger than the real one, for softer shadows
constexpr uint32_t kBatch = 1u << 15;

Float3 operator*(float s, const Float3& v) { return {s * v[0], s * v[1], s * v[2]}; }
Float3 operator+(const Float3& a, const Float3& b) { return {a[0] + b[0], a[1] + b[1], a[2] + b[2]}; }
float dot(const Float3& a, const Float3& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
Float3 cross(const Float3& a, const Float3& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
Float3 normalised(const Float3& v) { return 1 / std::sqrt(dot(v, v)) * v; }
Float3 perpendicular(const Float3& n) {
  return normalised(cross(n, std::abs(n[1]) < 0.7f ? Float3{0, 1, 0} : Float3{1, 0, 0}));
}

const Float3 kSun = normalised({0.62f, 0.6f, 0.45f}), kSunLight = 1.6f * Float3{1, 0.93f, 0.8f};

/// A number in 0 .. 1 for a sample of a pixel and a purpose, 0 to 5. Those of a pixel are spread evenly: multiples of powers of
/// the generalised golden ratio (Roberts 2018), from a start that differs from pixel to pixel.
float random_of(uint32_t pixel, uint32_t sample, uint32_t purpose) {
  static constexpr double kSteps[] = {0.8986537126286993, 0.8075784952213448, 0.7257334129697598,
                                      0.6521830259439717, 0.5860866975779911, 0.5266889867007359};
  uint32_t x = pixel * 0x9e3779b1u ^ (purpose + 1) * 0x85ebca6bu;
  x = (x ^ x >> 16) * 0x7feb352du;
  x = (x ^ x >> 15) * 0x846ca68bu;
  const double at = double((x ^ x >> 16) >> 8) / (1 << 24) + sample * kSteps[purpose];
  return std::min(float(at - std::floor(at)), 0.9999999f);
}

Float3 sky(const Float3& way) {
  const float up = std::sqrt(std::clamp(way[1], 0.0f, 1.0f));
  return (1 - up) * Float3{0.75f, 0.8f, 0.85f} + up * Float3{0.25f, 0.42f, 0.72f};
}

NifRay ray(const Float3& from, const Float3& way) {
  return {{from[0], from[1], from[2]}, 0, {way[0], way[1], way[2]}, kInfinity};
}

float srgb(float linear) {
  linear = std::clamp(linear, 0.0f, 1.0f);
  return linear <= 0.0031308f ? 12.92f * linear : 1.055f * std::pow(linear, 1 / 2.4f) - 0.055f;
}

/// What a batch of camera rays has hit.
struct Found {
  explicit Found(size_t count)
      : hit(count),
        t(count),
        u(count),
        v(count),
        normal(count),
        color(count),
        instance(count),
        triangle(count) {}
  std::vector<uint8_t> hit;
  std::vector<float> t, u, v;
  std::vector<Float3> normal, color;
  std::vector<uint32_t> instance, triangle;

  nifkit::Hits outputs() {
    return nifkit::Hits()
        .hit(hit)
        .t(t)
        .u(u)
        .v(v)
        .normal({normal[0].data(), 3 * normal.size()})
        .color({color[0].data(), 3 * color.size()})
        .instance(instance)
        .triangle(triangle);
  }
};

}  // namespace

Drawn draw(const Crowd& crowd, const View& view) {
  const Float3 ahead = normalised(view.target + -1.0f * view.eye),
               right = normalised(cross(ahead, {0, 1, 0})), up = cross(right, ahead);
  const Float3 across = perpendicular(kSun), along = cross(kSun, across);
  const float field = 0.8f / float(view.width);
  const uint32_t total = view.width * view.height * view.samples;
  Drawn drawn;
  std::vector<Float3> light(total), albedo;
  std::vector<NifRay> rays, to_sun, to_sky;
  std::vector<float> facing;    // the sun, of what a shadow ray starts from
  std::vector<uint32_t> asker;  // the sample
  std::vector<uint8_t> sun_visible(kBatch), sky_visible(kBatch);
  Found found(kBatch);
  const auto timed = [](double& seconds, auto&& query) {
    const double start = thread_seconds();
    query();
    seconds += thread_seconds() - start;
  };
  for (uint32_t first = 0; first < total; first += kBatch) {
    const uint32_t count = std::min(kBatch, total - first);
    rays.clear(), to_sun.clear(), to_sky.clear(), albedo.clear(), asker.clear(), facing.clear();
    for (uint32_t i = first; i < first + count; ++i) {
      const uint32_t pixel = i / view.samples, sample = i % view.samples;
      const float x = float(pixel % view.width) + random_of(pixel, sample, 0) - 0.5f * float(view.width),
                  y = 0.5f * float(view.height) - float(pixel / view.width) - random_of(pixel, sample, 1);
      rays.push_back(ray(view.eye, normalised(ahead + field * x * right + field * y * up)));
    }
    timed(drawn.camera, [&] { crowd.scene().intersect(nifkit::Rays(rays), found.outputs()); });
    drawn.camera_rays += count;
    for (uint32_t k = 0; k < count; ++k) {
      const uint32_t i = first + k, pixel = i / view.samples, sample = i % view.samples;
      const Float3 way{rays[k].direction[0], rays[k].direction[1], rays[k].direction[2]};
      if (!found.hit[k]) {
        light[i] = sky(way);
        continue;
      }
      const Float3& normal = found.normal[k];
      const Float3 origin = view.eye + found.t[k] * way + crowd.bias(found.instance[k]) * normal;
      albedo.push_back(
          crowd.colour(found.instance[k], found.triangle[k], found.u[k], found.v[k], found.color[k]));
      asker.push_back(i);
      facing.push_back(std::max(0.0f, dot(normal, kSun)));
      const float radius = kSunRadius * std::sqrt(random_of(pixel, sample, 2)),
                  turn = 2 * kPi * random_of(pixel, sample, 3);
      to_sun.push_back(
          ray(origin, normalised(kSun + radius * std::cos(turn) * across + radius * std::sin(turn) * along)));
      // Directions as frequent as the cosine makes them count, so each brings the sky's light times the albedo.
      const float z = std::sqrt(random_of(pixel, sample, 4)), r = std::sqrt(1 - z * z),
                  about = 2 * kPi * random_of(pixel, sample, 5);
      const Float3 x = perpendicular(normal), y = cross(normal, x);
      to_sky.push_back(
          ray(origin, normalised(r * std::cos(about) * x + r * std::sin(about) * y + z * normal)));
    }
    timed(drawn.sun,
          [&] { crowd.scene().query(nifkit::Rays(to_sun), nifkit::Answers().visible(sun_visible)); });
    timed(drawn.sky,
          [&] { crowd.scene().query(nifkit::Rays(to_sky), nifkit::Answers().visible(sky_visible)); });
    drawn.shadow_rays += to_sun.size();
    for (size_t k = 0; k < asker.size(); ++k) {
      const Float3 way{to_sky[k].direction[0], to_sky[k].direction[1], to_sky[k].direction[2]};
      Float3 sum{};
      if (sun_visible[k]) sum = facing[k] * kSunLight;
      if (sky_visible[k] && way[1] > 0) sum = sum + 0.75f * sky(way);
      for (size_t c = 0; c < 3; ++c) light[asker[k]][c] = albedo[k][c] * sum[c];
    }
  }
  drawn.colours.resize(size_t{view.width} * view.height);
  for (size_t pixel = 0; pixel < drawn.colours.size(); ++pixel) {
    Float3 mean{};
    for (uint32_t s = 0; s < view.samples; ++s) {
      // Each sample is limited, so that edges against the sky stay smooth.
      const Float3& sample = light[pixel * view.samples + s];
      for (size_t c = 0; c < 3; ++c) mean[c] += std::min(sample[c], 1.0f) / float(view.samples);
    }
    for (size_t c = 0; c < 3; ++c) drawn.colours[pixel][c] = srgb(mean[c]);
  }
  return drawn;
}

void write_png(const std::vector<Float3>& colours, const View& view, const std::string& path) {
  std::vector<uint8_t> bytes;
  for (const Float3& colour : colours)
    for (const float value : colour) bytes.push_back(uint8_t(255 * value + 0.5f));
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = view.width, image.height = view.height;
  image.format = PNG_FORMAT_RGB;
  if (!png_image_write_to_file(&image, path.c_str(), 0, bytes.data(), 0, nullptr))
    throw std::runtime_error(path + ": " + image.message);
}
