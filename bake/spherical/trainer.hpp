// Training of `spherical` fields after Fujieda, Kao and Harada (HPG 2023): latent vectors of one or several
// objects, and the two networks that they share, from labelled rays of any source.
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "bake/oracle/oracle.hpp"
#include "bake/spherical/trainer_kernels.hpp"
#include "formats/nif/asset.hpp"

namespace nif::bake {

/// What a field and its training are made of. The defaults are the paper's.
struct SphericalOptions {
  /// For rays that start outside of the AABB.
  struct Outer {
    uint32_t resolution = 256, features = 3;  ///< of both grids
    uint32_t width = 64, hidden_layers = 2;
    uint32_t batch = 2048;  ///< rays of a step, a multiple of kSphericalBatchUnit
  } outer;
  /// For rays that start inside.
  struct Inner {
    uint32_t resolution = 128, features = 5;  ///< of the two grids over angles
    uint32_t distance_resolution = 128, distance_features = 3;
    uint32_t width = 48, hidden_layers = 3;
    uint32_t batch = 4096;
  } inner;
  /// For primary rays, where they are learned: as the outer field's.
  Outer primary;
  float slope = 0.01f;         ///< of the leaky ReLU below 0
  float latent_reach = 1e-4f;  ///< latent vectors start uniform in +-this
  /// Weights start uniform in +-sqrt(6 / n), with n inputs (He et al. 2015), or inputs and outputs together
  /// (Glorot and Bengio 2010, which the paper names Xavier).
  bool he_weights = false;
  SphericalLoss loss = SphericalLoss::squared;
  float learning_rate = 0.005f;  ///< of Adam, with the next three
  float beta1 = 0.9f, beta2 = 0.999f, epsilon = 1e-15f;
  /// How values are stored. That is how the bytes that the paper states come about.
  bool half_grids = true, half_networks = false;
  uint64_t seed = 1;
  /// Tests set these to spoil a weight at that step of the outer network (or that for primary rays) and at so
  /// many in all.
  uint64_t spoil_at_step = ~uint64_t{0}, spoil_steps = 1;
};
inline constexpr uint32_t kSphericalBatchUnit = 512;

/// Throws Error(usage) with a sentence that names the first value out of range, by the name of its option in
/// `nif bake`.
void check(const SphericalOptions& options);

/// Labelled rays, each in the space of its object.
struct SphericalRays {
  std::vector<Segment> segments;
  std::vector<uint8_t> visible;   ///< [segment]: 0 or 1
  std::vector<uint32_t> objects;  ///< [segment]: index; empty where all are of object 0
};

struct SphericalProgress {
  double loss;   ///< mean over recent rays of both kinds
  double error;  ///< share of those answered wrongly
};

/// Latent vectors and networks in training. The result does not depend on the number of threads.
class SphericalTrainer {
 public:
  /// Of these objects only the bounds are looked at, which must be such as kernels::set_bounds() takes: else
  /// Error(too_large).
  SphericalTrainer(std::span<const format::Object> objects, const SphericalOptions& options);
  ~SphericalTrainer();

  /// Learns from the rays, in random order, `passes` times. Rays that miss their object's AABB are left out;
  /// those that do not fill a batch wait for the next call. `progress` may be null; it is called from the
  /// calling thread. Throws Error(training_failed) where the loss stays non-finite after several recoveries,
  /// Error(interrupted) once `cancel` is set.
  void learn(const SphericalRays& rays, uint32_t passes,
             const std::function<void(const SphericalProgress&)>& progress, const std::atomic<bool>& cancel);

  uint64_t outer_rays() const;  ///< that have been learned from, each counted once per pass
  uint64_t inner_rays() const;
  uint32_t recoveries() const;  ///< times that a non-finite loss was met and training went back

  /// As they are now, in the precision in which they will be stored.
  format::SphericalNetworks networks() const;
  format::SphericalGrids grids(size_t object) const;

 private:
  class Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace nif::bake
