// Splits the picture into tiles for TBB. A tile collects shadow rays with what they carry, and answers many
// at a time. Each pixel belongs to one tile, so its sums do not depend on threads.
#include "tools/render/renderer.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numbers>

#include "formats/base/status.hpp"
#include "tools/render/asset_paths.hpp"
#include "tools/render/paths.hpp"

namespace nif::render {
namespace {

using Clock = std::chrono::steady_clock;

constexpr uint32_t kTile = 32;  ///< pixels per side
constexpr uint32_t kSamplesPerPass = 4;
constexpr uint32_t kTilesBetweenCalls = 128;
constexpr size_t kRaysAtOnce = 16384;  ///< per tile, roughly

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

using Sums = std::vector<double>;  // [pixel][3]; empty if there is nothing to sum

void add(Sums& sums, size_t pixel, const Colour& colour, double factor) {
  double* sum = &sums[3 * pixel];
  for (size_t c = 0; c < 3; ++c) sum[c] += factor * colour[c];
}

/// Sums of radiance for each mode; radiance that no shadow ray decides is in all of them. And sums of normals
/// as colours.
struct Film {
  std::array<Sums, kModes.size()> sums;
  std::array<Sums, 2> normals;  // as in Rendering

  Film(size_t pixels, const World& world, bool by_assets) {
    for (const Mode mode : kModes)
      if (is_made(mode, world, by_assets)) sums[size_t(mode)].assign(3 * pixels, 0.0);
    if (has(Mode::primary) || has(Mode::asset))
      for (Sums& of : normals) of.assign(3 * pixels, 0.0);
  }
  static bool is_made(Mode mode, const World& world, bool by_assets) {
    switch (mode) {
      case Mode::reference:
        return true;
      case Mode::primary:
        return world.has_primaries() && !by_assets;
      case Mode::asset:
        return by_assets;
      default:
        return world.has_assets() && !by_assets;
    }
  }
  bool has(Mode mode) const { return !sums[size_t(mode)].empty(); }
  void add(Mode mode, size_t pixel, const Colour& colour, double factor) {
    render::add(sums[size_t(mode)], pixel, colour, factor);
  }
};

/// Statistics of a tile's rays.
struct RayCounts {
  ShadowRays shadow;
  CameraRays camera;
};

/// The work on a tile: shadow rays with what they carry, answered many at a time.
class TileRenderer {
 public:
  TileRenderer(const World& world, const Lighting& lighting, const Camera& camera,
               const RenderOptions& options, Film& film)
      : world_(world),
        lighting_(lighting),
        paths_(world, lighting, camera, options.picture),
        asset_paths_(world, paths_),
        options_(options),
        film_(film) {}

  RayCounts run(uint32_t left, uint32_t top, uint32_t first_sample, uint32_t samples) {
    const PictureDescription& picture = options_.picture;
    const uint32_t right = std::min(left + kTile, picture.width),
                   bottom = std::min(top + kTile, picture.height);
    for (uint32_t y = top; y < bottom; ++y)
      for (uint32_t x = left; x < right; ++x) {
        const PixelSamples numbers = paths_.samples_of(x, y);
        const size_t pixel = size_t{y} * picture.width + x;
        for (uint32_t s = first_sample; s < first_sample + samples; ++s) {
          const CameraRay ray = paths_.camera_ray(numbers, s, x, y);
          const std::optional<SurfacePoint> hit = world_.trace(ray.origin, ray.direction);
          paths_.follow(
              numbers, s, ray, hit, [&](const ShadowRay& shadow) { asked_.add(pixel, shadow); },
              [&](const Double3& direction, const Colour& carried) {
                const Colour colour = carried_background(direction, carried);
                for (const Mode mode : kModes)
                  if (mode != Mode::primary && mode != Mode::asset && film_.has(mode))
                    film_.add(mode, pixel, colour, 1);
              });
          if (film_.has(Mode::primary)) follow_by_fields(numbers, s, ray, hit, pixel);
          if (film_.has(Mode::asset)) asset_paths_.add(pixel, numbers, s, ray, hit);
          if (asked_.segments.size() >= kRaysAtOnce) answer();
        }
      }
    answer();
    if (film_.has(Mode::asset)) follow_by_assets();
    return counts_;
  }

