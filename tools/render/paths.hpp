// Generates the paths of a camera's samples, and the shadow rays at their points.
#pragma once

#include <cmath>
#include <numbers>
#include <optional>

#include "bake/ground_truth/ray_sets.hpp"
#include "tools/render/camera.hpp"
#include "tools/render/lighting.hpp"
#include "tools/render/pixel_samples.hpp"
#include "tools/render/world.hpp"

namespace nif::render {

/// What a shadow ray adds to its pixel if nothing blocks it.
struct ShadowRay {
  Segment segment;
  Colour radiance;
};

/// Start of a path.
struct CameraRay {
  Double3 origin, direction;
};

/// The next ray of a path, with the share of its radiance that reaches the pixel.
struct PathRay {
  Double3 origin, direction;
  Colour carried{1, 1, 1};
  uint32_t bounces = 0, reflections = 0;  ///< so far
  bool mirrored = true;                   ///< comes from the camera or a mirror, not from a diffuse surface
};

/// Maximum number of reflections on a path; longer paths carry no light.
inline constexpr uint32_t kMaxReflections = 8;

/// Follows paths. Everything that it refers to must outlive it. Any number of threads may use one.
class Paths {
 public:
  Paths(const World& world, const Lighting& lighting, const Camera& camera, const PictureDescription& picture)
      : world_(world), lighting_(lighting), camera_(camera), picture_(picture) {}

  PixelSamples samples_of(uint32_t x, uint32_t y) const {
    return {picture_.seed, uint64_t{y} << 32 | x, picture_.samples};
  }

  /// The camera ray of one sample of pixel (x, y), with the numbers of samples_of().
  CameraRay camera_ray(const PixelSamples& numbers, uint32_t sample, uint32_t x, uint32_t y) const {
    const Pair jitter = numbers.pair(0, sample);
    return {camera_.position,
            camera_.direction((x + jitter[0]) / picture_.width, (y + jitter[1]) / picture_.height)};
  }

  /// Traces one sample of pixel (x, y) with Embree. Calls `shadow(ShadowRay)` for each light that each point
  /// of the path may receive, and `miss(direction, carried)` where the background is seen.
  template <class Shadow, class Miss>
  void follow(const PixelSamples& numbers, uint32_t sample, uint32_t x, uint32_t y, const Shadow& shadow,
              const Miss& miss) const {
    const CameraRay ray = camera_ray(numbers, sample, x, y);
    follow(numbers, sample, ray, world_.trace(ray.origin, ray.direction), shadow, miss);
  }

  /// The same, with `hit` given as the first hit of the camera ray.
  template <class Shadow, class Miss>
  void follow(const PixelSamples& numbers, uint32_t sample, const CameraRay& ray,
              std::optional<SurfacePoint> hit, const Shadow& shadow, const Miss& miss) const {
    std::optional<PathRay> next = step(numbers, sample, {ray.origin, ray.direction}, hit, shadow, miss);
    while (next) {
      hit = world_.trace(next->origin, next->direction);
      next = step(numbers, sample, *next, hit, shadow, miss);
    }
  }

  /// One point of a path: `ray` has arrived at `hit`. Returns the next ray, if there is one.
  template <class Shadow, class Miss>
  std::optional<PathRay> step(const PixelSamples& numbers, uint32_t sample, const PathRay& ray,
                              const std::optional<SurfacePoint>& hit, const Shadow& shadow,
                              const Miss& miss) const {
    if (!hit) {
      // If a diffuse bounce hits nothing, the sky has already been sampled as a light. Without a sky, the
      // background is a colour to look at and gives no light.
      if (ray.mirrored && (ray.bounces == 0 || lighting_.has_sky())) miss(ray.direction, ray.carried);
      return std::nullopt;
    }
    PathRay next = ray;
    for (size_t c = 0; c < 3; ++c) next.carried[c] *= hit->kind.albedo[c];
    next.origin = hit->position + hit->normal * hit->kind.bias;
    if (hit->kind.mirror) {
      if (++next.reflections > kMaxReflections) return std::nullopt;
      next.direction = ray.direction - hit->normal * (2 * dot(ray.direction, hit->normal));
      next.direction = next.direction * (1 / length(next.direction));
      next.mirrored = true;
      return next;
    }
    const auto lights = uint32_t(lighting_.count());
    const uint32_t dimension = 1 + ray.bounces * (lights + 1);
    for (uint32_t light = 0; light < lights; ++light) {
      const LightSample drawn =
          lighting_.draw(light, next.origin, hit->normal, numbers.pair(dimension + light, sample));
      const double cosine = dot(drawn.direction, hit->normal);
      Colour radiance{};
      for (size_t c = 0; c < 3; ++c)
        radiance[c] = next.carried[c] * drawn.irradiance[c] * cosine / std::numbers::pi;
      // The traced scene does not contain the lights, so the ray may extend up to the light.
      if (cosine > 0 && radiance[0] + radiance[1] + radiance[2] > 0)
        shadow(ShadowRay{bake::make_segment(next.origin, drawn.direction, float(drawn.distance)), radiance});
    }
    if (ray.bounces == picture_.bounces) return std::nullopt;
    next.direction = cosine_direction(hit->normal, numbers.pair(dimension + lights, sample));
    ++next.bounces;
    next.mirrored = false;
    return next;
  }

 private:
  const World& world_;
  const Lighting& lighting_;
  const Camera& camera_;
  const PictureDescription& picture_;
};

}  // namespace nif::render
