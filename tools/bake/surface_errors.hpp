// Where on a mesh, at which angles and how far from it an asset's answers are wrong, as Embree sees it.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "tools/render/image.hpp"
#include "tools/render/world.hpp"

namespace nif::tools {

/// Rays that were asked, and what the asset said of them.
struct AskedRays {
  uint64_t rays = 0;
  uint64_t leak = 0;      ///< occluded, called visible
  uint64_t spurious = 0;  ///< visible, called occluded

  AskedRays& operator+=(const AskedRays& other);
};

struct SurfaceErrors {
  /// From the surface, by the angle between ray and normal: 0..10 degrees, 10..20, ..., 80..90.
  std::array<AskedRays, 9> by_angle{};
  /// By how far above the surface rays start, in diagonals of the object's AABB.
  static constexpr std::array kHeights{0.001, 0.003, 0.01, 0.03, 0.1};
  std::array<AskedRays, kHeights.size()> by_height{};
  /// One for each camera, encoded: the surface in grey, and the redder, the more rays from there were
  /// answered wrongly.
  std::vector<render::Image> maps;
};

/// Asks about rays from what each camera of the scene sees, in directions spread over the hemisphere about
/// the normal, so many from each pixel of pictures as large as the scene's. With `only_proven`, what the
/// asset does not prove counts as not asked. In parallel, and the same for any number of threads. `progress`
/// is told the share that is done. Throws Error(interrupted).
SurfaceErrors measure_surface(const render::SceneDescription& scene, const render::World& world,
                              uint32_t rays_a_pixel, bool only_proven, const std::atomic<bool>& cancel,
                              const std::function<void(double)>& progress);

}  // namespace nif::tools
