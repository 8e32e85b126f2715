// Draws the forest under sun and sky. Whoever traces the rays, they and their random numbers are the same.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "tracer.hpp"

struct Picture {
  uint32_t width, height;
  std::vector<Float3> colours;  // [height][width], sRGB from 0 to 1
};

struct Drawn {
  Picture picture;
  double camera = 0, sun = 0, sky = 0;        // seconds
  uint64_t camera_rays = 0, shadow_rays = 0;  // shadow rays to the sun, and as many to the sky

  double seconds() const { return camera + sun + sky; }
};

Drawn draw(Tracer& tracer, const Trees& trees, uint32_t width, uint32_t height, uint32_t samples);

/// In dB, with a peak of 1; infinite if the pictures are equal.
double psnr(const Picture& a, const Picture& b);
void write_png(const Picture& picture, const std::string& path);
