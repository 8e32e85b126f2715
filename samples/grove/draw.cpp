// Whole rows of pixels are traced at once: all camera rays, then the shadow rays of all that they hit, one towards the sun's
// disk and one towards a direction of the sky. Batches of many rays are what both libraries answer fastest.
#include "draw.hpp"

#include <png.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace {

constexpr float kPi = 3.14159265f, kInfinity = std::numeric_limits<float>::infinity();
constexpr float kSunRadius = 0.0047f;  // of the real sun, in radians
constexpr float kSunLight = 3.2f;
constexpr size_t kBatch = size_t{1} << 15;
/// Colours of things by the number of their model; the first is the ground of a generated forest.
constexpr Float3 kColours[] = {{0.17f, 0.18f, 0.09f}, {0.18f, 0.30f, 0.08f}, {0.34f, 0.42f, 0.13f},
                               {0.19f, 0.35f, 0.12f}, {0.36f, 0.42f, 0.2f},  {0.1f, 0.21f, 0.1f}};

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

const Float3 kSun = normalised({0.55f, 0.62f, 0.35f});

/// A number in 0 .. 1 for a sample and a purpose.
float random_of(uint32_t sample, uint32_t purpose) {
  uint32_t x = sample * 0x9e3779b1u ^ purpose * 0x85ebca6bu;
  x = (x ^ x >> 16) * 0x7feb352du;
  x = (x ^ x >> 15) * 0x846ca68bu;
  return float((x ^ x >> 16) >> 8) / (1 << 24);
}

Float3 sky(const Float3& way) {
  const float up = std::clamp(way[1], 0.0f, 1.0f);
  return (1 - up) * Float3{0.9f, 0.96f, 1.0f} + up * Float3{0.5f, 0.7f, 1.0f};
}

NifRay ray(const Float3& from, const Float3& way) {
  return {{from[0], from[1], from[2]}, 0, {way[0], way[1], way[2]}, kInfinity};
}

float srgb(float linear) {
  linear = std::clamp(linear, 0.0f, 1.0f);
  return linear <= 0.0031308f ? 12.92f * linear : 1.055f * std::pow(linear, 1 / 2.4f) - 0.055f;
}

/// Looks over the forest from one of its corners.
class Camera {
 public:
  Camera(const Trees& trees, uint32_t width, uint32_t height) : width_(width), height_(height) {
    const Float3 size = trees.high + -1 * trees.low, middle = 0.5f * (trees.low + trees.high);
    eye_ = middle + Float3{-0.3f * size[0], 0.07f * size[0], 0.42f * size[2]};
    ahead_ = normalised(middle + Float3{0.06f * size[0], -0.15f * size[1], 0} + -1 * eye_);
    right_ = normalised(cross(ahead_, {0, 1, 0}));
    up_ = cross(right_, ahead_);
  }
  NifRay through(float x, float y) const {
    const float field = 0.9f / float(width_);
    return ray(eye_, normalised(ahead_ + field * (x - 0.5f * float(width_)) * right_ +
                                field * (0.5f * float(height_) - y) * up_));
  }

 private:
  uint32_t width_, height_;
  Float3 eye_, ahead_, right_, up_;
};

}  // namespace

