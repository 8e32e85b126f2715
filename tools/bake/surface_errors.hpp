// Finds where on a mesh, at which angles and at which distances an asset's answers are wrong, judged by
// Embree.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "tools/render/image_file.hpp"
#include "tools/render/world.hpp"

namespace nif::tools {

/// Counts of rays and of the asset's wrong answers to them.
struct AskedRays {
  uint64_t rays = 0;
  uint64_t leak = 0;      ///< occluded, but answered visible
  uint64_t spurious = 0;  ///< visible, but answered occluded

  AskedRays& operator+=(const AskedRays& other);
};

struct SurfaceErrors {
  /// From the surface, by the angle between ray and normal: 0..10 degrees, 10..20, ..., 80..90.
  std::array<AskedRays, 9> by_angle{};
  /// Height above the surface at which rays start, in diagonals of the object's AABB.
  static constexpr std::array kHeights{0.001, 0.003, 0.01, 0.03, 0.1};
  std::array<AskedRays, kHeights.size()> by_height{};
  /// One image for each camera, encoded: the surface in grey, and redder where more rays were answered
  /// wrongly.
  std::vector<render::Image> maps;
};

/// Traces `rays_a_pixel` rays from each surface point that a camera of the scene sees, in directions spread
/// over the hemisphere about the normal, for pictures of the scene's size. With `only_proven`, rays that the
/// asset does not prove do not count. Runs in parallel, with the same result for any number of threads.
/// `progress` gets the fraction done. Throws Error(interrupted).
SurfaceErrors measure_surface(const render::SceneDescription& scene, const render::World& world,
                              uint32_t rays_a_pixel, bool only_proven, const std::atomic<bool>& cancel,
                              const std::function<void(double)>& progress);

}  // namespace nif::tools
