// Trains a field: Adam updates floats, while the network runs with their quantised copies, as in the asset.
// If the loss is not finite, or all answers become alike, training returns to a snapshot with half the
// learning rate.
#include "bake/network/network_trainer.hpp"

#include <tbb/cache_aligned_allocator.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <utility>

#include "bake/network/network_trainer_kernels.hpp"
#include "bake/training_hook.hpp"
#include "formats/base/status.hpp"

namespace nif::bake {
namespace {

/// A mini-batch's gradients are summed in this many parts, each by one thread, then added in order. So the
/// result is the same for any number of threads, and this is the most threads that a step can use.
constexpr uint32_t kTrainGroups = 8;
constexpr uint64_t kStepsBetweenSnapshots = 256;
/// Minimum number of steps between checks whether a checkpoint is due.
constexpr uint64_t kStepsBetweenCheckpoints = 16;
constexpr uint32_t kMaxRecoveries = 6;
/// A network has collapsed if it gave the same answer to all rays of this many consecutive runs of
/// kStepsBetweenSnapshots steps, although at least this share of them has the other answer, and if its loss
/// is at least this factor times that of a network that only knows the share of visible rays.
constexpr uint32_t kCollapsedRuns = 2;
constexpr double kCollapsedShare = 0.01, kCollapsedLoss = 0.98;
/// Weights are k / 2^kWeightShift with |k| <= 127, as in the asset.
constexpr uint32_t kWeightShift = 6;
constexpr float kWeightQuantum = 1.0f / (1 << kWeightShift);
constexpr float kBiasQuantum = 1.0f / (127 << kWeightShift);
constexpr float kFeatureQuantum = 1.0f / 127;
/// The last layer's output (a weighted mean of values in 0..1) times this is the logit.
constexpr float kGain = 8.0f;

using Floats = std::vector<float, tbb::cache_aligned_allocator<float>>;

/// One kind of parameter: what Adam updates, its moments, and the quantised copy that the network runs with.
struct Parameters {
  Floats master, first, second, quantised;
  float limit, quantum;

  Parameters(size_t count, float limit_, float quantum_)
      : master(count, 0.f),
        first(count, 0.f),
        second(count, 0.f),
        quantised(count, 0.f),
        limit(limit_),
        quantum(quantum_) {}
  void put(StateWriter& state) const {
    for (const Floats* part : {&master, &first, &second, &quantised}) state.put_all(*part);
  }
  void get(StateReader& state) {
    state.get_within(master, limit);
    state.get_finite(first), state.get_finite(second);
    state.get_within(quantised, limit);
  }
  void quantise() {
    for (size_t i = 0; i < master.size(); ++i) {
      master[i] = std::clamp(master[i], -limit, limit);
      quantised[i] = std::nearbyint(master[i] / quantum) * quantum;
    }
  }
};

NetworkShape make_shape(uint32_t inputs, const NetworkOptions& options) {
  NetworkShape shape;
  shape.layer_count = options.hidden_layers + 1;
  uint32_t width = inputs;
  for (uint32_t l = 0; l < shape.layer_count; ++l) {
    const uint32_t outputs = l + 1 == shape.layer_count ? 1 : options.width;
    shape.layers[l] = {width, outputs, shape.weights, shape.biases};
    shape.weights += width * outputs;
    shape.biases += outputs;
    shape.widest = std::max({shape.widest, width, outputs});
    width = outputs;
  }
  return shape;
}

class Trainer {
 public:
  Trainer(const RaySource& source, format::Object& object, const TrainingOptions& options)
      : source_(source),
        name_(object.name),
        data_(*object.network),
        options_(options),
        field_(format::field_of(object, {})),
        cells_(field_),
        filter_(field_),
        shape_(make_shape(kernels::input_count(data_.samples, data_.features_per_corner), options.network)),
        features_(data_.features.size(), 1.0f, kFeatureQuantum),
        weights_(shape_.weights, 127 * kWeightQuantum, kWeightQuantum),
        biases_(shape_.biases, 64.0f, kBiasQuantum) {
    for (Group& group : groups_) {
      group.features.assign(features_.master.size(), 0.f);
      group.weights.assign(size_t(shape_.weights) * kVirtualLanes, 0.f);
      group.biases.assign(size_t(shape_.biases) * kVirtualLanes, 0.f);
      group.scratch.assign(train_scratch_floats(shape_), 0.f);
    }
    initialise();
  }

