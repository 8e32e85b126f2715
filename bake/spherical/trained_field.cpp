// Trains a field. A step looks up latent vectors, runs the network on eight parts of a batch, sums gradients
// in order, and updates with Adam. If the loss is not finite, all fields return to their last save, with half
// the rate.
#include "bake/spherical/trained_field.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "bake/training_hook.hpp"
#include "formats/base/status.hpp"

namespace nif::bake {
namespace {

constexpr uint32_t kMostRecoveries = 6;
/// Per training: no machine takes as many.
constexpr uint64_t kMostSteps = uint64_t{1} << 40;

NetworkShape make_shape(uint32_t inputs, uint32_t width, uint32_t hidden_layers, uint32_t outputs) {
  NetworkShape shape;
  shape.layer_count = hidden_layers + 1;
  uint32_t before = inputs;
  for (uint32_t l = 0; l < shape.layer_count; ++l) {
    const uint32_t after = l == hidden_layers ? outputs : width;
    shape.layers[l] = {before, after, shape.weights, 0};
    shape.weights += before * after;
    shape.widest = std::max({shape.widest, before, after});
    before = after;
  }
  return shape;
}

}  // namespace

TrainedField::TrainedField(const SphericalOptions& options, const Shape& shape,
                           std::vector<TrainedGrid> grids, Random& random)
    : options_(options), shape_(shape), grids_(std::move(grids)) {
  for (const TrainedGrid& grid : grids_) inputs_ += grid.features();
  network_ = make_shape(inputs_, shape.width, shape.hidden_layers, shape.outputs);
  for (Floats* part : {&weights_, &first_, &second_, &sums_}) part->assign(network_.weights, 0.f);
  for (uint32_t l = 0; l < network_.layer_count; ++l) {
    const NetworkShape::Layer& layer = network_.layers[l];
    const double reach =
        std::sqrt(6.0 / double(options.he_weights ? layer.inputs : layer.inputs + layer.outputs));
    for (uint32_t i = 0; i < layer.inputs * layer.outputs; ++i)
      weights_[layer.weights + i] = static_cast<float>(random.uniform(-reach, reach));
  }
  for (Group& group : groups_) {
    group.gradients.assign(size_t(network_.weights) * kVirtualLanes, 0.f);
    group.scratch.assign(spherical_scratch_floats(network_), 0.f);
  }
  for (size_t g = 0; g < grids_.size(); ++g) lookups_[g].resize(shape.batch);
  labels_.resize(shape.batch);
  wrong_.resize(shape.batch);
  targets_.resize(size_t(shape.batch) * (shape.outputs - 1));
  input_gradients_.resize(size_t(shape.batch) * inputs_);
  save();
}

void TrainedField::add(const FieldSample& sample, std::span<const float> targets) {
  waiting_.push_back(sample);
  waiting_targets_.insert(waiting_targets_.end(), targets.begin(), targets.end());
}

void TrainedField::keep_remainder() {
  const size_t learned = waiting_.size() - waiting_.size() % shape_.batch;
  waiting_.erase(waiting_.begin(), waiting_.begin() + ptrdiff_t(learned));
  waiting_targets_.erase(waiting_targets_.begin(),
                         waiting_targets_.begin() + ptrdiff_t(learned * (shape_.outputs - 1)));
}

void TrainedField::save() {
  for (TrainedGrid& grid : grids_) grid.save();
  saved_weights_ = weights_, saved_first_ = first_, saved_second_ = second_, saved_adam_steps_ = adam_steps_;
}

void TrainedField::restore() {
  for (TrainedGrid& grid : grids_) grid.restore();
  weights_ = saved_weights_, first_ = saved_first_, second_ = saved_second_, adam_steps_ = saved_adam_steps_;
  for (Group& group : groups_) std::fill(group.gradients.begin(), group.gradients.end(), 0.f);
}

void TrainedField::put(StateWriter& state, bool ended) const {
  for (const TrainedGrid& grid : grids_) grid.put(state, ended);
  state.put(steps_);
  state.put_all(weights_);
  if (ended) return;
  state.put_all(first_), state.put_all(second_), state.put(adam_steps_);
  state.put_all(waiting_), state.put_all(waiting_targets_);
}

void TrainedField::get(StateReader& state, bool ended) {
  for (TrainedGrid& grid : grids_) grid.get(state, ended);
  state.get(steps_);
  state.require(steps_ < kMostSteps);
  state.get_within(weights_, kernels::kMaxSphericalValue);
  if (ended) return;
  state.get_finite(first_), state.get_finite(second_), state.get(adam_steps_);
  state.get_all(waiting_);
  state.require(waiting_.size() < shape_.batch);
  for (const FieldSample& sample : waiting_)
    state.require(sample.object < grids_.front().objects() && sample.label <= 1);
  waiting_targets_.resize(waiting_.size() * (shape_.outputs - 1));
  state.get_finite(waiting_targets_);
  save();
}

bool TrainedField::step(size_t number, const uint32_t* order, double caution, double& loss, double& error) {
  before_training_step({number, steps_, weights_, {}, {}});
  ++steps_;
  SphericalModel model{network_, weights_.data(),      options_.slope, options_.loss, uint32_t(grids_.size()),
                       {},       shape_.target_weights};
  for (size_t g = 0; g < grids_.size(); ++g) model.grids[g] = grids_[g].view();
  const uint32_t part = shape_.batch / kBatchGroups;
  tbb::parallel_for(
      uint32_t{0}, kBatchGroups,
      [&](uint32_t k) {
        Group& group = groups_[k];
        const size_t first = size_t(k) * part;
        SphericalSlice slice{};
        for (size_t s = first; s < first + part; ++s) {
          const FieldSample& sample = waiting_[order[s]];
          for (size_t g = 0; g < grids_.size(); ++g) lookups_[g][s] = grids_[g].look_up(sample);
          labels_[s] = sample.label;
          for (uint32_t t = 0; t + 1 < shape_.outputs; ++t)
            targets_[target_index(s, t, shape_.outputs - 1)] =
                waiting_targets_[size_t(order[s]) * (shape_.outputs - 1) + t];
        }
        for (size_t g = 0; g < grids_.size(); ++g) slice.lookups[g] = lookups_[g].data() + first;
        slice.labels = labels_.data() + first;
        slice.targets = targets_.data() + first * (shape_.outputs - 1);
        slice.input_gradients = input_gradients_.data() + first * inputs_;
        slice.weight_gradients = group.gradients.data();
        slice.wrong = wrong_.data() + first;
        train_spherical(model, part, group.scratch.data(), slice);
        group.loss = slice.loss;
      },
      tbb::simple_partitioner());
  loss = 0;
  for (const Group& group : groups_) loss += group.loss;
  loss /= shape_.batch;
  error = double(std::accumulate(wrong_.begin(), wrong_.end(), uint64_t{0})) / shape_.batch;
  return std::isfinite(loss) && update(caution);
}

format::SphericalLayers TrainedField::layers() const {
  format::SphericalLayers layers{inputs_, shape_.width, shape_.hidden_layers, {}};
  for (uint32_t l = 0; l < network_.layer_count; ++l) {
    const NetworkShape::Layer& layer = network_.layers[l];
    for (uint32_t i = 0; i < layer.inputs; ++i)
      for (uint32_t o = 0; o < layer.outputs; ++o) {
        const float weight = weights_[layer.weights + o * layer.inputs + i];
        layers.weights.push_back(options_.half_networks ? kernels::from_half(kernels::to_half(weight))
                                                        : weight);
      }
  }
  return layers;
}

bool TrainedField::update(double caution) {
  ++adam_steps_;
  AdamStep adam{};
  adam.learning_rate = static_cast<float>(double(options_.learning_rate) * caution);
  adam.beta1 = options_.beta1, adam.beta2 = options_.beta2, adam.epsilon = options_.epsilon;
  adam.correction1 = static_cast<float>(1 / (1 - std::pow(double(options_.beta1), double(adam_steps_))));
  adam.correction2 = static_cast<float>(1 / (1 - std::pow(double(options_.beta2), double(adam_steps_))));
  adam.scale = 1.0f / static_cast<float>(shape_.batch);
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
        std::array<float*, kBatchGroups> gradients;
        for (uint32_t k = 0; k < kBatchGroups; ++k) gradients[k] = groups_[k].gradients.data();
        sum_lanes(gradients, 0, weights_.size(), sums_.data());
        finite[g] =
            adam_step(adam, weights_.size(), sums_.data(), weights_.data(), first_.data(), second_.data());
      },
      tbb::simple_partitioner());
  return std::all_of(finite.begin(), finite.end(), [](bool good) { return good; });
}

