// Describes the point where a camera ray or a bounce hits a surface.
#pragma once

#include "tools/render/picture_scene.hpp"

namespace nif::render {

/// Properties that are constant over a surface.
struct SurfaceKind {
  Colour albedo;
  double bias;           ///< distance from the surface at which shadow rays start
  double diagonal = 0;   ///< of the object's AABB, world units
  bool primary = false;  ///< whether a field for primary rays may answer the object's camera rays
  bool mirror = false;   ///< reflects like a mirror, and scatters nothing
  bool asset = false;    ///< whether the object has an asset
};

struct SurfacePoint {
  Double3 position;  ///< for a hit found by a field for primary rays, in front of it by the field's margin
  /// Unit length, on the side that the ray came from; geometric if triangles were intersected.
  Double3 normal;
  double distance;  ///< to the hit, in lengths of the ray's direction
  SurfaceKind kind;
};

}  // namespace nif::render
