#include "bake/spherical_trainer.hpp"

#include <fmt/format.h>
#include <tbb/cache_aligned_allocator.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "bake/random.hpp"
#include "bake/spherical_kernels.hpp"
#include "formats/status.hpp"
#include "kernels/reference/spherical.hpp"

namespace nif::bake {
namespace {

using kernels::SphericalCoordinates;

/// Parts that a mini-batch's weight gradients are added up in, then summed in order.
constexpr uint32_t kGroups = 8;
static_assert(kSphericalBatchUnit == kGroups * kTrainLanes);
constexpr uint32_t kMaxRecoveries = 6;
constexpr uint32_t kNone = 0xffffffffu;

using Floats = std::vector<float, tbb::cache_aligned_allocator<float>>;

/// One ray as a network sees it.
struct Sample {
  SphericalCoordinates at;
  uint32_t object;
  uint8_t visible;
};

/// Which of a ray's coordinates a grid is over.
enum class GridKind { position, direction, distance };

/// A grid of all objects, with Adam's moments. A batch looks up few of its entries, so only those are moved:
/// they get slots in small arrays, gradients are added up there in the order of the samples, and the others
/// rest.
class Grid {
 public:
  Grid(GridKind kind, uint32_t resolution, uint32_t features, size_t objects, float reach, Random& random)
      : kind_(kind), resolution_(resolution), features_(features) {
    per_object_ = size_t(resolution) * (kind == GridKind::distance ? 1 : resolution);
    entries_.assign(objects * per_object_ * 3 * features, 0.f);
    for (size_t e = 0; e < objects * per_object_; ++e)
      for (uint32_t f = 0; f < features; ++f)
        entries_[e * 3 * features + f] = static_cast<float>(random.uniform(-double(reach), double(reach)));
    slots_.assign(objects * per_object_, kNone);
    saved_ = entries_;
  }

  uint32_t features() const { return features_; }
  uint32_t corners() const { return kind_ == GridKind::distance ? 2 : 4; }
  LatentGrid view() const { return {features_, corners(), entries_.data()}; }
  void save() { saved_ = entries_; }
  void restore() { entries_ = saved_; }

  LatentLookup look_up(const Sample& sample) const {
    const auto first = uint32_t(sample.object * per_object_);
    if (kind_ == GridKind::distance) {
      const kernels::SphericalCell cell = kernels::along(sample.at.distance, resolution_);
      return {{first + cell.low, first + cell.high, 0, 0}, {1 - cell.fraction, cell.fraction, 0, 0}};
    }
    const bool position = kind_ == GridKind::position;
    const kernels::SphericalCell row =
        kernels::along(position ? sample.at.position_theta : sample.at.direction_theta, resolution_);
    const kernels::SphericalCell column =
        kernels::around(position ? sample.at.position_phi : sample.at.direction_phi, resolution_);
    const uint32_t low = first + row.low * resolution_, high = first + row.high * resolution_;
    return {{low + column.low, low + column.high, high + column.low, high + column.high},
            {(1 - row.fraction) * (1 - column.fraction), (1 - row.fraction) * column.fraction,
             row.fraction * (1 - column.fraction), row.fraction * column.fraction}};
  }