void FieldLessons::put(StateWriter& state) const {
  state.put(random_), state.put(recoveries_), state.put(caution_);
  state.put(watched_), state.put(loss_), state.put(error_);
}

void FieldLessons::get(StateReader& state) {
  state.get(random_), state.get(recoveries_), state.get(caution_);
  state.get(watched_), state.get(loss_), state.get(error_);
  state.require(recoveries_ <= kMostRecoveries && caution_ >= 0 && caution_ <= 1);
}

bool FieldLessons::learn(std::span<TrainedField* const> fields, uint32_t passes,
                         const std::function<void(const SphericalProgress&)>& progress,
                         const std::atomic<bool>& cancel) {
  for (TrainedField* field : fields) field->save();
  for (uint32_t pass = 0; pass < passes; ++pass)
    for (size_t number = 0; number < fields.size(); ++number)
      if (!learn_once(fields, number, progress, cancel)) return false;
  for (TrainedField* field : fields) field->keep_remainder();
  return true;
}

bool FieldLessons::learn_once(std::span<TrainedField* const> fields, size_t number,
                              const std::function<void(const SphericalProgress&)>& progress,
                              const std::atomic<bool>& cancel) {
  TrainedField& field = *fields[number];
  std::vector<uint32_t> order(field.waiting());
  std::iota(order.begin(), order.end(), 0u);
  for (size_t i = order.size(); i > 1; --i) std::swap(order[i - 1], order[random_.below(uint32_t(i))]);
  for (size_t first = 0; first + field.batch() <= order.size(); first += field.batch()) {
    if (cancel) throw Error(Status::interrupted, "the bake was cancelled");
    double loss = 0, error = 0;
    if (!field.step(number, order.data() + first, caution_, loss, error)) {
      if (!recover(fields)) return false;
      continue;  // the batch that caused it is not tried again
    }
    const double keep = watched_++ == 0 ? 0 : 0.98;
    loss_ = keep * loss_ + (1 - keep) * loss;
    error_ = keep * error_ + (1 - keep) * error;
    if (progress && watched_ % 64 == 0) progress({loss_, error_});
  }
  return true;
}

bool FieldLessons::recover(std::span<TrainedField* const> fields) {
  if (++recoveries_ > kMostRecoveries) return false;
  for (TrainedField* field : fields) field->restore();
  caution_ *= 0.5;
  return true;
}

}  // namespace nif::bake
