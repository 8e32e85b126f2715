// One view of the mesh as each rival sees it: a picture, and a map of its wrong answers.
#pragma once

#include <vector>

#include "tools/render/image.hpp"
#include "tools/study/rival.hpp"

namespace nif::tools {

/// Rays from what a camera sees of the surface, with the answers of Embree.
class StudyView {
 public:
  /// In parallel, and the same for any number of threads.
  StudyView(const StudiedMesh& mesh, uint32_t width, uint32_t height);

  /// By Embree, encoded.
  render::Image reference() const { return paint(rays_.visible); }
  struct Seen {
    render::Image picture, errors;  ///< encoded
    double wrong = 0;               ///< share of all rays
  };
  Seen ask(const Rival& rival) const;

 private:
  struct Pixel {
    uint32_t x, y;
    float facing;  ///< how much the surface faces the camera, 0..1
    float sunny;   ///< and the sun; 0 where it faces away
  };
  /// A sun and ambient light, by which of the rays are free (1 or 0 each).
  render::Image paint(const std::vector<uint8_t>& visible) const;

  uint32_t width_, height_;
  std::vector<Pixel> pixels_;
  std::vector<float> weights_;  ///< [ray] of ambient light
  bake::LabelledRays rays_;     ///< kRays for each pixel: to the sun, then over the half space
};

}  // namespace nif::tools
