// Trains fields for primary rays: the first hit of a ray with one object, by latent vectors and a network
// like those of an outer field, from rays of any source.
#pragma once

#include "bake/spherical/spherical_trainer.hpp"

namespace nif::bake {

/// Rays in an object's space with their first hits.
struct PrimaryRays {
  struct Hit {
    float t;
    std::array<float, 3> normal;  ///< of unit length, on the side that the ray comes from
  };
  std::vector<Segment> segments;
  std::vector<std::optional<Hit>> hits;  ///< [segment]
};

/// The field of one object in training. The result does not depend on the number of threads.
class PrimaryTrainer {
 public:
  /// The shape is that of options.primary, the rest is as for the other fields.
  PrimaryTrainer(const kernels::SphericalBounds& bounds, const SphericalOptions& options);
  ~PrimaryTrainer();

  /// Learns once from each ray, in random order. Minimises the squared differences of the probability of a
  /// hit and, if there is a hit, of depth and normal. The rest is as for SphericalTrainer::learn().
  [[nodiscard]] bool learn(const PrimaryRays& rays,
                           const std::function<void(const SphericalProgress&)>& progress,
                           const std::atomic<bool>& cancel);

  uint64_t rays() const;  ///< number of rays learned from
  uint32_t recoveries() const;

  /// As SphericalTrainer::put() and get().
  void put(StateWriter& state, bool ended) const;
  void get(StateReader& state, bool ended);

  /// Its current state, in the precision in which it will be stored; without a margin.
  format::Primary field() const;

 private:
  class Implementation;
  std::unique_ptr<Implementation> implementation_;
};

/// The margin that keeps all but a few of these rays' starts before the surface: see kernels::PrimaryField.
float find_margin(const kernels::PrimaryField& field, const PrimaryRays& rays);

}  // namespace nif::bake