  TrainingResult run(const std::function<void(const TrainingProgress&)>& progress,
                     const std::atomic<bool>& cancel, TrainingLog& log) {
    const KeptTraining* kept = log.begin(name_);
    if (kept && kept->finished) {
      TrainingResult result = result_from(StateReader(kept->state));
      log.finish_as_before();
      return result;
    }
    if (kept) get(StateReader(kept->state));
    TrainingResult result = run_on(kept != nullptr, progress, cancel, log);
    log.finish(state_of(result));
    return result;
  }

 private:
  struct Group {
    Floats features, weights, biases, scratch;
    std::vector<uint8_t> wrong;
    double loss = 0;
  };
  struct Snapshot {
    Parameters features, weights, biases;
    uint64_t adam_step;
  };
  /// Rays since the last multiple of kStepsBetweenSnapshots.
  struct Run {
    uint64_t rays = 0, visible = 0, called_visible = 0;
    double loss = 0;  ///< sum over batches of the mean
    uint64_t batches = 0;

    bool collapsed() const {
      if (called_visible != 0 && called_visible != rays) return false;
      const double share = double(visible) / double(rays);
      if (std::min(share, 1 - share) < kCollapsedShare) return false;
      const double entropy = -share * std::log(share) - (1 - share) * std::log(1 - share);
      return loss / double(batches) >= kCollapsedLoss * entropy;
    }
  };

  /// Position of training within the rays that were drawn last.
  struct Round {
    uint64_t first_chunk = 0;
    uint64_t until = 0;  ///< the step at which it ends
    uint32_t pass = 0;
    uint64_t done = 0;  ///< slices of the pass
  };

  uint64_t all_steps() const { return std::max<uint64_t>(1, options_.rays / options_.batch); }

  TrainingResult run_on(bool within_round, const std::function<void(const TrainingProgress&)>& progress,
                        const std::atomic<bool>& cancel, TrainingLog& log) {
    const uint64_t steps = all_steps();
    const uint64_t chunks_per_round = std::max<uint64_t>(1, options_.rays_per_round / kTrainingChunk);
    for (; step_ < steps; round_.first_chunk += chunks_per_round) {
      TrainingRays rays = draw_rays(round_.first_chunk, chunks_per_round, steps, progress, cancel);
      if (cancel) throw Error(Status::interrupted, "the bake was cancelled");
      if (rays.candidates == 0) return failed("the ray sets of the mix have no rays");
      // If nothing is open, the network is never evaluated; if little is, the same rays are used more often.
      if (rays.count() == 0) break;
      while (rays.count() < options_.batch) rays.append(TrainingRays(rays));
      if (!std::exchange(within_round, false)) {
        const uint64_t in_round = chunks_per_round * kTrainingChunk * options_.passes / options_.batch;
        round_.until = std::min(steps, step_ + std::max<uint64_t>(1, in_round));
        round_.pass = 0, round_.done = 0;
      }
      for (; step_ < round_.until; ++round_.pass, round_.done = 0)
        if (!train_pass(rays, steps, progress, cancel, log))
          return failed(std::string(collapsed_ >= kCollapsedRuns ? "the network gave all rays the same answer"
                                                                 : "the loss stayed non-finite") +
                        " after " + std::to_string(kMaxRecoveries) + " recoveries");
    }
    if (collapsed_ != 0) return failed("the network gives all rays the same answer");
    return finish();
  }

