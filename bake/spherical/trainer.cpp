#include "bake/spherical/trainer.hpp"

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
  Implementation(std::span<const format::Object> objects, const SphericalOptions& options)
      : options_(options),
        lessons_(options_, 0x73706865726963),
        outer_(options_, {options.outer.width, options.outer.hidden_layers, options.outer.batch},
               grids_over_angles(options.outer.resolution, options.outer.features, objects.size(),
                                 options.latent_reach, lessons_.random()),
               lessons_.random()),
        inner_(options_, {options.inner.width, options.inner.hidden_layers, options.inner.batch},
               inner_grids(options, objects.size(), lessons_.random()), lessons_.random()) {
    for (const format::Object& object : objects) bounds_.push_back(bounds_of(object));
  }

  void learn(const SphericalRays& rays, uint32_t passes,
             const std::function<void(const SphericalProgress&)>& progress, const std::atomic<bool>& cancel) {
    sort_in(rays);
    TrainedField* const fields[] = {&outer_, &inner_};
    lessons_.learn(fields, passes, progress, cancel);
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
  std::vector<kernels::SphericalBounds> bounds_;
  TrainedField outer_, inner_;
};

void check(const SphericalOptions& options) {
  const auto within = [](uint32_t value, uint32_t low, uint32_t high, const char* option) {
    if (value < low || value > high)
      throw Error(Status::usage, fmt::format("{} {} is not in the range {} to {}", option, value, low, high));
  };
  const auto fits_lanes = [](uint32_t value, uint32_t unit, const char* option) {
    if (value % unit != 0)
      throw Error(Status::usage, fmt::format("{} {} is no multiple of {}", option, value, unit));
  };
  using namespace kernels;
  const SphericalOptions::Outer &outer = options.outer, &primary = options.primary;
  const SphericalOptions::Inner& inner = options.inner;
  within(outer.resolution, 2, kMaxSphericalResolution, "--outer-resolution");
  within(outer.features, 1, kMaxSphericalFeatures, "--outer-features");
  within(outer.width, 4, kMaxSphericalWidth, "--outer-width");
  fits_lanes(outer.width, 4, "--outer-width");
  within(outer.hidden_layers, 1, kMaxSphericalLayers, "--outer-layers");
  within(inner.resolution, 2, kMaxSphericalResolution, "--inner-resolution");
  within(inner.features, 1, kMaxSphericalFeatures, "--inner-features");
  within(inner.distance_resolution, 2, kMaxSphericalResolution, "--distance-resolution");
  within(inner.distance_features, 1, kMaxSphericalFeatures, "--distance-features");
  within(inner.width, 4, kMaxSphericalWidth, "--inner-width");
  fits_lanes(inner.width, 4, "--inner-width");
  within(inner.hidden_layers, 1, kMaxSphericalLayers, "--inner-layers");
  within(primary.resolution, 2, kMaxSphericalResolution, "--primary-resolution");
  within(primary.features, 1, kMaxSphericalFeatures, "--primary-features");
  within(primary.width, 4, kMaxSphericalWidth, "--primary-width");
  fits_lanes(primary.width, 4, "--primary-width");
  within(primary.hidden_layers, 1, kMaxSphericalLayers, "--primary-layers");
  for (const auto& [batch, name] :
       {std::pair{outer.batch, "--outer-batch"}, {inner.batch, "--inner-batch"}}) {
    within(batch, kSphericalBatchUnit, 1 << 20, name);
    fits_lanes(batch, kSphericalBatchUnit, name);
  }
  const auto above_0 = [](float value, float most, const char* option) {
    if (!(value > 0 && value <= most))
      throw Error(Status::usage, fmt::format("{} {} is not above 0 and at most {}", option, value, most));
  };
  const auto below_1 = [](float value, const char* option) {
    if (!(value >= 0 && value < 1))
      throw Error(Status::usage, fmt::format("{} {} is not from 0 to below 1", option, value));
  };
  below_1(options.slope, "--leaky-slope");
  above_0(options.latent_reach, 1, "--latent-reach");
  above_0(options.learning_rate, 1, "--learning-rate");
  below_1(options.beta1, "--adam-beta1");
  below_1(options.beta2, "--adam-beta2");
  above_0(options.epsilon, 1, "--adam-epsilon");
}

SphericalTrainer::SphericalTrainer(std::span<const format::Object> objects, const SphericalOptions& options)
    : implementation_(std::make_unique<Implementation>(objects, options)) {}
SphericalTrainer::~SphericalTrainer() = default;

void SphericalTrainer::learn(const SphericalRays& rays, uint32_t passes,
                             const std::function<void(const SphericalProgress&)>& progress,
                             const std::atomic<bool>& cancel) {
  implementation_->learn(rays, passes, progress, cancel);
}

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
