// Assigns rays by their start to the outer or the inner network, and gives each network its grids. They learn
// in trained_field.cpp.
#include "bake/spherical/spherical_trainer.hpp"

#include <fmt/format.h>

#include "bake/spherical/trained_field.hpp"
#include "formats/base/status.hpp"

namespace nif::bake {
namespace {

std::vector<TrainedGrid> inner_grids(const SphericalOptions& options, size_t objects, Random& random) {
  const SphericalOptions::Inner& inner = options.inner;
  std::vector<TrainedGrid> grids =
      grids_over_angles(inner.resolution, inner.features, objects, options.latent_reach, random);
  grids.emplace_back(GridKind::distance, inner.distance_resolution, inner.distance_features, objects,
                     options.latent_reach, random);
  return grids;
}

}  // namespace

class SphericalTrainer::Implementation {
 public:
  Implementation(std::vector<kernels::SphericalBounds> bounds, const SphericalOptions& options)
      : options_(options),
        lessons_(options_.seed, 0x73706865726963),
        outer_(options_, {options.outer.width, options.outer.hidden_layers, options.outer.batch},
               grids_over_angles(options.outer.resolution, options.outer.features, bounds.size(),
                                 options.latent_reach, lessons_.random()),
               lessons_.random()),
        inner_(options_, {options.inner.width, options.inner.hidden_layers, options.inner.batch},
               inner_grids(options, bounds.size(), lessons_.random()), lessons_.random()),
        bounds_(std::move(bounds)) {}

  bool learn(const SphericalRays& rays, uint32_t passes,
             const std::function<void(const SphericalProgress&)>& progress, const std::atomic<bool>& cancel) {
    sort_in(rays);
    TrainedField* const fields[] = {&outer_, &inner_};
    return lessons_.learn(fields, passes, progress, cancel);
  }

  void put(StateWriter& state, bool ended) const {
    lessons_.put(state), outer_.put(state, ended), inner_.put(state, ended);
  }
  void get(StateReader& state, bool ended) {
    lessons_.get(state), outer_.get(state, ended), inner_.get(state, ended);
  }

  const TrainedField& outer() const { return outer_; }
  const TrainedField& inner() const { return inner_; }
  uint32_t recoveries() const { return lessons_.recoveries(); }
  const SphericalOptions& options() const { return options_; }

 private:
  /// Appends rays to the samples of their networks.
  void sort_in(const SphericalRays& rays) {
    const auto object_of = [&](size_t i) { return rays.objects.empty() ? 0 : rays.objects[i]; };
    const std::vector<kernels::SphericalRay> prepared = prepare_rays(
        rays.segments, [&](size_t i) -> auto& { return bounds_[object_of(i)]; });
    for (size_t i = 0; i < prepared.size(); ++i) {
      if (prepared[i].kind == kernels::SphericalKind::none) continue;
      TrainedField& field = prepared[i].kind == kernels::SphericalKind::outer ? outer_ : inner_;
      field.add({prepared[i].at, object_of(i), rays.visible[i]});
    }
  }

  const SphericalOptions options_;
  FieldLessons lessons_;
  TrainedField outer_, inner_;
  const std::vector<kernels::SphericalBounds> bounds_;
};

kernels::SphericalBounds spherical_bounds(const format::Object& object) {
  kernels::SphericalBounds bounds;
  if (!kernels::set_bounds(object.aabb_min.data(), object.aabb_max.data(), bounds))
    throw Error(Status::too_large,
                fmt::format("'{}' is too small or too large to compute with", object.name));
  return bounds;
}

SphericalTrainer::SphericalTrainer(std::vector<kernels::SphericalBounds> bounds,
                                   const SphericalOptions& options)
    : implementation_(std::make_unique<Implementation>(std::move(bounds), options)) {}
SphericalTrainer::~SphericalTrainer() = default;

bool SphericalTrainer::learn(const SphericalRays& rays, uint32_t passes,
                             const std::function<void(const SphericalProgress&)>& progress,
                             const std::atomic<bool>& cancel) {
  return implementation_->learn(rays, passes, progress, cancel);
}

void SphericalTrainer::put(StateWriter& state, bool ended) const { implementation_->put(state, ended); }
void SphericalTrainer::get(StateReader& state, bool ended) { implementation_->get(state, ended); }

uint64_t SphericalTrainer::outer_rays() const {
  return implementation_->outer().steps() * implementation_->outer().batch();
}
uint64_t SphericalTrainer::inner_rays() const {
  return implementation_->inner().steps() * implementation_->inner().batch();
}
uint32_t SphericalTrainer::recoveries() const { return implementation_->recoveries(); }

format::SphericalNetworks SphericalTrainer::networks() const {
  const SphericalOptions& options = implementation_->options();
  return {options.half_networks, options.slope, implementation_->outer().layers(),
          implementation_->inner().layers()};
}

format::SphericalGrids SphericalTrainer::grids(size_t object) const {
  const SphericalOptions& options = implementation_->options();
  const std::vector<TrainedGrid>&outer = implementation_->outer().grids(),
        &inner = implementation_->inner().grids();
  const bool half = options.half_grids;
  return {half,
          options.outer.resolution,
          options.outer.features,
          options.inner.resolution,
          options.inner.features,
          options.inner.distance_resolution,
          options.inner.distance_features,
          outer[0].values(object, half),
          outer[1].values(object, half),
          inner[0].values(object, half),
          inner[1].values(object, half),
          inner[2].values(object, half)};
}

}  // namespace nif::bake
