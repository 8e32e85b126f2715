// Trains one network for hit, depth and normal together; the constants weigh them in the loss, with the
// figures behind each choice. find_margin() keeps shadow rays from starting behind the surface.
#include "bake/spherical/primary_trainer.hpp"

#include <algorithm>
#include <cmath>

#include "bake/spherical/trained_field.hpp"
#include "kernels/reference/spherical/primary.hpp"

namespace nif::bake {
namespace {

constexpr uint64_t kStream = 0x7072696d617279;

/// Share of hits for which the margin starts other rays before the surface. Trained as in
/// docs/results/paper/primary.sh, pictures with 4 samples per pixel gave 28.3, 28.9, 29.1 and 28.8 dB with
/// 0.97, 0.98, 0.99 and 0.995: lower values start shadow rays behind the surface, higher ones let light in
/// where surfaces meet.
constexpr double kNotBehind = 0.99;

/// Weight of depth in the loss; the normal has 1. By weight, for the same training: PSNR; share of camera rays
/// for which only the field or only the mesh has a hit; mean error of depth and of normals:
///     10: 27.6 dB, 0.086 %, 0.57 % of the diagonal, 4.3 degrees
///    100: 29.1 dB, 0.090 %, 0.34 %, 4.5 degrees
///   1000: 29.3 dB, 0.128 %, 0.21 %, 5.3 degrees
constexpr float kDepthWeight = 100;

}  // namespace

class PrimaryTrainer::Implementation {
 public:
  Implementation(const kernels::SphericalBounds& bounds, const SphericalOptions& options)
      : options_(options),
        lessons_(options_.seed, kStream),
        bounds_(bounds),
        field_(options_,
               {options.primary.width,
                options.primary.hidden_layers,
                options.primary.batch,
                kernels::kPrimaryOutputs,
                {kDepthWeight, 1, 1, 1}},
               grids_over_angles(options.primary.resolution, options.primary.features, 1,
                                 options.latent_reach, lessons_.random()),
               lessons_.random()) {}

  bool learn(const PrimaryRays& rays, const std::function<void(const SphericalProgress&)>& progress,
             const std::atomic<bool>& cancel) {
    const std::vector<kernels::SphericalRay> prepared = prepare_rays(
        rays.segments, [&](size_t) -> auto& { return bounds_; });
    for (size_t i = 0; i < prepared.size(); ++i) {
      if (prepared[i].kind == kernels::SphericalKind::none) continue;
      const std::optional<PrimaryRays::Hit>& hit = rays.hits[i];
      std::array<float, kMaxTargets> targets{};
      if (hit) {
        const double along = length(to_double(std::to_array(rays.segments[i].direction)));
        targets[0] = static_cast<float>((double(hit->t) - double(prepared[i].enter)) * along *
                                        double(bounds_.distance_scale) / 2);
        std::copy(hit->normal.begin(), hit->normal.end(), targets.begin() + 1);
      }
      field_.add({prepared[i].at, 0, hit.has_value()}, targets);
    }
    TrainedField* const fields[] = {&field_};
    return lessons_.learn(fields, 1, progress, cancel);
  }

  void put(StateWriter& state, bool ended) const { lessons_.put(state), field_.put(state, ended); }
  void get(StateReader& state, bool ended) { lessons_.get(state), field_.get(state, ended); }

  uint64_t rays() const { return field_.steps() * field_.batch(); }
  uint32_t recoveries() const { return lessons_.recoveries(); }

  format::Primary field() const {
    const bool half = options_.half_grids;
    return {half,
            options_.half_networks,
            options_.slope,
            0,
            options_.primary.resolution,
            options_.primary.features,
            field_.grids()[0].values(0, half),
            field_.grids()[1].values(0, half),
            field_.layers()};
  }

 private:
  const SphericalOptions options_;
  FieldLessons lessons_;
  const kernels::SphericalBounds bounds_;
  TrainedField field_;
};

float find_margin(const kernels::PrimaryField& field, const PrimaryRays& rays) {
  std::vector<float> too_far(rays.segments.size(), -1.f);  // -1: not both hit
  tbb::parallel_for(tbb::blocked_range<size_t>(0, too_far.size(), 1024), [&](const auto& range) {
    for (size_t i = range.begin(); i < range.end(); ++i) {
      const kernels::PrimaryAnswer answer = kernels::query_primary(field, rays.segments[i]);
      if (!answer.hit || !rays.hits[i]) continue;
      const double speed = length(to_double(std::to_array(rays.segments[i].direction)));
      const double off =
          (double(answer.t) - double(rays.hits[i]->t)) * speed * double(field.distance_scale) / 2;
      too_far[i] = static_cast<float>(std::clamp(off, 0.0, 1.0));
    }
  });
  std::erase(too_far, -1.f);
  if (too_far.empty()) return 0;
  const auto at = too_far.begin() + ptrdiff_t(kNotBehind * double(too_far.size() - 1));
  std::nth_element(too_far.begin(), at, too_far.end());
  return *at;
}

PrimaryTrainer::PrimaryTrainer(const kernels::SphericalBounds& bounds, const SphericalOptions& options)
    : implementation_(std::make_unique<Implementation>(bounds, options)) {}
PrimaryTrainer::~PrimaryTrainer() = default;

bool PrimaryTrainer::learn(const PrimaryRays& rays,
                           const std::function<void(const SphericalProgress&)>& progress,
                           const std::atomic<bool>& cancel) {
  return implementation_->learn(rays, progress, cancel);
}

void PrimaryTrainer::put(StateWriter& state, bool ended) const { implementation_->put(state, ended); }
void PrimaryTrainer::get(StateReader& state, bool ended) { implementation_->get(state, ended); }
uint64_t PrimaryTrainer::rays() const { return implementation_->rays(); }
uint32_t PrimaryTrainer::recoveries() const { return implementation_->recoveries(); }
format::Primary PrimaryTrainer::field() const { return implementation_->field(); }

}  // namespace nif::bake
