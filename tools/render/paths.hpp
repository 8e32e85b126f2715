// The paths of a camera's samples, and the shadow rays at their points.
#pragma once

#include <cmath>
#include <numbers>

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

/// Follows paths; what it refers to must outlive it. Any number of threads may use one.
class Paths {
 public:
  Paths(const World& world, const Lighting& lighting, const Camera& camera, const PictureDescription& picture)
      : world_(world), lighting_(lighting), camera_(camera), picture_(picture) {}

  PixelSamples samples_of(uint32_t x, uint32_t y) const {
    return {picture_.seed, uint64_t{y} << 32 | x, picture_.samples};
  }

  /// One sample of pixel (x, y), whose numbers are those of samples_of(). Calls `shadow(ShadowRay)` for each
  /// light at each point of the path that it may reach, and `miss(direction)` where the camera sees nothing.
  template <class Shadow, class Miss>
  void follow(const PixelSamples& numbers, uint32_t sample, uint32_t x, uint32_t y, const Shadow& shadow,
              const Miss& miss) const {
    const Pair jitter = numbers.pair(0, sample);
    Double3 origin = camera_.position;
    Double3 direction =
        camera_.direction((x + jitter[0]) / picture_.width, (y + jitter[1]) / picture_.height);
    Colour carried{1, 1, 1};
    const auto lights = uint32_t(lighting_.count());
    for (uint32_t bounce = 0; bounce <= picture_.bounces; ++bounce) {
      const std::optional<SurfacePoint> hit = world_.trace(origin, direction);
      if (!hit) {
        if (bounce == 0) miss(direction);
        return;  // skies are drawn as lights at each point
      }
      for (size_t c = 0; c < 3; ++c) carried[c] *= hit->albedo[c];
      const Double3 start = hit->position + hit->normal * hit->bias;
      const uint32_t dimension = 1 + bounce * (lights + 1);
      for (uint32_t light = 0; light < lights; ++light) {
        const LightSample drawn =
            lighting_.draw(light, start, hit->normal, numbers.pair(dimension + light, sample));
        const double cosine = bake::dot(drawn.direction, hit->normal);
        Colour radiance{};
        for (size_t c = 0; c < 3; ++c)
          radiance[c] = carried[c] * drawn.irradiance[c] * cosine / std::numbers::pi;
        // Lights are no part of the scene that is asked, so the ray may go all the way.
        if (cosine > 0 && radiance[0] + radiance[1] + radiance[2] > 0)
          shadow(ShadowRay{bake::make_segment(start, drawn.direction, float(drawn.distance)), radiance});
      }
      direction = cosine_direction(hit->normal, numbers.pair(dimension + lights, sample));
      origin = start;
    }
  }

 private:
  const World& world_;
  const Lighting& lighting_;
  const Camera& camera_;
  const PictureDescription& picture_;
};

}  // namespace nif::render
