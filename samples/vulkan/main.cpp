// Draws a .nif object in sun and sky. A Vulkan compute shader asks the object which rays are blocked (light.comp).
#include <nif/nif.hpp>

#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <stdexcept>
#include <string_view>

#include "check.hpp"
#include "gpu.hpp"
#include "light_shader.hpp"
#include "png_file.hpp"
#include "view.hpp"

namespace {

constexpr const char* kHelp =
    "picture ASSET.nif -o PICTURE.png [options]\n"
    "  --object N        which object of the asset (0)\n"
    "  --width N         of the picture in pixels (640), and\n"
    "  --height N        its height (400)\n"
    "  --samples N       rays of each point to the sun, and to the sky (8); a pixel has four points\n"
    "  --camera AZIMUTH,ELEVATION   of the camera about the object, in degrees (25,15)\n"
    "  --sun AZIMUTH,ELEVATION      of the sun (70,40)\n"
    "  --up x|y|z        the axis that points up (y)\n"
    "  --device NAME     part of the name of Vulkan's device\n"
    "  --check           asks nifQuery the same rays on the CPU, and fails if a pixel differs\n"
    "Exit codes: 0 done, 1 failed, 2 wrong command line.\n";

// The light, as `nif render` would have it (README.md).
constexpr float kSunAngle = 4;  // its diameter in degrees
constexpr float kSunIrradiance[] = {2.9f, 2.6f, 2.15f}, kSkyRadiance[] = {0.36f, 0.45f, 0.58f};
constexpr float kExposure = 0.95f, kAlbedo[] = {0, 0.6f, 0.8f};  // of kObject and kGround
constexpr float kPi = 3.14159265f;

struct Usage : std::runtime_error {
  using std::runtime_error::runtime_error;
};

struct Options {
  std::string asset, picture, device;
  uint32_t object = 0, width = 640, height = 400, samples = 8;
  float camera[2] = {25, 15}, sun[2] = {70, 40};
  int up = 1;
  bool check = false;
};

template <class Number>
bool read(std::string_view text, Number& number) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  return error == std::errc{} && end == text.data() + text.size();
}

Options parse(int count, char** words) {
  Options options;
  for (int i = 1; i < count; ++i) {
    const std::string name = words[i];
    const auto value = [&]() -> std::string {
      if (++i == count) throw Usage(name + " takes a value");
      return words[i];
    };
    const auto number = [&](uint32_t low, uint32_t high) {
      uint32_t result = 0;
      if (!read(value(), result) || result < low || result > high)
        throw Usage(name + " takes a number, " + std::to_string(low) + " to " + std::to_string(high));
      return result;
    };
    const auto angles = [&](float(&to)[2], float lowest) {
      const std::string text = value();
      const size_t comma = text.find(',');
      if (comma == text.npos || !read(std::string_view(text).substr(0, comma), to[0]) ||
          !read(std::string_view(text).substr(comma + 1), to[1]) || !(std::abs(to[0]) <= 360) ||
          !(to[1] >= lowest) || !(to[1] <= 85))
        throw Usage(name + " takes AZIMUTH,ELEVATION in degrees; the elevation is from " +
                    std::to_string(int(lowest)) + " to 85");
    };
    if (name == "-o")
      options.picture = value();
    else if (name == "--object")
      options.object = number(0, ~0u);
    else if (name == "--width")
      options.width = number(16, 4096);
    else if (name == "--height")
      options.height = number(16, 4096);
    else if (name == "--samples")
      options.samples = number(1, 1024);
    else if (name == "--camera")
      angles(options.camera, 1);
    else if (name == "--sun")
      angles(options.sun, 3);
    else if (name == "--device")
      options.device = value();
    else if (name == "--check")
      options.check = true;
    else if (name == "--up") {
      const std::string axis = value();
      if (axis.size() != 1 || axis < "x" || axis > "z") throw Usage("--up takes x, y or z");
      options.up = axis[0] - 'x';
    } else if (name.starts_with('-'))
      throw Usage("unknown option '" + name + "'");
    else if (options.asset.empty())
      options.asset = name;
    else
      throw Usage("one asset at a time; what is '" + name + "'?");
  }
  if (options.asset.empty() || options.picture.empty()) throw Usage("give an asset, and a picture by -o");
  return options;
}

