// Traces a picture's primary rays, generates their shadow rays, and answers these in several ways.
#pragma once

#include <vector>

#include "picture.hpp"
#include "world.hpp"

struct Shading {
  uint32_t width, height;
  std::vector<float> light;     // [4 samples of each pixel] of the sun, without shadows
  std::vector<uint32_t> asker;  // [shadow rays] its sample
  std::vector<NifRay> rays;     // [shadow rays] towards the sun
};

/// Traces primary rays in the renderer's scene. `soft` is the radius of the sun's disk, as a tangent.
Shading shade(const World& world, uint32_t width, uint32_t height, float soft);

/// 1 visible, 0 in shadow.
using Answers = std::vector<uint8_t>;

/// Embree in packets of 16.
struct Asked {
  Answers visible;
  double seconds;
};
Asked ask_embree(RTCScene scene, const std::vector<NifRay>& rays);
Asked ask_directly(const nifkit::Scene& scene, const std::vector<NifRay>& rays);
/// Answers that `proofs` proves are final, and `triangles` answers the `open` rest, each over the interval
/// that matters. `triangles` also has the floor, but no ray meets it, because rays go up from there.
Asked ask_proofs_first(const nifkit::Scene& proofs, RTCScene triangles, const std::vector<NifRay>& rays,
                       size_t& open);

/// First hits, by rtcIntersect in packets of 16.
struct FirstHits {
  std::vector<float> t;  ///< infinite: none
  double seconds;
};
FirstHits find_hits(RTCScene scene, const std::vector<NifRay>& rays);

/// Fills the picture's columns from `left` on.
void draw(const Shading& shading, const Answers& visible, Picture& picture, uint32_t left);