  void initialise() {
    Random random(options_.seed, 0x696e6974, 0);
    for (float& f : features_.master) f = static_cast<float>(random.uniform(-0.05, 0.05));
    for (uint32_t l = 0; l < shape_.layer_count; ++l) {
      const NetworkShape::Layer& layer = shape_.layers[l];
      // Uniform (He et al. 2015), with biases that put every neuron in the middle of its range for inputs of
      // 1/2.
      const double reach = std::min(1.5, std::sqrt(6.0 / layer.inputs));
      for (uint32_t o = 0; o < layer.outputs; ++o) {
        double sum = 0;
        for (uint32_t i = 0; i < layer.inputs; ++i) {
          const double w = random.uniform(-reach, reach);
          weights_.master[layer.weights + o * layer.inputs + i] = static_cast<float>(w);
          sum += w * 0.5;
        }
        biases_.master[layer.biases + o] =
            static_cast<float>((l + 1 == shape_.layer_count ? 0.0 : 0.5) - sum);
      }
    }
    features_.quantise();
    weights_.quantise();
    biases_.quantise();
  }

  TrainingResult failed(const std::string& why) const {
    TrainingResult result;
    result.recoveries = recoveries_;
    result.failure = "training of '" + name_ + "' failed: " + why;
    return result;
  }

  /// The rays of a round, drawn in parts, so that progress is visible in between.
  TrainingRays draw_rays(uint64_t first_chunk, uint64_t chunks, uint64_t steps,
                         const std::function<void(const TrainingProgress&)>& progress,
                         const std::atomic<bool>& cancel) const {
    constexpr uint64_t kChunksAtOnce = 32;
    TrainingRays rays;
    for (uint64_t done = 0; done < chunks && !cancel; done += kChunksAtOnce) {
      rays.append(draw_training_rays(source_, field_, cells_, filter_, options_.mix, options_.seed,
                                     first_chunk + done, std::min(kChunksAtOnce, chunks - done), cancel));
      progress({step_ * options_.batch, steps * options_.batch, loss_, error_});
    }
    return rays;
  }

  /// Uses every drawn ray once, batch by batch, or until the end of the round; where a batch starts differs
  /// from pass to pass. Returns false if recover() does.
  bool train_pass(const TrainingRays& rays, uint64_t steps,
                  const std::function<void(const TrainingProgress&)>& progress,
                  const std::atomic<bool>& cancel, TrainingLog& log) {
    const size_t slice = options_.batch / kTrainGroups, slices = rays.count() / slice;
    // A stride coprime to the number of slices visits each once, in another order every pass.
    size_t stride = 1 + (slices / 3) * (round_.pass + 1);
    while (std::gcd(stride, slices) != 1) ++stride;
    for (uint64_t& done = round_.done; done + kTrainGroups <= slices && step_ < round_.until;
         done += kTrainGroups) {
      if (cancel) throw Error(Status::interrupted, "the bake was cancelled");
      if (step_ % kStepsBetweenCheckpoints == 0 && log.due()) log.keep(put());
      std::array<size_t, kTrainGroups> firsts;
      for (uint32_t g = 0; g < kTrainGroups; ++g) firsts[g] = (done + g) * stride % slices * slice;
      if (!train_batch(rays, firsts, slice, steps)) return false;
      if (step_ % 64 == 0) progress({step_ * options_.batch, steps * options_.batch, loss_, error_});
    }
    return true;
  }

  /// Returns false if recover() does.
  bool train_batch(const TrainingRays& rays, const std::array<size_t, kTrainGroups>& firsts, size_t slice,
                   uint64_t steps) {
    if (step_ % kStepsBetweenSnapshots == 0 && !end_run()) return recover();
    before_training_step({0, step_, weights_.quantised, biases_.quantised, biases_.master});

    const TrainingModel model{shape_,
                              data_.samples,
                              data_.features_per_corner,
                              features_.quantised.data(),
                              weights_.quantised.data(),
                              biases_.quantised.data(),
                              kGain,
                              cells_.corners.data()};
    tbb::parallel_for(
        uint32_t{0}, kTrainGroups,
        [&](uint32_t g) {
          Group& group = groups_[g];
          const size_t first = firsts[g];
          group.wrong.resize(slice);
          GroupGradients gradients{group.features.data(), group.weights.data(), group.biases.data(), 0,
                                   group.wrong.data()};
          const TrainingSlice part{rays.cells.data() + first * rays.samples,
                                   rays.points.data() + first * rays.samples, rays.globals.data() + first,
                                   rays.visible.data() + first};
          train_slice(model, part, uint32_t(slice), group.scratch.data(), gradients);
          group.loss = gradients.loss;
        },
        tbb::simple_partitioner());

    double loss = 0;
    for (const Group& group : groups_) loss += group.loss;
    loss /= options_.batch;
    if (!std::isfinite(loss) || !update(steps)) return recover();
    watch(rays, firsts, slice, loss);
    ++step_;
    return true;
  }

