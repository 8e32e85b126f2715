// The paths of a camera's samples, and the shadow rays at their points.
#pragma once

#include <cmath>
#include <numbers>

#include "bake/oracle/ray_sets.hpp"
#include "tools/render/camera.hpp"
#include "tools/render/lighting.hpp"
#include "tools/render/pixel_samples.hpp"
#include "tools/render/world.hpp"

namespace nif::render {

/// What a shadow ray brings to its pixel where nothing blocks it.
struct ShadowRay {
  Segment segment;
  Colour radiance;
};

/// Where a path starts.
struct CameraRay {
  Double3 origin, direction;
};

/// Follows paths; what it refers to must outlive it. Any number of threads may use one.
class Paths {
 public:
  Paths(const World& world, const Lighting& lighting, const Camera& camera, const PictureDescription& picture)
      : world_(world), lighting_(lighting), camera_(camera), picture_(picture) {}

  PixelSamples samples_of(uint32_t x, uint32_t y) const {
    return {picture_.seed, uint64_t{y} << 32 | x, picture_.samples};
  }

  /// That of one sample of pixel (x, y), whose numbers are those of samples_of().
  CameraRay camera_ray(const PixelSamples& numbers, uint32_t sample, uint32_t x, uint32_t y) const {
    const Pair jitter = numbers.pair(0, sample);
    return {camera_.position,
            camera_.direction((x + jitter[0]) / picture_.width, (y + jitter[1]) / picture_.height)};
  }

  /// One sample of pixel (x, y). Calls `shadow(ShadowRay)` for each light at each point of the path that it
  /// may reach, and `miss(direction)` where the camera sees nothing.
  template <class Shadow, class Miss>
  void follow(const PixelSamples& numbers, uint32_t sample, uint32_t x, uint32_t y, const Shadow& shadow,
              const Miss& miss) const {
    const CameraRay ray = camera_ray(numbers, sample, x, y);
    follow(numbers, sample, ray, world_.trace(ray.origin, ray.direction), shadow, miss);
  }

  /// The same where the camera's ray is said to come to `hit`.
  template <class Shadow, class Miss>
  void follow(const PixelSamples& numbers, uint32_t sample, const CameraRay& ray,
              std::optional<SurfacePoint> hit, const Shadow& shadow, const Miss& miss) const {
    if (!hit) return miss(ray.direction);
    Colour carried{1, 1, 1};
    const auto lights = uint32_t(lighting_.count());
    for (uint32_t bounce = 0; hit; ++bounce) {
      for (size_t c = 0; c < 3; ++c) carried[c] *= hit->kind.albedo[c];
      const Double3 start = hit->position + hit->normal * hit->kind.bias;
      const uint32_t dimension = 1 + bounce * (lights + 1);
      for (uint32_t light = 0; light < lights; ++light) {
        const LightSample drawn =
            lighting_.draw(light, start, hit->normal, numbers.pair(dimension + light, sample));
        const double cosine = dot(drawn.direction, hit->normal);
        Colour radiance{};
        for (size_t c = 0; c < 3; ++c)
          radiance[c] = carried[c] * drawn.irradiance[c] * cosine / std::numbers::pi;
        // Lights are no part of the scene that is asked, so the ray may go all the way.
        if (cosine > 0 && radiance[0] + radiance[1] + radiance[2] > 0)
          shadow(ShadowRay{bake::make_segment(start, drawn.direction, float(drawn.distance)), radiance});
      }
      if (bounce == picture_.bounces) return;
      // Where it then meets nothing, the sky has been drawn as a light already.
      hit = world_.trace(start, cosine_direction(hit->normal, numbers.pair(dimension + lights, sample)));
    }
  }

 private:
  const World& world_;
  const Lighting& lighting_;
  const Camera& camera_;
  const PictureDescription& picture_;
};

}  // namespace nif::render
