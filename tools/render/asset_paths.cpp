// Proceeds breadth first: one step of all paths, then all their shadow rays in one query, then all their next
// hits. Embree answers for objects that have no asset.
#include "tools/render/asset_paths.hpp"

#include <limits>

namespace nif::render {

void AssetPaths::add(size_t pixel, const PixelSamples& numbers, uint32_t sample, const CameraRay& ray,
                     const std::optional<SurfacePoint>& exact) {
  paths_now_.push_back({pixel, numbers, sample, {ray.origin, ray.direction}});
  exact_.push_back(exact);
}

void AssetPaths::run(const Compare& compare, const Add& add, const Background& background) {
  find_hits();
  for (size_t i = 0; i < paths_now_.size(); ++i) compare(paths_now_[i].pixel, exact_[i], hits_[i]);
  exact_.clear();
  while (!paths_now_.empty()) {
    paths_next_.clear();
    for (size_t i = 0; i < paths_now_.size(); ++i) {
      const Path& path = paths_now_[i];
      const std::optional<PathRay> next = paths_.step(
          path.numbers, path.sample, path.ray, hits_[i],
          [&](const ShadowRay& shadow) {
            shadows_.push_back(shadow.segment);
            carried_.push_back({path.pixel, shadow.radiance});
          },
          [&](const Double3& direction, const Colour& carried) {
            Colour seen = background(direction);
            for (size_t c = 0; c < 3; ++c) seen[c] *= carried[c];
            add(path.pixel, seen);
          });
      if (next) paths_next_.push_back({path.pixel, path.numbers, path.sample, *next});
    }
    answer_shadows(add);
    paths_now_.swap(paths_next_);
    find_hits();
  }
}

void AssetPaths::find_hits() {
  rays_.clear();
  for (const Path& path : paths_now_)
    rays_.push_back(
        bake::make_segment(path.ray.origin, path.ray.direction, std::numeric_limits<float>::infinity()));
  hits_.resize(rays_.size());
  world_.trace_by_assets(rays_, hits_);
}

void AssetPaths::answer_shadows(const Add& add) {
  visible_.resize(shadows_.size());
  beside_.resize(shadows_.size());
  world_.assets().ask(shadows_, {visible_.data(), nullptr, nullptr});
  world_.ask_embree_beside_assets(shadows_, beside_.data());
  for (size_t i = 0; i < shadows_.size(); ++i)
    if (visible_[i] && beside_[i]) add(carried_[i].pixel, carried_[i].colour);
  shadows_.clear();
  carried_.clear();
}

}  // namespace nif::render