 private:
  /// Shadow rays that wait for answers, with what they carry.
  struct Asked {
    struct Carried {
      size_t pixel;
      Colour colour;
    };
    std::vector<Segment> segments;
    std::vector<Carried> carries;  // [segment]

    void add(size_t pixel, const ShadowRay& ray) {
      segments.push_back(ray.segment);
      carries.push_back({pixel, ray.radiance});
    }
    void clear() {
      segments.clear();
      carries.clear();
    }
  };

  Colour background(const Double3& direction) const {
    return lighting_.has_sky() ? lighting_.background(direction)
                               : options_.picture.background * (1 / options_.exposure);
  }

  Colour carried_background(const Double3& direction, const Colour& carried) const {
    Colour colour = background(direction);
    for (size_t c = 0; c < 3; ++c) colour[c] *= carried[c];
    return colour;
  }

  /// Follows the path from the first hit that fields report for the camera ray; `hit` is Embree's.
  void follow_by_fields(const PixelSamples& numbers, uint32_t sample, const CameraRay& ray,
                        const std::optional<SurfacePoint>& hit, size_t pixel) {
    const std::optional<SurfacePoint> learned = world_.trace_by_fields(ray.origin, ray.direction);
    compare(pixel, hit, learned, &SurfaceKind::primary);
    paths_.follow(
        numbers, sample, ray, learned, [&](const ShadowRay& shadow) { asked_by_fields_.add(pixel, shadow); },
        [&](const Double3& direction, const Colour& carried) {
          film_.add(Mode::primary, pixel, carried_background(direction, carried), 1);
        });
  }

  void follow_by_assets() {
    asset_paths_.run(
        [&](size_t pixel, const std::optional<SurfacePoint>& exact, const std::optional<SurfacePoint>& said) {
          compare(pixel, exact, said, &SurfaceKind::asset);
        },
        [&](size_t pixel, const Colour& colour) { film_.add(Mode::asset, pixel, colour, 1); },
        [&](const Double3& direction) { return background(direction); });
  }

  /// `answered` selects the objects whose camera rays are not answered by Embree alone.
  void compare(size_t pixel, const std::optional<SurfacePoint>& exact,
               const std::optional<SurfacePoint>& learned, bool SurfaceKind::*answered) {
    const std::optional<SurfacePoint>* seen[] = {&exact, &learned};
    for (size_t i = 0; i < 2; ++i)
      if (const std::optional<SurfacePoint>& point = *seen[i])
        add(film_.normals[i], pixel, (point->normal + Double3{1, 1, 1}) * 0.5, 1);
    CameraRays& counts = counts_.camera;
    const bool hit = exact && exact->kind.*answered, said = learned && learned->kind.*answered;
    ++counts.rays;
    counts.hits += hit;
    counts.differ += hit != said;
    if (!hit || !said) return;
    ++counts.both;
    counts.depth_error += std::abs(learned->distance - exact->distance) / exact->kind.diagonal;
    const double cosine = std::clamp(dot(learned->normal, exact->normal), -1.0, 1.0);
    counts.normal_error += std::acos(cosine) * 180 / std::numbers::pi;
  }

  void answer() {
    counts_.shadow.rays += asked_.segments.size();
    counts_.shadow.embree_seconds += answer_by_embree(Mode::reference, asked_);
    if (film_.has(Mode::bits)) answer_by_assets();
    asked_.clear();
    if (film_.has(Mode::primary)) answer_by_embree(Mode::primary, asked_by_fields_);
    asked_by_fields_.clear();
  }

  /// Leaves the answers in reference_, and returns the seconds that they took.
  double answer_by_embree(Mode mode, const Asked& asked) {
    const size_t count = asked.segments.size();
    reference_.resize(count);
    const auto start = Clock::now();
    world_.ask_embree(asked.segments, reference_.data());
    const double seconds = seconds_since(start);
    for (size_t i = 0; i < count; ++i)
      if (reference_[i]) film_.add(mode, asked.carries[i].pixel, asked.carries[i].colour, 1);
    return seconds;
  }

