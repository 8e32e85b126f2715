// Renders one camera's picture with direct light, reflections and diffuse bounces: with several answers to
// the same shadow rays, with the answers of fields for primary rays to the camera's rays, or by assets alone.
#pragma once

#include <array>
#include <atomic>
#include <functional>

#include "tools/render/camera.hpp"
#include "tools/render/image.hpp"
#include "tools/render/lighting.hpp"
#include "tools/render/world.hpp"

namespace nif::render {

/// Who answers the shadow rays. Embree answers all others but for the last two.
enum class Mode {
  reference,    ///< Embree
  bits,         ///< assets, visible or occluded
  probability,  ///< assets, a light's share by the probability that it is visible
  hybrid,       ///< assets where they are sure, else Embree
  primary,      ///< Embree; the camera's rays `spherical` fields for primary rays (World::has_primaries())
  asset,        ///< assets, and so all other rays, where RenderOptions::by_assets
};
inline constexpr std::array kModes{Mode::reference, Mode::bits,    Mode::probability,
                                   Mode::hybrid,    Mode::primary, Mode::asset};
const char* name_of(Mode mode);

/// What the shadow rays of a picture came to. Seconds are summed over threads.
struct ShadowRays {
  uint64_t rays = 0;
  uint64_t leak = 0, spurious = 0;  ///< by bits: occluded called visible, and the other way round
  uint64_t certain = 0;
  uint64_t exact = 0;  ///< those that hybrid leaves to Embree
  double embree_seconds = 0;
  double asset_seconds = 0, beside_seconds = 0;  ///< the assets, and Embree for what has none
  ShadowRays& operator+=(const ShadowRays& other);
};

/// How those that answer camera rays (fields for primary rays, or all assets) differ from Embree. An object
/// is one that they answer for.
struct CameraRays {
  uint64_t rays = 0;        ///< all of them
  uint64_t hits = 0;        ///< those that come to an object first
  uint64_t differ = 0;      ///< those that do so by Embree and not by them, or the other way round
  uint64_t both = 0;        ///< those that do so by both; summed over these:
  double depth_error = 0;   ///< difference of the distances, over the diagonal of the object's AABB
  double normal_error = 0;  ///< angle between the normals, degrees
  CameraRays& operator+=(const CameraRays& other);
};

struct Rendering {
  /// By Mode, linear, exposed; empty where there is nobody to answer so.
  std::array<Image, kModes.size()> images;
  /// By Embree and by those that answer camera rays, as colours from 0 to 1, black where there is no surface;
  /// empty where nobody does.
  std::array<Image, 2> normals;
  ShadowRays shadow_rays;
  CameraRays camera_rays;
};

/// Rays that assets are not asked, to see one part of what they do alone.
enum class Exact {
  none,
  inside,   ///< those that start within an asset's AABB, as the paper shows its outer field
  outside,  ///< the others
};

struct RenderOptions {
  PictureDescription picture;
  double exposure = 1;
  Exact exact = Exact::none;
  double confidence = 0.9;  ///< hybrid trusts an answer with max(p, 1 - p) of at least this
  /// Makes the pictures of Mode::reference and Mode::asset, and no others. World::assets() must know first
  /// hits.
  bool by_assets = false;
};

/// Called now and then, from the calling thread; `fraction` of the work is done. Where all pixels have
/// equally many samples, `so_far` gives the picture as it is; else it is empty.
using RenderCallback = std::function<void(double fraction, const std::function<Rendering()>& so_far)>;

/// The factor on radiance that shows unshadowed ground in the middle of the scene at picture.ground_level, or
/// picture.exposure.
double find_exposure(const SceneDescription& scene, const World& world, const Lighting& lighting);

/// The same for any number of threads. Throws Error(interrupted) once `cancel` is set.
Rendering render(const World& world, const Lighting& lighting, const Camera& camera,
                 const RenderOptions& options, const RenderCallback& callback,
                 const std::atomic<bool>& cancel);

}  // namespace nif::render
