#include "tools/render/renderer.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numbers>

#include "formats/status.hpp"
#include "tools/render/paths.hpp"

namespace nif::render {
namespace {

using bake::dot;
using Clock = std::chrono::steady_clock;

constexpr uint32_t kTile = 32;  ///< pixels along its sides
constexpr uint32_t kSamplesPerPass = 4;
constexpr uint32_t kTilesBetweenCalls = 128;
constexpr size_t kRaysAtOnce = 16384;  ///< of one tile, roughly

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

/// Sums of radiance, [pixel][3], of each mode; what no shadow ray decides is in all of them.
struct Film {
  std::array<std::vector<double>, kModes.size()> sums;

  Film(size_t pixels, bool assets) {
    for (const Mode mode : kModes)
      if (assets || mode == Mode::reference) sums[size_t(mode)].assign(3 * pixels, 0.0);
  }
  void add(Mode mode, size_t pixel, const Colour& colour, double factor) {
    double* sum = &sums[size_t(mode)][3 * pixel];
    for (size_t c = 0; c < 3; ++c) sum[c] += factor * colour[c];
  }
};

/// A tile's work: shadow rays with what they carry, answered many at a time.
class TileRenderer {
 public:
  TileRenderer(const World& world, const Lighting& lighting, const Camera& camera,
               const RenderOptions& options, Film& film)
      : world_(world),
        lighting_(lighting),
        paths_(world, lighting, camera, options.picture),
        options_(options),
        film_(film) {}

  ShadowRays run(uint32_t left, uint32_t top, uint32_t first_sample, uint32_t samples) {
    const PictureDescription& picture = options_.picture;
    const uint32_t right = std::min(left + kTile, picture.width),
                   bottom = std::min(top + kTile, picture.height);
    for (uint32_t y = top; y < bottom; ++y)
      for (uint32_t x = left; x < right; ++x) {
        const PixelSamples numbers = paths_.samples_of(x, y);
        const size_t pixel = size_t{y} * picture.width + x;
        for (uint32_t s = first_sample; s < first_sample + samples; ++s) {
          paths_.follow(
              numbers, s, x, y,
              [&](const ShadowRay& ray) {
                rays_.push_back(ray.segment);
                carries_.push_back({pixel, ray.radiance});
              },
              [&](const Double3& direction) { add_background(pixel, direction); });
          if (rays_.size() >= kRaysAtOnce) answer();
        }
      }
    answer();
    return counts_;
  }

 private:
  void add_background(size_t pixel, const Double3& direction) {
    Colour colour = options_.picture.background * (1 / options_.exposure);
    if (lighting_.has_sky()) colour = lighting_.background(direction);
    for (const Mode mode : kModes)
      if (!film_.sums[size_t(mode)].empty()) film_.add(mode, pixel, colour, 1);
  }

  void answer() {
    const size_t count = rays_.size();
    counts_.rays += count;
    reference_.resize(count);
    auto start = Clock::now();
    world_.ask_embree(rays_, reference_.data());
    counts_.embree_seconds += seconds_since(start);
    for (size_t i = 0; i < count; ++i)
      if (reference_[i]) film_.add(Mode::reference, carries_[i].pixel, carries_[i].colour, 1);
    if (world_.has_assets()) answer_by_assets();
    rays_.clear();
    carries_.clear();
  }

  void answer_by_assets() {
    const size_t count = rays_.size();
    beside_.resize(count);
    visible_.resize(count);
    certain_.resize(count);
    probability_.resize(count);
    auto start = Clock::now();
    world_.ask_assets(rays_, {visible_.data(), probability_.data(), certain_.data()});
    counts_.asset_seconds += seconds_since(start);
    if (options_.exact != Exact::none)
      for (size_t i = 0; i < count; ++i) {
        if (world_.starts_in_asset(rays_[i]) != (options_.exact == Exact::inside)) continue;
        visible_[i] = reference_[i];
        probability_[i] = reference_[i];
        certain_[i] = 1;
      }
    start = Clock::now();
    world_.ask_embree_beside_assets(rays_, beside_.data());
    counts_.beside_seconds += seconds_since(start);
    for (size_t i = 0; i < count; ++i) {
      const bool truth = reference_[i], visible = visible_[i] && beside_[i];
      counts_.leak += visible && !truth;
      counts_.spurious += !visible && truth;
      const double p = double(probability_[i]);
      const bool decided = certain_[i] || !beside_[i];
      const bool trusted = decided || std::max(p, 1 - p) >= options_.confidence;
      counts_.certain += decided;
      counts_.exact += !trusted;
      const auto& [pixel, colour] = carries_[i];
      if (visible) film_.add(Mode::bits, pixel, colour, 1);
      if (beside_[i]) film_.add(Mode::probability, pixel, colour, p);
      if (trusted ? visible : truth) film_.add(Mode::hybrid, pixel, colour, 1);
    }
  }