  /// One step of Adam. input_gradients: for each kTrainLanes samples [input][kTrainLanes], this grid's from
  /// `offset` on. False where an entry moved by something not finite.
  bool update(const AdamStep& step, std::span<const LatentLookup> lookups, const float* input_gradients,
              uint32_t inputs, uint32_t offset) {
    touched_.clear();
    gradients_.clear();
    for (size_t s = 0; s < lookups.size(); ++s) {
      const float* from =
          input_gradients + (s / kTrainLanes * inputs + offset) * kTrainLanes + s % kTrainLanes;
      for (uint32_t c = 0; c < corners(); ++c) {
        uint32_t& slot = slots_[lookups[s].entries[c]];
        if (slot == kNone) {
          slot = uint32_t(touched_.size());
          touched_.push_back(lookups[s].entries[c]);
          gradients_.resize(gradients_.size() + features_, 0.f);
        }
        float* to = gradients_.data() + size_t(slot) * features_;
        for (uint32_t f = 0; f < features_; ++f)
          to[f] += lookups[s].weights[c] * from[size_t(f) * kTrainLanes];
      }
    }
    const size_t count = gradients_.size();
    for (Floats& part : parts_) part.resize(count);
    // One loop for all three: a latent vector is too short for copying functions to be worth their call.
    for (size_t t = 0; t < touched_.size(); ++t) {
      const float* from = entries_.data() + size_t(touched_[t]) * 3 * features_;
      for (size_t i = t * features_; i < (t + 1) * features_; ++i, ++from) {
        parts_[0][i] = from[0];
        parts_[1][i] = from[features_];
        parts_[2][i] = from[2 * features_];
      }
    }
    const bool finite =
        adam_step(step, count, gradients_.data(), parts_[0].data(), parts_[1].data(), parts_[2].data());
    for (size_t t = 0; t < touched_.size(); ++t) {
      float* to = entries_.data() + size_t(touched_[t]) * 3 * features_;
      for (size_t i = t * features_; i < (t + 1) * features_; ++i, ++to) {
        to[0] = parts_[0][i];
        to[features_] = parts_[1][i];
        to[2 * features_] = parts_[2][i];
      }
      slots_[touched_[t]] = kNone;
    }
    return finite;
  }

  std::vector<float> values(size_t object, bool half) const {
    std::vector<float> values;
    values.reserve(per_object_ * features_);
    for (size_t e = object * per_object_; e < (object + 1) * per_object_; ++e)
      for (uint32_t f = 0; f < features_; ++f) {
        const float value = entries_[e * 3 * features_ + f];
        values.push_back(half ? kernels::from_half(kernels::to_half(value)) : value);
      }
    return values;
  }

 private:
  GridKind kind_;
  uint32_t resolution_, features_;
  size_t per_object_;
  Floats entries_, saved_;       // [entry]: latent vector, first and second moments
  std::vector<uint32_t> slots_;  // [entry], kNone between updates
  std::vector<uint32_t> touched_;
  Floats gradients_, parts_[3];
};

NetworkShape make_shape(uint32_t inputs, uint32_t width, uint32_t hidden_layers) {
  NetworkShape shape;
  shape.layer_count = hidden_layers + 1;
  uint32_t before = inputs;
  for (uint32_t l = 0; l < shape.layer_count; ++l) {
    const uint32_t outputs = l == hidden_layers ? 1 : width;
    shape.layers[l] = {before, outputs, shape.weights, 0};
    shape.weights += before * outputs;
    shape.widest = std::max({shape.widest, before, outputs});
    before = outputs;
  }
  return shape;
}

/// A network with its grids, outer or inner.
class Field {
 public:
  Field(const SphericalOptions& options, uint32_t batch, uint32_t width, uint32_t hidden_layers,
        std::vector<Grid> grids, Random& random)
      : options_(options),
        batch_(batch),
        width_(width),
        hidden_layers_(hidden_layers),
        grids_(std::move(grids)) {
    for (const Grid& grid : grids_) inputs_ += grid.features();
    shape_ = make_shape(inputs_, width, hidden_layers);
    for (Floats* part : {&weights_, &first_, &second_, &sums_}) part->assign(shape_.weights, 0.f);
    for (uint32_t l = 0; l < shape_.layer_count; ++l) {
      const NetworkShape::Layer& layer = shape_.layers[l];
      const double reach =
          std::sqrt(6.0 / double(options.he_weights ? layer.inputs : layer.inputs + layer.outputs));
      for (uint32_t i = 0; i < layer.inputs * layer.outputs; ++i)
        weights_[layer.weights + i] = static_cast<float>(random.uniform(-reach, reach));
    }
    for (Group& group : groups_) {
      group.gradients.assign(size_t(shape_.weights) * kVirtualLanes, 0.f);
      group.scratch.assign(spherical_scratch_floats(shape_), 0.f);
    }
    for (size_t g = 0; g < grids_.size(); ++g) lookups_[g].resize(batch);
    visible_.resize(batch);
    wrong_.resize(batch);
    input_gradients_.resize(size_t(batch) * inputs_);
    save();
  }