  /// Examines the run that has ended, and takes a snapshot for the next. Returns false if the network has
  /// collapsed.
  bool end_run() {
    if (run_.batches != 0) collapsed_ = run_.collapsed() ? collapsed_ + 1 : 0;
    run_ = {};
    if (collapsed_ >= kCollapsedRuns) return false;
    if (collapsed_ != 0) return true;
    // Only at the end of a run is it known whether the network that started it works.
    trusted_ = std::move(snapshot_);
    snapshot_ = std::make_unique<Snapshot>(Snapshot{features_, weights_, biases_, adam_step_});
    if (!trusted_) trusted_ = std::make_unique<Snapshot>(*snapshot_);
    return true;
  }

  /// Sums the lanes of the small gradients and updates all parameters. Returns false if a change was not
  /// finite.
  bool update(uint64_t steps) {
    ++adam_step_;
    // Warm-up, then half a cosine down to nearly nothing, so that the last steps settle on the quantised
    // grid.
    const double warm = std::min(1.0, double(step_ + 1) / 100);
    const double progress = double(step_) / double(steps);
    const double schedule =
        caution_ * warm * (0.005 + 0.995 * 0.5 * (1 + std::cos(std::numbers::pi * progress)));
    AdamStep adam{};
    adam.beta1 = 0.9f, adam.beta2 = 0.99f, adam.epsilon = 1e-15f;
    adam.correction1 = static_cast<float>(1 / (1 - std::pow(0.9, double(adam_step_))));
    adam.correction2 = static_cast<float>(1 / (1 - std::pow(0.99, double(adam_step_))));
    adam.scale = 1.0f / static_cast<float>(options_.batch);

    std::array<float*, kTrainGroups> features;
    for (uint32_t g = 0; g < kTrainGroups; ++g) features[g] = groups_[g].features.data();
    adam.learning_rate = static_cast<float>(options_.feature_rate * schedule);
    adam.limit = features_.limit, adam.quantum = features_.quantum;
    constexpr size_t kChunk = 8192;
    const size_t chunks = (features_.master.size() + kChunk - 1) / kChunk;
    std::atomic<bool> finite{true};
    tbb::parallel_for(size_t{0}, chunks, [&](size_t c) {
      if (!adam_update(adam, c * kChunk, std::min((c + 1) * kChunk, features_.master.size()), features,
                       features_.master.data(), features_.first.data(), features_.second.data(),
                       features_.quantised.data())) {
        finite = false;
      }
    });

    adam.learning_rate = static_cast<float>(options_.network_rate * schedule);
    auto move = [&](Parameters& parameters, Floats Group::*lanes) {
      Floats sums(parameters.master.size(), 0.f);
      for (Group& group : groups_) {
        Floats& from = group.*lanes;
        for (size_t i = 0; i < sums.size(); ++i) {
          for (size_t lane = 0; lane < kVirtualLanes; ++lane) sums[i] += from[i * kVirtualLanes + lane];
        }
        std::fill(from.begin(), from.end(), 0.f);
      }
      adam.limit = parameters.limit, adam.quantum = parameters.quantum;
      float* const one[] = {sums.data()};
      return adam_update(adam, 0, sums.size(), one, parameters.master.data(), parameters.first.data(),
                         parameters.second.data(), parameters.quantised.data());
    };
    const bool weights_finite = move(weights_, &Group::weights),
               biases_finite = move(biases_, &Group::biases);
    return finite && weights_finite && biases_finite;
  }

