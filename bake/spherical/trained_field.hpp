// Trains a network over grids of latent vectors, in lessons for one or several such fields: batches in random
// order, with a way back if a loss is not finite.
#pragma once

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <array>
#include <atomic>
#include <functional>

#include "bake/spherical/spherical_trainer.hpp"
#include "bake/spherical/trained_grid.hpp"

namespace nif::bake {

/// A mini-batch's weight gradients are summed in this many parts, then added in order.
inline constexpr uint32_t kBatchGroups = 8;
static_assert(kSphericalBatchUnit == kBatchGroups * kTrainLanes);

/// Rays as networks read them, in parallel; `bounds` returns the bounds for segment i.
template <class Bounds>
std::vector<kernels::SphericalRay> prepare_rays(std::span<const Segment> segments, const Bounds& bounds) {
  std::vector<kernels::SphericalRay> prepared(segments.size());
  tbb::parallel_for(tbb::blocked_range<size_t>(0, segments.size(), 4096), [&](const auto& range) {
    for (size_t i = range.begin(); i < range.end(); ++i)
      prepared[i] = kernels::prepare_spherical(bounds(i), segments[i]);
  });
  return prepared;
}

class TrainedField {
 public:
  struct Shape {
    uint32_t width, hidden_layers, batch;
    /// Of the network. The first is the log-odds of a sample's label; the others are learned as numbers from
    /// the samples whose label is 1.
    uint32_t outputs = 1;
    std::array<float, kMaxTargets> target_weights{};  ///< of each of the others in the loss
  };
  /// The options must outlive it.
  TrainedField(const SphericalOptions& options, const Shape& shape, std::vector<TrainedGrid> grids,
               Random& random);

  uint32_t batch() const { return shape_.batch; }
  uint64_t steps() const { return steps_; }
  const std::vector<TrainedGrid>& grids() const { return grids_; }

  /// Adds a sample to those waiting to be learned from, with targets for the outputs after the first.
  void add(const FieldSample& sample, std::span<const float> targets = {});
  size_t waiting() const { return waiting_.size(); }
  /// Drops all samples except those that do not fill a batch.
  void keep_remainder();

  void save();
  void restore();
  /// Its state between two lessons; if training has ended, only what layers() and grids() return.
  void put(StateWriter& state, bool ended) const;
  void get(StateReader& state, bool ended);

  /// Trains on one mini-batch of the waiting samples, order[0 .. batch). `number` is the field's index among
  /// those trained together; `caution` is a factor on the learning rate. `loss` and `error` receive the mean
  /// loss and the share of wrong answers. Returns false if something was not finite.
  bool step(size_t number, const uint32_t* order, double caution, double& loss, double& error);

  /// Their current values, exact in half precision if the options say so.
  format::SphericalLayers layers() const;

 private:
  struct Group {
    Floats gradients, scratch;
    double loss = 0;
  };

  /// Updates everything: one thread for each grid, and another for the weights.
  bool update(double caution);

  const SphericalOptions& options_;
  const Shape shape_;
  uint32_t inputs_ = 0;
  std::vector<TrainedGrid> grids_;
  NetworkShape network_;
  Floats weights_, first_, second_, sums_;
  Floats saved_weights_, saved_first_, saved_second_;
  uint64_t steps_ = 0, adam_steps_ = 0, saved_adam_steps_ = 0;
  std::array<Group, kBatchGroups> groups_;
  std::vector<FieldSample> waiting_;
  std::vector<float> waiting_targets_;  // [sample][outputs - 1]
  // For the current batch.
  std::vector<LatentLookup> lookups_[kMaxLatentGrids];
  std::vector<uint8_t> labels_, wrong_;
  Floats targets_, input_gradients_;
};

/// Lessons of fields that are trained together: if one loss becomes non-finite, all go back.
class FieldLessons {
 public:
  /// `stream` keeps its random numbers separate from others with the same seed.
  FieldLessons(uint64_t seed, uint64_t stream) : random_(seed, stream, 0) {}

  Random& random() { return random_; }
  /// Called between two calls of learn().
  void put(StateWriter& state) const;
  void get(StateReader& state);
  uint32_t recoveries() const { return recoveries_; }

  /// Learns from all waiting samples, in random order, `passes` times, each pass field by field. Returns,
  /// throws and reports like SphericalTrainer::learn().
  bool learn(std::span<TrainedField* const> fields, uint32_t passes,
             const std::function<void(const SphericalProgress&)>& progress, const std::atomic<bool>& cancel);

 private:
  bool learn_once(std::span<TrainedField* const> fields, size_t number,
                  const std::function<void(const SphericalProgress&)>& progress,
                  const std::atomic<bool>& cancel);
  /// Returns to the start of the call, with half the learning rate. Returns false if that has not helped.
  bool recover(std::span<TrainedField* const> fields);

  Random random_;
  uint32_t recoveries_ = 0;
  double caution_ = 1;
  uint64_t watched_ = 0;
  double loss_ = 0, error_ = 0;
};

}  // namespace nif::bake