  void answer_by_assets() {
    const size_t count = asked_.segments.size();
    beside_.resize(count);
    visible_.resize(count);
    certain_.resize(count);
    probability_.resize(count);
    auto start = Clock::now();
    world_.assets().ask(asked_.segments, {visible_.data(), probability_.data(), certain_.data()});
    counts_.shadow.asset_seconds += seconds_since(start);
    if (options_.exact != Exact::none)
      for (size_t i = 0; i < count; ++i) {
        if (world_.starts_in_asset(asked_.segments[i]) != (options_.exact == Exact::inside)) continue;
        visible_[i] = reference_[i];
        probability_[i] = reference_[i];
        certain_[i] = 1;
      }
    start = Clock::now();
    world_.ask_embree_beside_assets(asked_.segments, beside_.data());
    counts_.shadow.beside_seconds += seconds_since(start);
    for (size_t i = 0; i < count; ++i) {
      const bool truth = reference_[i], visible = visible_[i] && beside_[i];
      counts_.shadow.leak += visible && !truth;
      counts_.shadow.spurious += !visible && truth;
      const double p = double(probability_[i]);
      const bool decided = certain_[i] || !beside_[i];
      const bool trusted = decided || std::max(p, 1 - p) >= options_.confidence;
      counts_.shadow.certain += decided;
      counts_.shadow.exact += !trusted;
      const auto& [pixel, colour] = asked_.carries[i];
      if (visible) film_.add(Mode::bits, pixel, colour, 1);
      if (beside_[i]) film_.add(Mode::probability, pixel, colour, p);
      if (trusted ? visible : truth) film_.add(Mode::hybrid, pixel, colour, 1);
    }
  }

  const World& world_;
  const Lighting& lighting_;
  const Paths paths_;
  AssetPaths asset_paths_;
  const RenderOptions& options_;
  Film& film_;
  RayCounts counts_;
  Asked asked_, asked_by_fields_;
  std::vector<uint8_t> reference_, beside_, visible_, certain_;
  std::vector<float> probability_;
};

Image develop(const Sums& sums, const PictureDescription& picture, double scale) {
  if (sums.empty()) return {};
  Image image(picture.width, picture.height);
  std::transform(sums.begin(), sums.end(), image.values.begin(),
                 [&](double sum) { return float(sum * scale); });
  return image;
}

Rendering develop(const Film& film, const RenderOptions& options, uint32_t samples, const RayCounts& counts) {
  Rendering rendering;
  rendering.shadow_rays = counts.shadow;
  rendering.camera_rays = counts.camera;
  for (size_t i = 0; i < film.sums.size(); ++i)
    rendering.images[i] = develop(film.sums[i], options.picture, options.exposure / samples);
  for (size_t i = 0; i < film.normals.size(); ++i)
    rendering.normals[i] = develop(film.normals[i], options.picture, 1.0 / samples);
  return rendering;
}

}  // namespace

const char* name_of(Mode mode) {
  constexpr const char* kNames[] = {"reference", "bits", "probability", "hybrid", "primary", "asset"};
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

CameraRays& CameraRays::operator+=(const CameraRays& other) {
  rays += other.rays;
  hits += other.hits;
  differ += other.differ;
  both += other.both;
  depth_error += other.depth_error;
  normal_error += other.normal_error;
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
  Film film(size_t{picture.width} * picture.height, world, options.by_assets);
  RayCounts counts;
  for (uint32_t done = 0; done < picture.samples;) {
    const uint32_t samples = std::min(kSamplesPerPass, picture.samples - done);
    const uint32_t tiles = across * down;
    for (uint32_t first = 0; first < tiles; first += kTilesBetweenCalls) {
      const uint32_t last = std::min(first + kTilesBetweenCalls, tiles);
      std::vector<RayCounts> tile_counts(last - first);
      tbb::parallel_for(first, last, [&](uint32_t tile) {
        if (cancel) return;
        TileRenderer renderer(world, lighting, camera, options, film);
        tile_counts[tile - first] = renderer.run(tile % across * kTile, tile / across * kTile, done, samples);
      });
      if (cancel) throw Error(Status::interrupted, "the rendering was cancelled");
      for (const RayCounts& tile : tile_counts) {
        counts.shadow += tile.shadow;
        counts.camera += tile.camera;
      }
      if (last < tiles) callback((done + double(samples) * last / tiles) / picture.samples, {});
    }
    done += samples;
    callback(double(done) / picture.samples, [&] { return develop(film, options, done, counts); });
  }
  return develop(film, options, picture.samples, counts);
}

}  // namespace nif::render