/// The words of an object for the shader, in the form for which the shader was compiled. A shader cannot report errors, so
/// this is the place to find them.
std::vector<uint32_t> load_words(const nifkit::Asset& asset, const Options& options) {
  std::vector<uint32_t> words = asset.shader_tables(options.object);
  constexpr uint32_t kMagic = 0x5346494e, kVersion = 2;  // words 0 and 1 (docs/shaders.md)
  constexpr uint32_t kNetworkWords = 12;                 // the NIF_NETWORK_WORDS of light.comp
  if (words[0] != kMagic || words[1] != kVersion)
    throw std::runtime_error("the library writes words of another version than the shader was made for");
  if (words[21] > kNetworkWords)
    throw std::runtime_error(options.asset + ": the network needs NIF_NETWORK_WORDS " +
                             std::to_string(words[21]) + ", and the shader was compiled with " +
                             std::to_string(kNetworkWords));
  return words;
}

/// Points of the sun's disc as directions, then points of a unit sphere. Neighbours in the list are far apart, so that a few in
/// a row are spread evenly.
std::vector<std::array<float, 4>> make_directions(const Vec3& sun) {
  constexpr size_t kCount = 1024;
  std::vector<std::array<float, 4>> directions(2 * kCount);
  const Vec3 aside = std::abs(sun[0]) < 0.5f ? Vec3{1, 0, 0} : Vec3{0, 1, 0};
  Vec3 u{sun[1] * aside[2] - sun[2] * aside[1], sun[2] * aside[0] - sun[0] * aside[2],
         sun[0] * aside[1] - sun[1] * aside[0]};
  const float length = std::hypot(u[0], u[1], u[2]);
  for (float& x : u) x /= length;
  const Vec3 v{sun[1] * u[2] - sun[2] * u[1], sun[2] * u[0] - sun[0] * u[2], sun[0] * u[1] - sun[1] * u[0]};
  double a = 0.5, b = 0.5;
  for (size_t k = 0; k < kCount; ++k) {
    a = std::fmod(a + 0.7548776662466927, 1.0), b = std::fmod(b + 0.5698402909980532, 1.0);
    const float angle = 2 * kPi * float(a);
    const float radius = std::tan(kSunAngle / 2 * kPi / 180) * std::sqrt(float(b));
    for (size_t c = 0; c < 3; ++c)
      directions[k][c] = sun[c] + radius * (std::cos(angle) * u[c] + std::sin(angle) * v[c]);
    const float z = 2 * float(b) - 1, r = std::sqrt(std::max(0.0f, 1 - z * z));
    directions[kCount + k] = {r * std::cos(angle), r * std::sin(angle), z, 0};
  }
  return directions;
}

uint8_t shown(float linear) {
  const float x = std::clamp(linear, 0.0f, 1.0f);
  return uint8_t(255 * (x <= 0.0031308f ? 12.92f * x : 1.055f * std::pow(x, 1 / 2.4f) - 0.055f) + 0.5f);
}

/// Each pixel of the picture is the mean of four of the view.
std::vector<uint8_t> develop(const View& view, const std::vector<Pixel>& pixels, const Light* light,
                             uint32_t samples, const Vec3& sun) {
  std::vector<uint8_t> rgb;
  for (uint32_t y = 0; y < view.height; y += 2)
    for (uint32_t x = 0; x < view.width; x += 2)
      for (size_t c = 0; c < 3; ++c) {
        float sum = 0;
        for (const size_t i : {size_t(y) * view.width + x, size_t(y) * view.width + x + 1,
                               size_t(y + 1) * view.width + x, size_t(y + 1) * view.width + x + 1}) {
          const Pixel& pixel = pixels[i];
          if (pixel.kind == kNothing) {
            sum += kSkyRadiance[c];
            continue;
          }
          const Vec3& n = pixel.normal;
          const float cosine = std::max(0.0f, n[0] * sun[0] + n[1] * sun[1] + n[2] * sun[2]);
          sum += kAlbedo[int(pixel.kind)] *
                 (kSunIrradiance[c] / kPi * cosine * float(light[i].sun) +
                  kSkyRadiance[c] * float(light[i].sky)) /
                 float(samples);
        }
        rgb.push_back(shown(kExposure * sum / 4));
      }
  return rgb;
}

