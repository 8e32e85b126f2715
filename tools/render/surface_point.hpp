// The point where a camera ray or a bounce hits a surface.
#pragma once

#include "tools/render/scene.hpp"

namespace nif::render {

/// What is the same all over a surface.
struct SurfaceKind {
  Colour albedo;
  double bias;           ///< how far from the surface shadow rays start
  double diagonal = 0;   ///< of the object's AABB, world units
  bool primary = false;  ///< of an object whose camera rays a field for primary rays may answer
  bool mirror = false;   ///< reflects as a mirror, and scatters nothing
  bool asset = false;    ///< of an object that has an asset
};

struct SurfacePoint {
  Double3 position;  ///< of a hit that a field for primary rays has found, before it by the field's margin
  Double3 normal;   ///< unit length, on the side that the ray came from; geometric where triangles were asked
  double distance;  ///< to the hit, in lengths of the ray's direction
  SurfaceKind kind;
};

}  // namespace nif::render