  /// Returns to a snapshot, with half the learning rate. Returns false if that has not helped.
  bool recover() {
    if (++recoveries_ > kMaxRecoveries) return false;
    if (collapsed_ != 0) snapshot_ = std::make_unique<Snapshot>(*trusted_);
    features_ = snapshot_->features;
    weights_ = snapshot_->weights;
    biases_ = snapshot_->biases;
    adam_step_ = snapshot_->adam_step;
    caution_ *= 0.5;
    collapsed_ = 0;
    run_ = {};
    for (Group& group : groups_) {
      std::fill(group.features.begin(), group.features.end(), 0.f);
      std::fill(group.weights.begin(), group.weights.end(), 0.f);
      std::fill(group.biases.begin(), group.biases.end(), 0.f);
    }
    ++step_;  // the batch that caused it is not tried again
    return true;
  }

  /// Running means for the progress line, and errors by ray set. Rays are counted before training on them.
  void watch(const TrainingRays& rays, const std::array<size_t, kTrainGroups>& firsts, size_t slice,
             double loss) {
    constexpr double kMemory = 0.98;
    size_t wrong = 0;
    run_.rays += kTrainGroups * slice;
    run_.loss += loss;
    ++run_.batches;
    for (double& count : set_rays_) count *= kMemory;
    for (double& count : set_wrong_) count *= kMemory;
    for (uint32_t g = 0; g < kTrainGroups; ++g) {
      for (size_t i = 0; i < slice; ++i) {
        const size_t set = rays.set[firsts[g] + i];
        set_rays_[set] += 1;
        set_wrong_[set] += groups_[g].wrong[i];
        wrong += groups_[g].wrong[i];
        const bool visible = rays.visible[firsts[g] + i] != 0;
        run_.visible += visible;
        run_.called_visible += visible != (groups_[g].wrong[i] != 0);
      }
    }
    const double error = double(wrong) / options_.batch;
    const double keep = watched_++ == 0 ? 0 : kMemory;
    loss_ = keep * loss_ + (1 - keep) * loss;
    error_ = keep * error_ + (1 - keep) * error;
  }

  format::Mlp blank_network() const {
    format::Mlp network;
    for (uint32_t l = 0; l < shape_.layer_count; ++l) {
      const NetworkShape::Layer& layer = shape_.layers[l];
      network.layers.push_back({layer.inputs, layer.outputs, l + 1 == shape_.layer_count ? 0 : kWeightShift,
                                std::vector<int32_t>(layer.outputs),
                                std::vector<int8_t>(layer.inputs * layer.outputs)});
    }
    network.logit_scale = kGain / float(127 << kWeightShift);
    return network;
  }

  TrainingResult finish() {
    for (size_t i = 0; i < features_.quantised.size(); ++i) {
      data_.features[i] = int8_t(std::lrint(features_.quantised[i] / kFeatureQuantum));
    }
    TrainingResult result;
    result.recoveries = recoveries_;
    for (size_t s = 0; s < set_rays_.size(); ++s)
      result.error[s] = set_rays_[s] > 0 ? set_wrong_[s] / set_rays_[s] : 0;
    result.network = blank_network();
    for (uint32_t l = 0; l < shape_.layer_count; ++l) {
      const NetworkShape::Layer& from = shape_.layers[l];
      format::Layer& layer = result.network.layers[l];
      for (uint32_t i = 0; i < from.inputs * from.outputs; ++i)
        layer.weights[i] = int8_t(std::lrint(weights_.quantised[from.weights + i] / kWeightQuantum));
      for (uint32_t o = 0; o < from.outputs; ++o)
        layer.biases[o] = int32_t(std::lrint(biases_.quantised[from.biases + o] / kBiasQuantum));
    }
    return result;
  }

