// Each pixel that sees the mesh has 16 rays, one to the sun and the others over the hemisphere. Embree
// answers them once; a rival's answers give its picture, its map of errors and its share of errors.
#include "tools/study/view.hpp"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>

#include "formats/base/random.hpp"
#include "tools/render/camera.hpp"
#include "tools/render/error_map.hpp"

namespace nif::tools {
namespace {

constexpr size_t kRaysOfPixel = 16;
constexpr float kAmbient = 0.3f, kSun = 0.45f;

Double3 unit(const Double3& v) { return v * (1 / length(v)); }

}  // namespace

StudyView::StudyView(const StudiedMesh& mesh, uint32_t width, uint32_t height)
    : width_(width), height_(height) {
  const bake::RaySource& source = mesh.truth.source();
  const render::Camera camera =
      render::place_camera({"view", render::Orbit{30, 20, 0.9}}, source.box, 1, width, height);
  const Double3 sun = unit({0.5, 0.8, 0.4});
  struct Found {
    bool any = false;
    Pixel pixel{};
    std::array<kernels::Segment, kRaysOfPixel> rays{};
    std::array<float, kRaysOfPixel> weights{};
    std::array<uint8_t, kRaysOfPixel> visible{};
  };
  std::vector<Found> all(size_t(width) * height);
  tbb::parallel_for(tbb::blocked_range<uint32_t>(0, height, 1), [&](const auto& rows) {
    for (uint32_t y = rows.begin(); y < rows.end(); ++y) {
      for (uint32_t x = 0; x < width; ++x) {
        const Double3 direction = camera.direction((x + 0.5) / width, (y + 0.5) / height);
        const auto hit = source.embree.first_hit(bake::make_segment(camera.position, direction, INFINITY));
        if (!hit) continue;
        Double3 normal = unit(hit->normal);
        if (dot(normal, direction) > 0) normal = normal * -1.0;
        const Double3 origin = camera.position + direction * double(hit->t) + normal * double(source.bias);
        Found& found = all[size_t(y) * width + x];
        found.any = true;
        found.pixel = {x, y, float(-dot(direction, normal)), float(std::max(0.0, dot(sun, normal)))};
        Random random(1, y, x);
        for (size_t i = 0; i < kRaysOfPixel; ++i) {
          Double3 towards = i == 0 ? sun : random.direction();
          if (dot(towards, normal) < 0) towards = towards * -1.0;
          found.rays[i] = bake::make_segment(origin, towards, INFINITY);
          found.weights[i] = i == 0 ? 0.f : float(dot(towards, normal));
          found.visible[i] = !source.embree.occluded(found.rays[i]);
        }
      }
    }
  });
  for (const Found& found : all) {
    if (!found.any) continue;
    pixels_.push_back(found.pixel);
    weights_.insert(weights_.end(), found.weights.begin(), found.weights.end());
    rays_.segments.insert(rays_.segments.end(), found.rays.begin(), found.rays.end());
    rays_.visible.insert(rays_.visible.end(), found.visible.begin(), found.visible.end());
  }
}

render::Image StudyView::paint(const std::vector<uint8_t>& visible) const {
  render::Image image(width_, height_);
  std::ranges::fill(image.values, render::kErrorMapGround);
  for (size_t p = 0; p < pixels_.size(); ++p) {
    float light = 0, all = 0;
    for (size_t i = p * kRaysOfPixel + 1; i < (p + 1) * kRaysOfPixel; ++i) {
      all += weights_[i];
      light += visible[i] ? weights_[i] : 0;
    }
    const float value =
        kAmbient * (all > 0 ? light / all : 0) + (visible[p * kRaysOfPixel] ? kSun * pixels_[p].sunny : 0);
    std::fill_n(image.at(pixels_[p].x, pixels_[p].y), 3, render::srgb_encode(value));
  }
  return image;
}

StudyView::Seen StudyView::ask(const Rival& rival) const {
  const bake::Answerer answerer = rival.answerer();
  const size_t count = rays_.segments.size();
  std::vector<uint8_t> visible(count), certain(count);
  std::vector<float> probability(count);
  constexpr size_t kChunk = 4096;
  tbb::parallel_for(tbb::blocked_range<size_t>(0, (count + kChunk - 1) / kChunk, 1), [&](const auto& chunks) {
    for (size_t chunk = chunks.begin(); chunk < chunks.end(); ++chunk) {
      const size_t first = chunk * kChunk, size = std::min(kChunk, count - first);
      answerer(std::span(rays_.segments).subspan(first, size),
               {&visible[first], &certain[first], &probability[first]});
    }
  });
  Seen seen{paint(visible), render::Image(width_, height_), 0};
  std::ranges::fill(seen.errors.values, render::kErrorMapGround);
  uint64_t all_wrong = 0;
  for (size_t p = 0; p < pixels_.size(); ++p) {
    size_t wrong = 0;
    for (size_t i = p * kRaysOfPixel; i < (p + 1) * kRaysOfPixel; ++i)
      wrong += visible[i] != rays_.visible[i];
    all_wrong += wrong;
    render::paint_errors(seen.errors.at(pixels_[p].x, pixels_[p].y), pixels_[p].facing,
                         double(wrong) / kRaysOfPixel);
  }
  seen.wrong = count ? double(all_wrong) / double(count) : 0;
  return seen;
}

}  // namespace nif::tools
