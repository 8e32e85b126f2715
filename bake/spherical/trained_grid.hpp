// A grid of latent vectors in training, with Adam's moments.
#pragma once

#include <tbb/cache_aligned_allocator.h>

#include <span>
#include <vector>

#include "bake/checkpoint.hpp"
#include "bake/spherical/spherical_trainer_kernels.hpp"
#include "formats/base/random.hpp"
#include "kernels/reference/spherical/spherical_query.hpp"

namespace nif::bake {

using Floats = std::vector<float, tbb::cache_aligned_allocator<float>>;

/// One ray as a network reads it.
struct FieldSample {
  kernels::SphericalCoordinates at;
  uint32_t object;
  uint8_t label;  ///< for the network's first output: 0 or 1
};

/// The coordinates of a ray that a grid covers.
enum class GridKind { position, direction, distance };

/// A grid for all objects, with Adam's moments. A batch looks up few of its entries, so only those are
/// updated: they get slots in small arrays, where gradients are summed in the order of the samples. The
/// others stay as they are.
class TrainedGrid {
 public:
  /// Latent vectors start uniform in +-reach.
  TrainedGrid(GridKind kind, uint32_t resolution, uint32_t features, size_t objects, float reach,
              Random& random);

  uint32_t features() const { return features_; }
  size_t objects() const { return slots_.size() / per_object_; }
  uint32_t corners() const { return kind_ == GridKind::distance ? 2 : 4; }
  LatentGrid view() const { return {features_, corners(), entries_.data()}; }
  void save() { saved_ = entries_; }
  void restore() { entries_ = saved_; }

  /// Its state between two steps; without Adam's moments if training has ended.
  void put(StateWriter& state, bool ended) const;
  void get(StateReader& state, bool ended);

  LatentLookup look_up(const FieldSample& sample) const;

  /// One step of Adam. input_gradients: for each kTrainLanes samples [input][kTrainLanes], this grid's from
  /// `offset` on. Returns false if a change was not finite.
  bool update(const AdamStep& step, std::span<const LatentLookup> lookups, const float* input_gradients,
              uint32_t inputs, uint32_t offset);

  /// Latent vectors of one object, exact in half precision if `half`.
  std::vector<float> values(size_t object, bool half) const;

 private:
  GridKind kind_;
  uint32_t resolution_, features_;
  size_t per_object_;
  Floats entries_, saved_;       // [entry]: latent vector, first and second moments
  std::vector<uint32_t> slots_;  // [entry], kNone between updates
  std::vector<uint32_t> touched_;
  Floats gradients_, parts_[3];
};

/// One over positions and one over directions, with the same shape.
std::vector<TrainedGrid> grids_over_angles(uint32_t resolution, uint32_t features, size_t objects,
                                           float reach, Random& random);

}  // namespace nif::bake