  uint32_t batch() const { return batch_; }
  uint64_t steps() const { return steps_; }
  const std::vector<Grid>& grids() const { return grids_; }
  std::vector<Sample>& waiting() { return waiting_; }

  void save() {
    for (Grid& grid : grids_) grid.save();
    saved_weights_ = weights_, saved_first_ = first_, saved_second_ = second_,
    saved_adam_steps_ = adam_steps_;
  }
  void restore() {
    for (Grid& grid : grids_) grid.restore();
    weights_ = saved_weights_, first_ = saved_first_, second_ = saved_second_,
    adam_steps_ = saved_adam_steps_;
    for (Group& group : groups_) std::fill(group.gradients.begin(), group.gradients.end(), 0.f);
  }
  void spoil() { weights_[0] = std::nanf(""); }

  /// One mini-batch: waiting()[order[0 .. batch)]. False where something was not finite.
  bool step(const uint32_t* order, double caution, double& loss, double& error) {
    ++steps_;
    SphericalModel model{shape_, weights_.data(), options_.slope, options_.loss, uint32_t(grids_.size()), {}};
    for (size_t g = 0; g < grids_.size(); ++g) model.grids[g] = grids_[g].view();
    const uint32_t part = batch_ / kGroups;
    tbb::parallel_for(
        uint32_t{0}, kGroups,
        [&](uint32_t k) {
          Group& group = groups_[k];
          const size_t first = size_t(k) * part;
          SphericalSlice slice{};
          for (size_t s = first; s < first + part; ++s) {
            const Sample& sample = waiting_[order[s]];
            for (size_t g = 0; g < grids_.size(); ++g) lookups_[g][s] = grids_[g].look_up(sample);
            visible_[s] = sample.visible;
          }
          for (size_t g = 0; g < grids_.size(); ++g) slice.lookups[g] = lookups_[g].data() + first;
          slice.visible = visible_.data() + first;
          slice.input_gradients = input_gradients_.data() + first * inputs_;
          slice.weight_gradients = group.gradients.data();
          slice.wrong = wrong_.data() + first;
          train_spherical(model, part, group.scratch.data(), slice);
          group.loss = slice.loss;
        },
        tbb::simple_partitioner());
    loss = 0;
    for (const Group& group : groups_) loss += group.loss;
    loss /= batch_;
    error = double(std::accumulate(wrong_.begin(), wrong_.end(), uint64_t{0})) / batch_;
    return std::isfinite(loss) && update(caution);
  }

  format::SphericalLayers layers() const {
    format::SphericalLayers layers{inputs_, width_, hidden_layers_, {}};
    for (uint32_t l = 0; l < shape_.layer_count; ++l) {
      const NetworkShape::Layer& layer = shape_.layers[l];
      for (uint32_t i = 0; i < layer.inputs; ++i)
        for (uint32_t o = 0; o < layer.outputs; ++o) {
          const float weight = weights_[layer.weights + o * layer.inputs + i];
          layers.weights.push_back(options_.half_networks ? kernels::from_half(kernels::to_half(weight))
                                                          : weight);
        }
    }
    return layers;
  }

 private:
  struct Group {
    Floats gradients, scratch;
    double loss = 0;
  };

