// Draws a moment under sun and sky. All rays are answered by assets: first hits for the camera's, visibility for the rest.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "crowd.hpp"

struct View {
  Float3 eye, target;
  uint32_t width = 640, height = 360, samples = 16;  ///< a pixel
};

struct Drawn {
  std::vector<Float3> colours;                ///< [height][width], sRGB from 0 to 1
  double camera = 0, sun = 0, sky = 0;        ///< seconds of the thread in queries
  uint64_t camera_rays = 0, shadow_rays = 0;  ///< shadow rays to the sun, and as many to the sky
};

Drawn draw(const Crowd& crowd, const View& view);
void write_png(const std::vector<Float3>& colours, const View& view, const std::string& path);
