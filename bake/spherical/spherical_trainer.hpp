// Trains `spherical` fields after Fujieda, Kao and Harada (HPG 2023): latent vectors of one or several
// objects, and the two networks that they share, from rays of any source with their ground truth.
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "bake/checkpoint.hpp"
#include "bake/spherical/spherical_field_options.hpp"
#include "formats/nif/asset.hpp"

namespace nif::bake {

using kernels::Segment;

/// The bounds of an object, as kernels use them. Throws Error(too_large) if they cannot.
kernels::SphericalBounds spherical_bounds(const format::Object& object);

/// Rays with ground truth, each in the space of its object.
struct SphericalRays {
  std::vector<Segment> segments;
  std::vector<uint8_t> visible;   ///< [segment]: 0 or 1
  std::vector<uint32_t> objects;  ///< [segment]: index; empty if all belong to object 0
};

struct SphericalProgress {
  double loss;   ///< mean over recent rays of both kinds
  double error;  ///< share of those answered wrongly
};

/// Latent vectors and networks in training. The result does not depend on the number of threads.
class SphericalTrainer {
 public:
  /// For objects with these bounds.
  SphericalTrainer(std::vector<kernels::SphericalBounds> bounds, const SphericalOptions& options);
  ~SphericalTrainer();

  /// Learns from the rays, in random order, `passes` times. Skips rays that miss their object's AABB; rays
  /// that do not fill a batch wait for the next call. `progress` may be null; it is called from the calling
  /// thread. Returns false if the loss stays non-finite after several recoveries. Throws Error(interrupted)
  /// once `cancel` is set.
  [[nodiscard]] bool learn(const SphericalRays& rays, uint32_t passes,
                           const std::function<void(const SphericalProgress&)>& progress,
                           const std::atomic<bool>& cancel);

  uint64_t outer_rays() const;  ///< number of rays learned from, each counted once per pass
  uint64_t inner_rays() const;
  uint32_t recoveries() const;  ///< how often a non-finite loss made training go back

  /// Everything that learn() depends on; if training has ended, only what the other functions return.
  void put(StateWriter& state, bool ended) const;
  /// From a trainer for the same objects and options.
  void get(StateReader& state, bool ended);

  /// Their current state, in the precision in which they will be stored.
  format::SphericalNetworks networks() const;
  format::SphericalGrids grids(size_t object) const;

 private:
  class Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace nif::bake