Drawn draw(Tracer& tracer, const Trees& trees, uint32_t width, uint32_t height, uint32_t samples) {
  Drawn drawn;
  drawn.picture = {width, height, std::vector<Float3>(size_t{width} * height)};
  const Camera camera(trees, width, height);
  const float floor = trees.low[1], bias = 1e-4f * (trees.high[1] - trees.low[1]);
  const uint32_t total = width * height * samples;
  const Float3 across = perpendicular(kSun), along = cross(kSun, across);
  std::vector<NifRay> rays, to_sun, to_sky;
  std::vector<Float3> albedo;   // of what a shadow ray starts from, times what it may bring
  std::vector<uint32_t> asker;  // the sample
  std::vector<uint8_t> sun_visible, sky_visible;
  Hits hits;
  std::vector<Float3> light(total);
  for (uint32_t first = 0; first < total; first += kBatch) {
    const auto count = uint32_t(std::min<size_t>(kBatch, total - first));
    rays.clear(), to_sun.clear(), to_sky.clear(), albedo.clear(), asker.clear();
    for (uint32_t i = first; i < first + count; ++i) {
      const uint32_t pixel = i / samples;
      rays.push_back(
          camera.through(float(pixel % width) + random_of(i, 0), float(pixel / width) + random_of(i, 1)));
    }
    drawn.camera += tracer.find_hits(rays, hits);
    drawn.camera_rays += count;
    for (uint32_t k = 0; k < count; ++k) {
      const uint32_t i = first + k;
      const Float3 from{rays[k].origin[0], rays[k].origin[1], rays[k].origin[2]},
          way{rays[k].direction[0], rays[k].direction[1], rays[k].direction[2]};
      // Everything stands on an endless floor, for which no tracer is asked.
      const float t_floor = way[1] < 0 ? (floor - from[1]) / way[1] : kInfinity;
      const bool on_floor = t_floor < hits.t[k];
      const float t = std::min(t_floor, hits.t[k]);
      if (t == kInfinity) {
        light[i] = sky(way);
        continue;
      }
      Float3 normal = on_floor ? Float3{0, 1, 0} : hits.normal[k];
      if (dot(normal, way) > 0) normal = -1 * normal;
      const Float3 origin = from + t * way + bias * normal;
      const uint32_t model = on_floor ? 0 : trees.placed[hits.placed[k]].model;
      const bool one_kind = trees.models.size() == 1;
      albedo.push_back(kColours[one_kind && !on_floor ? 1 : model % std::size(kColours)]);
      asker.push_back(i);
      const float radius = kSunRadius * std::sqrt(random_of(i, 2)), turn = 2 * kPi * random_of(i, 3);
      to_sun.push_back(
          ray(origin, normalised(kSun + radius * std::cos(turn) * across + radius * std::sin(turn) * along)));
      // Directions as frequent as the cosine makes them count, so each brings the sky's light times the albedo. Both sides
      // of a leaf are lit alike.
      const float z = std::sqrt(random_of(i, 4)), r = std::sqrt(1 - z * z), about = 2 * kPi * random_of(i, 5);
      const Float3 x = perpendicular(normal), y = cross(normal, x);
      to_sky.push_back(
          ray(origin, normalised(r * std::cos(about) * x + r * std::sin(about) * y + z * normal)));
      light[i] = {std::max(0.0f, dot(normal, kSun)), 0, 0};  // until the answers are there
    }
    drawn.sun += tracer.find_visible(to_sun, sun_visible);
    drawn.sky += tracer.find_visible(to_sky, sky_visible);
    drawn.shadow_rays += to_sun.size();
    for (size_t k = 0; k < asker.size(); ++k) {
      const float facing = light[asker[k]][0];
      const Float3 direction{to_sky[k].direction[0], to_sky[k].direction[1], to_sky[k].direction[2]};
      Float3 sum{};
      if (sun_visible[k]) sum = kSunLight * facing * Float3{1, 0.95f, 0.85f};
      if (sky_visible[k] && direction[1] > 0) sum = sum + sky(direction);
      for (size_t c = 0; c < 3; ++c) light[asker[k]][c] = albedo[k][c] * sum[c];
    }
  }
  for (size_t pixel = 0; pixel < drawn.picture.colours.size(); ++pixel) {
    Float3 mean{};
    for (uint32_t s = 0; s < samples; ++s) mean = mean + 1 / float(samples) * light[pixel * samples + s];
    for (size_t c = 0; c < 3; ++c) drawn.picture.colours[pixel][c] = srgb(mean[c]);
  }
  return drawn;
}

double psnr(const Picture& a, const Picture& b) {
  double sum = 0;
  for (size_t i = 0; i < a.colours.size(); ++i)
    for (size_t c = 0; c < 3; ++c) {
      const double off = double(a.colours[i][c]) - b.colours[i][c];
      sum += off * off;
    }
  return -10 * std::log10(sum / (3 * double(a.colours.size())));
}

void write_png(const Picture& picture, const std::string& path) {
  std::vector<uint8_t> bytes;
  for (const Float3& colour : picture.colours)
    for (const float value : colour) bytes.push_back(uint8_t(255 * value + 0.5f));
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = picture.width, image.height = picture.height;
  image.format = PNG_FORMAT_RGB;
  if (!png_image_write_to_file(&image, path.c_str(), 0, bytes.data(), 0, nullptr))
    throw std::runtime_error(path + ": " + image.message);
}