  /// Moves everything: each grid by one thread, and the weights by another.
  bool update(double caution) {
    ++adam_steps_;
    AdamStep adam{};
    adam.learning_rate = static_cast<float>(double(options_.learning_rate) * caution);
    adam.beta1 = options_.beta1, adam.beta2 = options_.beta2, adam.epsilon = options_.epsilon;
    adam.correction1 = static_cast<float>(1 / (1 - std::pow(double(options_.beta1), double(adam_steps_))));
    adam.correction2 = static_cast<float>(1 / (1 - std::pow(double(options_.beta2), double(adam_steps_))));
    adam.scale = 1.0f / static_cast<float>(batch_);
    adam.limit = kernels::kMaxSphericalValue;
    std::array<uint32_t, kMaxLatentGrids> offsets{};
    for (size_t g = 1; g < grids_.size(); ++g) offsets[g] = offsets[g - 1] + grids_[g - 1].features();
    std::array<bool, kMaxLatentGrids + 1> finite{};
    finite.fill(true);
    tbb::parallel_for(
        size_t{0}, grids_.size() + 1,
        [&](size_t g) {
          if (g < grids_.size()) {
            finite[g] = grids_[g].update(adam, lookups_[g], input_gradients_.data(), inputs_, offsets[g]);
            return;
          }
          std::array<float*, kGroups> gradients;
          for (uint32_t k = 0; k < kGroups; ++k) gradients[k] = groups_[k].gradients.data();
          sum_lanes(gradients, 0, weights_.size(), sums_.data());
          finite[g] =
              adam_step(adam, weights_.size(), sums_.data(), weights_.data(), first_.data(), second_.data());
        },
        tbb::simple_partitioner());
    return std::all_of(finite.begin(), finite.end(), [](bool good) { return good; });
  }

  const SphericalOptions& options_;
  uint32_t batch_, width_, hidden_layers_, inputs_ = 0;
  std::vector<Grid> grids_;
  NetworkShape shape_;
  Floats weights_, first_, second_, sums_;
  Floats saved_weights_, saved_first_, saved_second_;
  uint64_t steps_ = 0, adam_steps_ = 0, saved_adam_steps_ = 0;
  std::array<Group, kGroups> groups_;
  std::vector<Sample> waiting_;
  // Of the current batch.
  std::vector<LatentLookup> lookups_[kMaxLatentGrids];
  std::vector<uint8_t> visible_, wrong_;
  Floats input_gradients_;
};

std::vector<Grid> outer_grids(const SphericalOptions& options, size_t objects, Random& random) {
  const auto& [resolution, features, width, layers, batch] = options.outer;
  std::vector<Grid> grids;
  for (const GridKind kind : {GridKind::position, GridKind::direction})
    grids.emplace_back(kind, resolution, features, objects, options.latent_reach, random);
  return grids;
}

std::vector<Grid> inner_grids(const SphericalOptions& options, size_t objects, Random& random) {
  const SphericalOptions::Inner& inner = options.inner;
  std::vector<Grid> grids;
  for (const GridKind kind : {GridKind::position, GridKind::direction})
    grids.emplace_back(kind, inner.resolution, inner.features, objects, options.latent_reach, random);
  grids.emplace_back(GridKind::distance, inner.distance_resolution, inner.distance_features, objects,
                     options.latent_reach, random);
  return grids;
}

}  // namespace

class SphericalTrainer::Implementation {
 public:
  Implementation(std::span<const format::Object> objects, const SphericalOptions& options)
      : options_(options),
        random_(options.seed, 0x73706865726963, 0),
        outer_(options_, options.outer.batch, options.outer.width, options.outer.hidden_layers,
               outer_grids(options, objects.size(), random_), random_),
        inner_(options_, options.inner.batch, options.inner.width, options.inner.hidden_layers,
               inner_grids(options, objects.size(), random_), random_) {
    bounds_.resize(objects.size());
    for (size_t i = 0; i < objects.size(); ++i)
      if (!kernels::set_bounds(objects[i].aabb_min.data(), objects[i].aabb_max.data(), bounds_[i]))
        throw Error(Status::too_large,
                    fmt::format("'{}' is too small or too large to compute with", objects[i].name));
  }