  /// Everything that later steps depend on, between two steps, when gradients are zero.
  StateWriter put() const {
    StateWriter state;
    for (const Parameters* parameters : {&features_, &weights_, &biases_}) parameters->put(state);
    for (const auto& snapshot : {&snapshot_, &trusted_}) {
      state.put(uint8_t(*snapshot != nullptr));
      if (!*snapshot) continue;
      for (const Parameters* parameters :
           {&(*snapshot)->features, &(*snapshot)->weights, &(*snapshot)->biases})
        parameters->put(state);
      state.put((*snapshot)->adam_step);
    }
    state.put(round_), state.put(step_), state.put(adam_step_), state.put(recoveries_), state.put(caution_);
    state.put(run_), state.put(collapsed_), state.put(watched_), state.put(loss_), state.put(error_);
    state.put(set_rays_), state.put(set_wrong_);
    return state;
  }
  void get(StateReader state) {
    for (Parameters* parameters : {&features_, &weights_, &biases_}) parameters->get(state);
    for (auto* snapshot : {&snapshot_, &trusted_}) {
      if (state.get<uint8_t>() == 0) continue;
      *snapshot = std::make_unique<Snapshot>(Snapshot{features_, weights_, biases_, 0});
      for (Parameters* parameters : {&(*snapshot)->features, &(*snapshot)->weights, &(*snapshot)->biases})
        parameters->get(state);
      state.get((*snapshot)->adam_step);
    }
    state.get(round_), state.get(step_), state.get(adam_step_), state.get(recoveries_), state.get(caution_);
    state.get(run_), state.get(collapsed_), state.get(watched_), state.get(loss_), state.get(error_);
    state.get(set_rays_), state.get(set_wrong_);
    state.end();
    state.require(step_ <= round_.until && round_.until <= all_steps() && recoveries_ <= kMaxRecoveries &&
                  collapsed_ < kCollapsedRuns && caution_ >= 0 && caution_ <= 1);
    // The first step takes both snapshots.
    state.require((snapshot_ && trusted_) || (step_ == 0 && run_.batches == 0 && collapsed_ == 0));
    for (size_t s = 0; s < set_rays_.size(); ++s)
      state.require(set_wrong_[s] >= 0 && set_wrong_[s] <= set_rays_[s] && std::isfinite(set_rays_[s]));
  }

  StateWriter state_of(const TrainingResult& result) const {
    StateWriter state;
    state.put_all(data_.features);
    state.put(result.recoveries), state.put_all(result.failure), state.put(result.error);
    for (const format::Layer& layer : result.network.layers)
      state.put_all(layer.biases), state.put_all(layer.weights);
    return state;
  }
  TrainingResult result_from(StateReader state) {
    TrainingResult result;
    state.get_within(data_.features, 127);
    state.get(result.recoveries), state.get_all(result.failure), state.get(result.error);
    for (const double share : result.error) state.require(share >= 0 && share <= 1);
    if (result.failure.empty()) result.network = blank_network();
    for (format::Layer& layer : result.network.layers)
      state.get_within(layer.biases, biases_.limit / kBiasQuantum), state.get_within(layer.weights, 127);
    state.end();
    return result;
  }

  const RaySource& source_;
  const std::string name_;
  format::NetworkData& data_;
  const TrainingOptions& options_;
  kernels::SegmentField field_;
  SurfaceCells cells_;
  OpenFilter filter_;
  NetworkShape shape_;
  Parameters features_, weights_, biases_;
  std::array<Group, kTrainGroups> groups_;
  std::unique_ptr<Snapshot> snapshot_;  ///< the latest
  std::unique_ptr<Snapshot> trusted_;   ///< the latest whose network did not collapse in the next run
  Round round_;
  uint64_t step_ = 0, adam_step_ = 0;
  uint32_t recoveries_ = 0;
  double caution_ = 1;  // factor on the learning rate, halved at each recovery
  Run run_;
  uint32_t collapsed_ = 0;  ///< number of consecutive runs, up to the last
  uint64_t watched_ = 0;
  double loss_ = 0, error_ = 0;
  std::array<double, kRaySets.size()> set_rays_{}, set_wrong_{};
};

}  // namespace

TrainingResult train(const RaySource& source, format::Object& object, const TrainingOptions& options,
                     const std::function<void(const TrainingProgress&)>& progress,
                     const std::atomic<bool>& cancel, TrainingLog* log) {
  TrainingLog none;
  return Trainer(source, object, options).run(progress, cancel, log ? *log : none);
}

}  // namespace nif::bake
