// A pinhole camera, which turns a scene's camera description into ray directions.
#pragma once

#include "formats/mesh/box.hpp"
#include "tools/render/picture_scene.hpp"

namespace nif::render {

struct Camera {
  Double3 position;
  Double3 forward;      ///< unit length
  Double3 right, down;  ///< from the picture's middle to its edges, at a distance of 1

  /// Direction through the point x, y of the picture, each 0..1 from its upper left corner; unit length.
  Double3 direction(double x, double y) const {
    const Double3 d = forward + right * (2 * x - 1) + down * (2 * y - 1);
    return d * (1 / length(d));
  }
};

/// Places a camera. An orbit needs the objects' box; `up` is the up axis, for all cameras except views.
Camera place_camera(const CameraDescription& camera, const mesh::Box& box, int up, uint32_t width,
                    uint32_t height);

}  // namespace nif::render