  void learn(const SphericalRays& rays, uint32_t passes,
             const std::function<void(const SphericalProgress&)>& progress, const std::atomic<bool>& cancel) {
    sort_in(rays);
    for (Field* field : {&outer_, &inner_}) field->save();
    for (uint32_t pass = 0; pass < passes; ++pass)
      for (Field* field : {&outer_, &inner_}) learn_once(*field, progress, cancel);
    for (Field* field : {&outer_, &inner_}) {
      // What does not fill a batch is kept.
      std::vector<Sample>& waiting = field->waiting();
      waiting.erase(waiting.begin(), waiting.end() - ptrdiff_t(waiting.size() % field->batch()));
    }
  }

  const Field& outer() const { return outer_; }
  const Field& inner() const { return inner_; }
  uint32_t recoveries() const { return recoveries_; }
  const SphericalOptions& options() const { return options_; }

 private:
  /// Appends rays to the samples of their networks.
  void sort_in(const SphericalRays& rays) {
    const size_t count = rays.segments.size();
    std::vector<kernels::SphericalRay> prepared(count);
    tbb::parallel_for(tbb::blocked_range<size_t>(0, count, 4096), [&](const auto& range) {
      for (size_t i = range.begin(); i < range.end(); ++i)
        prepared[i] =
            kernels::prepare_spherical(bounds_[rays.objects.empty() ? 0 : rays.objects[i]], rays.segments[i]);
    });
    for (size_t i = 0; i < count; ++i) {
      if (prepared[i].kind == kernels::SphericalKind::none) continue;
      Field& field = prepared[i].kind == kernels::SphericalKind::outer ? outer_ : inner_;
      field.waiting().push_back(
          {prepared[i].at, rays.objects.empty() ? 0 : rays.objects[i], rays.visible[i]});
    }
  }

  void learn_once(Field& field, const std::function<void(const SphericalProgress&)>& progress,
                  const std::atomic<bool>& cancel) {
    std::vector<uint32_t> order(field.waiting().size());
    std::iota(order.begin(), order.end(), 0u);
    for (size_t i = order.size(); i > 1; --i) std::swap(order[i - 1], order[random_.below(uint32_t(i))]);
    for (size_t first = 0; first + field.batch() <= order.size(); first += field.batch()) {
      if (cancel) throw Error(Status::interrupted, "the bake was cancelled");
      if (&field == &outer_ && field.steps() - options_.spoil_at_step < options_.spoil_steps) field.spoil();
      double loss = 0, error = 0;
      if (!field.step(order.data() + first, caution_, loss, error)) {
        recover();
        continue;  // the batch that did it is not tried again
      }
      const double keep = watched_++ == 0 ? 0 : 0.98;
      loss_ = keep * loss_ + (1 - keep) * loss;
      error_ = keep * error_ + (1 - keep) * error;
      if (progress && watched_ % 64 == 0) progress({loss_, error_});
    }
  }

  /// Back to where the call began, with half the learning rate.
  void recover() {
    if (++recoveries_ > kMaxRecoveries)
      throw Error(Status::training_failed, fmt::format("training failed: the loss stayed non-finite after {} "
                                                       "recoveries",
                                                       kMaxRecoveries));
    outer_.restore();
    inner_.restore();
    caution_ *= 0.5;
  }

  const SphericalOptions options_;
  Random random_;
  std::vector<kernels::SphericalField> bounds_;  // without grids and networks
  Field outer_, inner_;
  uint32_t recoveries_ = 0;
  double caution_ = 1;
  uint64_t watched_ = 0;
  double loss_ = 0, error_ = 0;
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
  const SphericalOptions::Outer& outer = options.outer;
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
  const std::vector<Grid>&outer = implementation_->outer().grids(), &inner = implementation_->inner().grids();
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
