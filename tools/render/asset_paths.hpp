// Traces paths with assets alone: their camera rays, shadow rays, reflections and bounces, many at a time.
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "tools/render/paths.hpp"

namespace nif::render {

/// Everything that it refers to must outlive it. Not thread-safe.
class AssetPaths {
 public:
  AssetPaths(const World& world, const Paths& paths) : world_(world), paths_(paths) {}

  /// Called with the first hit of a camera ray according to Embree (`exact`) and to assets (`said`).
  using Compare = std::function<void(size_t pixel, const std::optional<SurfacePoint>& exact,
                                     const std::optional<SurfacePoint>& said)>;
  /// Called with radiance that reaches a pixel.
  using Add = std::function<void(size_t pixel, const Colour& colour)>;
  using Background = std::function<Colour(const Double3& direction)>;

  /// Stores one sample of a pixel for run(). `exact` is the first hit of its ray according to Embree.
  void add(size_t pixel, const PixelSamples& numbers, uint32_t sample, const CameraRay& ray,
           const std::optional<SurfacePoint>& exact);

  /// Follows all stored samples to their ends, and clears them.
  void run(const Compare& compare, const Add& add, const Background& background);

 private:
  struct Path {
    size_t pixel;
    PixelSamples numbers;
    uint32_t sample;
    PathRay ray;
  };
  void find_hits();
  void answer_shadows(const Add& add);

  const World& world_;
  const Paths& paths_;
  std::vector<Path> paths_now_, paths_next_;
  std::vector<std::optional<SurfacePoint>> exact_, hits_;
  std::vector<Segment> rays_, shadows_;
  struct Carried {
    size_t pixel;
    Colour colour;
  };
  std::vector<Carried> carried_;  // [shadow]
  std::vector<uint8_t> visible_, beside_;
};

}  // namespace nif::render
