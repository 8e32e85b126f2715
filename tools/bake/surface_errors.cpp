// Queries Embree and the asset with random rays from each point that a camera sees, and from points above it.
// Sums are integers and each pixel has its own random stream, so the result does not depend on threads.
#include "tools/bake/surface_errors.hpp"

#include <tbb/blocked_range.h>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "bake/ground_truth/ray_sets.hpp"
#include "formats/base/random.hpp"
#include "formats/base/status.hpp"
#include "tools/render/camera.hpp"
#include "tools/render/error_map.hpp"

namespace nif::tools {
namespace {

using render::Image;
using render::SurfacePoint;

/// Integer sums, so that the order in which threads add does not matter.
struct Sums {
  decltype(SurfaceErrors::by_angle) by_angle{};
  decltype(SurfaceErrors::by_height) by_height{};
};

/// The rays for one point of the surface: several from the point itself, then one from each height.
class PointRays {
 public:
  PointRays(uint32_t from_surface, bool only_proven, uint64_t purpose)
      : from_surface_(from_surface), only_proven_(only_proven), purpose_(purpose) {}

  /// Draws the rays, queries both, and adds to the sums. Returns the share of wrong answers among the rays
  /// from the surface itself.
  double ask(const render::World& world, const SurfacePoint& point, uint64_t number, Sums& sums) {
    constexpr auto& kHeights = SurfaceErrors::kHeights;
    Random random(1, purpose_, number);
    rays_.clear(), angles_.clear();
    for (size_t i = 0; i < from_surface_ + kHeights.size(); ++i) {
      Double3 direction = random.direction();
      double cosine = dot(direction, point.normal);
      if (cosine < 0) direction = direction * -1.0, cosine = -cosine;
      const double height =
          i < from_surface_ ? point.kind.bias : kHeights[i - from_surface_] * point.kind.diagonal;
      rays_.push_back(bake::make_segment(point.position + point.normal * height, direction, INFINITY));
      angles_.push_back(std::acos(std::min(1.0, cosine)) * 180 / std::numbers::pi);
    }
    truth_.resize(rays_.size()), said_.resize(rays_.size()), certain_.resize(rays_.size());
    world.ask_embree(rays_, truth_.data());
    world.assets().ask(rays_, {said_.data(), nullptr, certain_.data()});
    uint32_t wrong = 0;
    for (size_t i = 0; i < rays_.size(); ++i) {
      if (only_proven_ && !certain_[i]) continue;
      const AskedRays one{1, !truth_[i] && said_[i], truth_[i] && !said_[i]};
      if (i >= from_surface_) {
        sums.by_height[i - from_surface_] += one;
        continue;
      }
      sums.by_angle[std::min<size_t>(size_t(angles_[i] / 10), sums.by_angle.size() - 1)] += one;
      wrong += truth_[i] != said_[i];
    }
    return double(wrong) / from_surface_;
  }

 private:
  uint32_t from_surface_;
  bool only_proven_;
  uint64_t purpose_;
  std::vector<render::Segment> rays_;
  std::vector<double> angles_;
  std::vector<uint8_t> truth_, said_, certain_;
};

}  // namespace

AskedRays& AskedRays::operator+=(const AskedRays& other) {
  rays += other.rays, leak += other.leak, spurious += other.spurious;
  return *this;
}

SurfaceErrors measure_surface(const render::SceneDescription& scene, const render::World& world,
                              uint32_t rays_a_pixel, bool only_proven, const std::atomic<bool>& cancel,
                              const std::function<void(double)>& progress) {
  SurfaceErrors result;
  const uint32_t width = scene.picture.width, height = scene.picture.height;
  std::atomic<uint64_t> rows_done{0};
  tbb::enumerable_thread_specific<Sums> sums;
  for (size_t number = 0; number < scene.cameras.size(); ++number) {
    const render::Camera camera =
        render::place_camera(scene.cameras[number], world.box(), scene.up, width, height);
    Image& map = result.maps.emplace_back(width, height);
    std::ranges::fill(map.values, render::kErrorMapGround);
    tbb::parallel_for(tbb::blocked_range<uint32_t>(0, height, 1), [&](const auto& rows) {
      PointRays rays(rays_a_pixel, only_proven, number);
      for (uint32_t y = rows.begin(); y < rows.end(); ++y) {
        for (uint32_t x = 0; x < width && !cancel; ++x) {
          const Double3 direction = camera.direction((x + 0.5) / width, (y + 0.5) / height);
          const std::optional<SurfacePoint> point = world.trace(camera.position, direction);
          if (!point || !point->kind.asset) continue;
          const double wrong = rays.ask(world, *point, uint64_t{y} << 32 | x, sums.local());
          render::paint_errors(map.at(x, y), -dot(direction, point->normal), wrong);
        }
        progress(double(++rows_done) / double(uint64_t{height} * scene.cameras.size()));
      }
    });
    if (cancel) throw Error(Status::interrupted, "the report was cancelled");
  }
  for (const Sums& own : sums) {
    for (size_t i = 0; i < result.by_angle.size(); ++i) result.by_angle[i] += own.by_angle[i];
    for (size_t i = 0; i < result.by_height.size(); ++i) result.by_height[i] += own.by_height[i];
  }
  return result;
}

}  // namespace nif::tools
