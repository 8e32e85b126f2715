#include "check.hpp"

namespace {

// Like that of light.comp.
uint32_t scrambled(uint32_t i) {
  const uint32_t a = (i ^ 61u ^ (i >> 16)) * 9u;
  const uint32_t b = (a ^ (a >> 4)) * 0x27d4eb2du;
  return b ^ (b >> 15);
}

}  // namespace

size_t count_differences(const nifkit::Scene& scene, std::span<const Pixel> pixels,
                         std::span<const std::array<float, 4>> directions, uint32_t samples, int up,
                         std::span<const Light> light) {
  const uint32_t half = uint32_t(directions.size() / 2);
  std::vector<NifRay> rays;
  std::vector<bool> of_sky;
  std::vector<uint8_t> visible;
  size_t differences = 0;
  for (size_t i = 0; i < pixels.size(); ++i) {
    const Pixel& pixel = pixels[i];
    rays.clear(), of_sky.clear();
    const auto add = [&](const Vec3& direction, bool sky) {
      rays.push_back({{pixel.start[0], pixel.start[1], pixel.start[2]},
                      0,
                      {direction[0], direction[1], direction[2]},
                      1e30f});
      of_sky.push_back(sky);
    };
    for (uint32_t k = 0; k < samples && pixel.kind != kNothing; ++k) {
      const uint32_t which = (scrambled(uint32_t(i)) + k) & (half - 1);
      const auto& sun = directions[which];
      const auto& sphere = directions[half + which];
      const Vec3& n = pixel.normal;
      const float x = sun[0] * n[0], y = sun[1] * n[1], z = sun[2] * n[2];
      const float cosine = x + y + z;
      if (cosine > 0 && sun[up] > 0) add({sun[0], sun[1], sun[2]}, false);
      const Vec3 to_sky{n[0] + sphere[0], n[1] + sphere[1], n[2] + sphere[2]};
      if (to_sky[up] > 0) add(to_sky, true);
    }
    visible.resize(rays.size());
    if (!rays.empty()) scene.query(nifkit::Rays(rays), nifkit::Answers().visible(visible));
    uint32_t sun = 0, sky = 0;
    for (size_t k = 0; k < rays.size(); ++k) (of_sky[k] ? sky : sun) += visible[k];
    differences += sun != light[i].sun || sky != light[i].sky || rays.size() != light[i].asked;
  }
  return differences;
}
