// Renders one camera's picture with direct light, reflections and diffuse bounces: with several answers to
// the same shadow rays, with camera rays answered by fields for primary rays, or by assets alone.
#pragma once

#include <array>
#include <atomic>
#include <functional>

#include "tools/render/camera.hpp"
#include "tools/render/image_file.hpp"
#include "tools/render/lighting.hpp"
#include "tools/render/world.hpp"

namespace nif::render {

/// What answers the shadow rays. Embree answers all other rays, except in the last two modes.
enum class Mode {
  reference,    ///< Embree
  bits,         ///< assets, visible or occluded
  probability,  ///< assets; a light is weighted by the probability that it is visible
  hybrid,       ///< assets if they are sure, otherwise Embree
  primary,      ///< Embree; fields for primary rays answer camera rays (World::has_primaries())
  asset,        ///< assets, also for all other rays, if RenderOptions::by_assets
};
inline constexpr std::array kModes{Mode::reference, Mode::bits,    Mode::probability,
                                   Mode::hybrid,    Mode::primary, Mode::asset};
const char* name_of(Mode mode);

/// Statistics of a picture's shadow rays. Seconds are summed over threads.
struct ShadowRays {
  uint64_t rays = 0;
  uint64_t leak = 0, spurious = 0;  ///< by bits: occluded but answered visible, and vice versa
  uint64_t certain = 0;
  uint64_t exact = 0;  ///< rays that hybrid leaves to Embree
  double embree_seconds = 0;
  double asset_seconds = 0, beside_seconds = 0;  ///< of the assets, and of Embree for objects without one
  ShadowRays& operator+=(const ShadowRays& other);
};

/// How camera rays answered by fields for primary rays, or by assets, differ from Embree. "Object" means one
/// that these answer for.
struct CameraRays {
  uint64_t rays = 0;    ///< all camera rays
  uint64_t hits = 0;    ///< rays whose first hit by Embree is on an object
  uint64_t differ = 0;  ///< rays whose first hit is on an object for one side only
  /// Rays whose first hit is on an object for both sides; the errors are summed over these:
  uint64_t both = 0;
  double depth_error = 0;   ///< difference of the distances, over the diagonal of the object's AABB
  double normal_error = 0;  ///< angle between the normals, degrees
  CameraRays& operator+=(const CameraRays& other);
};

struct Rendering {
  /// By Mode, linear, exposed; empty if nothing answers in that mode.
  std::array<Image, kModes.size()> images;
  /// Normals by Embree and by whatever answers camera rays, as colours from 0 to 1, black where there is no
  /// surface; empty if only Embree does.
  std::array<Image, 2> normals;
  ShadowRays shadow_rays;
  CameraRays camera_rays;
};

/// Rays that assets are not asked about, to isolate the error of the other rays.
enum class Exact {
  none,
  inside,   ///< rays that start within an asset's AABB, as the paper shows its outer field
  outside,  ///< all other rays
};

struct RenderOptions {
  PictureDescription picture;
  double exposure = 1;
  Exact exact = Exact::none;
  double confidence = 0.9;  ///< hybrid accepts an answer if max(p, 1 - p) is at least this
  /// Makes only the pictures of Mode::reference and Mode::asset. World::assets() must support first hits.
  bool by_assets = false;
};

/// Called now and then, from the calling thread; `fraction` of the work is done. When all pixels have the
/// same number of samples, `so_far` returns the current picture; otherwise it is empty.
using RenderCallback = std::function<void(double fraction, const std::function<Rendering()>& so_far)>;

/// The factor on radiance that gives unshadowed ground in the middle of the scene the value
/// picture.ground_level, or picture.exposure.
double find_exposure(const SceneDescription& scene, const World& world, const Lighting& lighting);

/// The result does not depend on the number of threads. Throws Error(interrupted) once `cancel` is set.
Rendering render(const World& world, const Lighting& lighting, const Camera& camera,
                 const RenderOptions& options, const RenderCallback& callback,
                 const std::atomic<bool>& cancel);

}  // namespace nif::render