  struct Carried {
    size_t pixel;
    Colour colour;
  };

  const World& world_;
  const Lighting& lighting_;
  const Paths paths_;
  const RenderOptions& options_;
  Film& film_;
  ShadowRays counts_;
  std::vector<Segment> rays_;
  std::vector<Carried> carries_;  // [ray]
  std::vector<uint8_t> reference_, beside_, visible_, certain_;
  std::vector<float> probability_;
};

Rendering develop(const Film& film, const RenderOptions& options, uint32_t samples,
                  const ShadowRays& counts) {
  Rendering rendering;
  rendering.shadow_rays = counts;
  const double scale = options.exposure / samples;
  for (const Mode mode : kModes) {
    const std::vector<double>& sums = film.sums[size_t(mode)];
    if (sums.empty()) continue;
    Image image(options.picture.width, options.picture.height);
    std::transform(sums.begin(), sums.end(), image.values.begin(),
                   [&](double sum) { return float(sum * scale); });
    rendering.images[size_t(mode)] = std::move(image);
  }
  return rendering;
}

}  // namespace

const char* name_of(Mode mode) {
  constexpr const char* kNames[] = {"reference", "bits", "probability", "hybrid"};
  return kNames[size_t(mode)];
}

ShadowRays& ShadowRays::operator+=(const ShadowRays& other) {
  rays += other.rays;
  leak += other.leak;
  spurious += other.spurious;
  certain += other.certain;
  exact += other.exact;
  embree_seconds += other.embree_seconds;
  asset_seconds += other.asset_seconds;
  beside_seconds += other.beside_seconds;
  return *this;
}

double find_exposure(const SceneDescription& scene, const World& world, const Lighting& lighting) {
  if (scene.picture.exposure) return *scene.picture.exposure;
  const auto up = size_t(scene.up);
  Double3 point, normal{};
  for (size_t a = 0; a < 3; ++a) point[a] = (double(world.box().min[a]) + world.box().max[a]) / 2;
  point[up] = scene.ground && scene.ground->height ? *scene.ground->height : double(world.box().min[up]);
  normal[up] = 1;
  constexpr uint32_t kSamples = 4096;
  const PixelSamples numbers(scene.picture.seed, ~uint64_t{0}, kSamples);
  Colour irradiance{};
  for (size_t light = 0; light < lighting.count(); ++light)
    for (uint32_t s = 0; s < kSamples; ++s) {
      const LightSample sample = lighting.draw(light, point, normal, numbers.pair(uint32_t(light), s));
      const double cosine = std::max(0.0, dot(sample.direction, normal));
      for (size_t c = 0; c < 3; ++c) irradiance[c] += sample.irradiance[c] * cosine / kSamples;
    }
  const Colour albedo = scene.ground ? scene.ground->albedo : GroundDescription().albedo;
  const double shown = (0.2126 * irradiance[0] * albedo[0] + 0.7152 * irradiance[1] * albedo[1] +
                        0.0722 * irradiance[2] * albedo[2]) /
                       std::numbers::pi;
  return shown > 0 ? double(srgb_decode(float(scene.picture.ground_level))) / shown : 1.0;
}

Rendering render(const World& world, const Lighting& lighting, const Camera& camera,
                 const RenderOptions& options, const RenderCallback& callback,
                 const std::atomic<bool>& cancel) {
  const PictureDescription& picture = options.picture;
  const uint32_t across = (picture.width + kTile - 1) / kTile, down = (picture.height + kTile - 1) / kTile;
  Film film(size_t{picture.width} * picture.height, world.has_assets());
  ShadowRays counts;
  for (uint32_t done = 0; done < picture.samples;) {
    const uint32_t samples = std::min(kSamplesPerPass, picture.samples - done);
    const uint32_t tiles = across * down;
    for (uint32_t first = 0; first < tiles; first += kTilesBetweenCalls) {
      const uint32_t last = std::min(first + kTilesBetweenCalls, tiles);
      std::vector<ShadowRays> tile_counts(last - first);
      tbb::parallel_for(first, last, [&](uint32_t tile) {
        if (cancel) return;
        TileRenderer renderer(world, lighting, camera, options, film);
        tile_counts[tile - first] = renderer.run(tile % across * kTile, tile / across * kTile, done, samples);
      });
      if (cancel) throw Error(Status::interrupted, "the rendering was cancelled");
      for (const ShadowRays& tile : tile_counts) counts += tile;
      if (last < tiles) callback((done + double(samples) * last / tiles) / picture.samples, {});
    }
    done += samples;
    callback(double(done) / picture.samples, [&] { return develop(film, options, done, counts); });
  }
  return develop(film, options, picture.samples, counts);
}

}  // namespace nif::render
