// Renders one view of the mesh from each rival's answers: a picture, and a map of its wrong answers.
#pragma once

#include <vector>

#include "tools/render/image_file.hpp"
#include "tools/study/rival.hpp"

namespace nif::tools {

/// Rays from the surface points that a camera sees, with Embree's answers.
class StudyView {
 public:
  /// Runs in parallel, with the same result for any number of threads.
  StudyView(const StudiedMesh& mesh, uint32_t width, uint32_t height);

  /// The picture by Embree, encoded.
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
    float sunny;   ///< and how much it faces the sun; 0 if it faces away
  };
  /// A sun and ambient light, for rays that are visible or not (1 or 0 each).
  render::Image paint(const std::vector<uint8_t>& visible) const;

  uint32_t width_, height_;
  std::vector<Pixel> pixels_;
  std::vector<float> weights_;  ///< [ray] for ambient light
  bake::RaysWithTruth rays_;    ///< kRays for each pixel: to the sun, then over the hemisphere
};

}  // namespace nif::tools