void draw(const Options& options) {
  // shaders=on keeps in memory what the words are made from.
  const nifkit::Device device("shaders=on");
  const nifkit::Asset asset = nifkit::Asset::load(device, options.asset);
  const std::vector<uint32_t> words = load_words(asset, options);
  const NifObjectInfo object = asset.object(options.object);

  View view{2 * options.width, 2 * options.height, options.up, options.camera[0], options.camera[1]};
  place(view, object);
  const Vec3 sun = towards(options.up, options.sun[0], options.sun[1]);
  const auto directions = make_directions(sun);

  // The device and its limits, before anything is drawn.
  const Gpu gpu(options.device);
  std::vector<Pixel> pixels(size_t(view.width) * view.height);
  const auto words_of = [](const auto& list) {
    return std::span(reinterpret_cast<const uint32_t*>(list.data()), list.size() * sizeof(list[0]) / 4);
  };
  const uint32_t constants[] = {uint32_t(pixels.size()), uint32_t(directions.size() / 2), options.samples,
                                uint32_t(options.up)};
  const Gpu::Task task{kLightShader,
                       {words, words_of(pixels), words_of(directions)},
                       4 * pixels.size(),
                       constants,
                       uint32_t((pixels.size() + 63) / 64)};
  gpu.check_limits(task);

  nifkit::Scene scene(device);
  scene.add_instance(asset, options.object);
  scene.commit();
  const std::vector<Pixel> seen = look(view, scene, object);
  std::copy(seen.begin(), seen.end(), pixels.begin());
  const Gpu::Result result = gpu.run(task);
  std::vector<Light> light(pixels.size());
  std::memcpy(light.data(), result.output.data(), 4 * result.output.size());

  if (options.check) {
    const size_t differ = count_differences(scene, pixels, directions, options.samples, options.up, light);
    if (differ)
      throw std::runtime_error("the light of " + std::to_string(differ) +
                               " pixels is not what nifQuery says");
  }
  write_png(options.picture, options.width, options.height,
            develop(view, pixels, light.data(), options.samples, sun));

  uint64_t asked = 0, proven = 0;
  for (const Light& each : light) asked += each.asked, proven += each.proven;
  std::printf("%s: %zu bytes of words for %u triangles\n", gpu.name().c_str(), 4 * words.size(),
              object.triangles);
  std::printf("%llu rays in %.1f ms, %.1f million a second; %.1f %% proven\n", (unsigned long long)asked,
              result.milliseconds, double(asked) / result.milliseconds / 1000,
              asked ? 100 * double(proven) / double(asked) : 0);
  std::printf("camera %.9g %.9g %.9g, target %.9g %.9g %.9g, sun %.9g %.9g %.9g\n", double(view.position[0]),
              double(view.position[1]), double(view.position[2]), double(view.target[0]),
              double(view.target[1]), double(view.target[2]), double(sun[0]), double(sun[1]), double(sun[2]));
  if (options.check) std::printf("0 of %zu pixels differ from the CPU's\n", pixels.size());
}

}  // namespace

int main(int count, char** words) {
  try {
    if (count == 2 && (!std::strcmp(words[1], "--help") || !std::strcmp(words[1], "-h"))) {
      std::fputs(kHelp, stdout);
      return 0;
    }
    draw(parse(count, words));
    return 0;
  } catch (const Usage& error) {
    std::fprintf(stderr, "picture: %s; see --help\n", error.what());
    return 2;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "picture: %s\n", error.what());
    return 1;
  }
}
