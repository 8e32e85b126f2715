// Forward pass, loss and backward pass for 64 rays at once, then Adam, with Highway for each target. In the
// backward pass, neurons outside their range keep a small slope, so that they can recover.
#include "bake/network/network_trainer_kernels.hpp"

#include <algorithm>
#include <cstring>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "bake/network/network_trainer_kernels.cpp"
#include <hwy/foreach_target.h>  // must come before highway.h

#include <hwy/contrib/math/math-inl.h>
#include <hwy/highway.h>

#include "bake/layers-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace nif::bake {
namespace HWY_NAMESPACE {

constexpr float kActivationTop = 127.0f;
/// Slope of the activation outside (0, 1), only in the backward pass, so that no neuron stays dead.
constexpr float kLeak = 0.02f;

/// Rounds values in [0, 1] to multiples of 1/127, as the integer network does: floor(127 x + 1/2) / 127.
HWY_INLINE Vector round_activation(Wide d, Vector x) {
  const Vector scaled = hn::Floor(hn::MulAdd(x, hn::Set(d, kActivationTop), hn::Set(d, 0.5f)));
  return hn::Mul(scaled, hn::Set(d, 1.0f / kActivationTop));
}

/// Interpolation weights of the eight corners, exact multiples of 2^-21.
HWY_INLINE void corner_weights(const uint8_t (&fraction)[3], float weights[8]) {
  const float x1 = float(fraction[0]) * (1.0f / 128), y1 = float(fraction[1]) * (1.0f / 128),
              z1 = float(fraction[2]) * (1.0f / 128);
  const float x0 = 1 - x1, y0 = 1 - y1, z0 = 1 - z1;
  const float a = y0 * z0, b = y1 * z0, c = y0 * z1, e = y1 * z1;
  weights[0] = x0 * a, weights[1] = x1 * a, weights[2] = x0 * b, weights[3] = x1 * b;
  weights[4] = x0 * c, weights[5] = x1 * c, weights[6] = x0 * e, weights[7] = x1 * e;
}

/// x[input][ray]: features first, then the heights, then the global inputs.
void gather(const TrainingModel& model, const TrainingSlice& slice, float* HWY_RESTRICT x) {
  const hn::CappedTag<float, 2> pair;
  const uint32_t step = uint32_t(hn::Lanes(pair));
  const uint32_t samples = model.samples, width = model.features_per_corner;
  for (uint32_t ray = 0; ray < kTrainLanes; ++ray) {
    for (uint32_t j = 0; j < samples; ++j) {
      const size_t point = size_t(ray) * samples + j;
      const auto& corners = model.cell_corners[slice.cells[point]];
      float weights[8];
      corner_weights(slice.points[point].fraction, weights);
      for (uint32_t f = 0; f < width; f += step) {
        auto sum = hn::Zero(pair);
        for (int c = 0; c < 8; ++c) {
          sum = hn::MulAdd(hn::Set(pair, weights[c]),
                           hn::LoadU(pair, model.features + size_t(corners[c]) * width + f), sum);
        }
        float values[2];
        hn::StoreU(sum, pair, values);
        for (uint32_t k = 0; k < step; ++k) x[size_t(j * width + f + k) * kTrainLanes + ray] = values[k];
      }
      x[size_t(samples * width + j) * kTrainLanes + ray] =
          float(slice.points[point].height) * (1.0f / kActivationTop);
    }
    for (uint32_t g = 0; g < kernels::kGlobalInputs; ++g) {
      x[size_t(samples * (width + 1) + g) * kTrainLanes + ray] =
          float(slice.globals[ray][g]) * (1.0f / kActivationTop);
    }
  }
  // Features -1..1 become inputs 0..1.
  const Wide d;
  const Vector half = hn::Set(d, 0.5f);
  for (size_t i = 0; i < size_t(samples) * width * kTrainLanes; i += hn::Lanes(d)) {
    hn::Store(round_activation(d, hn::MulAdd(hn::Load(d, x + i), half, half)), d, x + i);
  }
}

void scatter(const TrainingModel& model, const TrainingSlice& slice, const float* HWY_RESTRICT dx,
             float* HWY_RESTRICT gradients) {
  const hn::CappedTag<float, 2> pair;
  const uint32_t step = uint32_t(hn::Lanes(pair));
  const uint32_t samples = model.samples, width = model.features_per_corner;
  for (uint32_t ray = 0; ray < kTrainLanes; ++ray) {
    for (uint32_t j = 0; j < samples; ++j) {
      const size_t point = size_t(ray) * samples + j;
      const auto& corners = model.cell_corners[slice.cells[point]];
      float weights[8];
      corner_weights(slice.points[point].fraction, weights);
      for (uint32_t f = 0; f < width; f += step) {
        float values[2];
        for (uint32_t k = 0; k < step; ++k)
          values[k] = 0.5f * dx[size_t(j * width + f + k) * kTrainLanes + ray];
        const auto gradient = hn::LoadU(pair, values);
        for (int c = 0; c < 8; ++c) {
          float* to = gradients + size_t(corners[c]) * width + f;
          hn::StoreU(hn::MulAdd(hn::Set(pair, weights[c]), gradient, hn::LoadU(pair, to)), pair, to);
        }
      }
    }
  }
}

/// Loss and its derivative with respect to the last layer's output, for the rays of one chunk.
double loss_of(const TrainingModel& model, const uint8_t* visible, const float* z, float* dz,
               uint8_t* wrong) {
  const Wide d;
  const Vector one = hn::Set(d, 1.0f), zero = hn::Zero(d), gain = hn::Set(d, model.gain);
  HWY_ALIGN float labels[kTrainLanes];
  HWY_ALIGN float losses[kTrainLanes];
  for (uint32_t ray = 0; ray < kTrainLanes; ++ray) {
    labels[ray] = visible[ray] ? 1.0f : 0.0f;
    wrong[ray] = (z[ray] >= 0) != (visible[ray] != 0);
  }
  for (size_t s = 0; s < kTrainLanes; s += hn::Lanes(d)) {
    const Vector logit = hn::Mul(gain, hn::Load(d, z + s)), label = hn::Load(d, labels + s);
    const Vector e = hn::Exp(d, hn::Neg(hn::Abs(logit)));
    const Vector inverse = hn::Div(one, hn::Add(one, e));
    const Vector probability = hn::IfThenElse(hn::Ge(logit, zero), inverse, hn::Mul(e, inverse));
    hn::Store(hn::Mul(gain, hn::Sub(probability, label)), d, dz + s);
    const Vector loss = hn::Add(hn::Sub(hn::Max(logit, zero), hn::Mul(logit, label)), hn::Log1p(d, e));
    hn::Store(loss, d, losses + s);
  }
  double sum = 0;
  for (float loss : losses) sum += loss;
  return sum;
}

void TrainSlice(const TrainingModel& model, const TrainingSlice& slice, uint32_t count, float* scratch,
                GroupGradients& gradients) {
  const Wide d;
  const NetworkShape& shape = model.shape;
  // Activations of every layer are kept for the backward pass; z of the current layer, dz and dx are reused.
  float* inputs[kernels::kMaxLayers];
  float* sums[kernels::kMaxLayers];
  float* next = scratch;
  auto take = [&](uint32_t rows) {
    float* rows_at = next;
    next += size_t(rows) * kTrainLanes;
    return rows_at;
  };
  for (uint32_t l = 0; l < shape.layer_count; ++l) {
    inputs[l] = take(shape.layers[l].inputs);
    sums[l] = take(shape.layers[l].outputs);
  }
  float* delta = take(shape.widest);
  float* below = take(shape.widest);

  const Vector zero = hn::Zero(d), one = hn::Set(d, 1.0f), leak = hn::Set(d, kLeak);
  for (uint32_t first = 0; first < count; first += kTrainLanes) {
    const TrainingSlice chunk{slice.cells + size_t(first) * model.samples,
                              slice.points + size_t(first) * model.samples, slice.globals + first,
                              slice.visible + first};
    gather(model, chunk, inputs[0]);
    for (uint32_t l = 0; l < shape.layer_count; ++l) {
      const NetworkShape::Layer& layer = shape.layers[l];
      multiply(model.weights + layer.weights, layer.inputs, 1, layer.inputs, layer.outputs,
               model.biases + layer.biases, inputs[l], sums[l]);
      if (l + 1 == shape.layer_count) break;
      for (size_t i = 0; i < size_t(layer.outputs) * kTrainLanes; i += hn::Lanes(d)) {
        const Vector clamped = hn::Min(hn::Max(hn::Load(d, sums[l] + i), zero), one);
        hn::Store(round_activation(d, clamped), d, inputs[l + 1] + i);
      }
    }
    gradients.loss +=
        loss_of(model, chunk.visible, sums[shape.layer_count - 1], delta, gradients.wrong + first);

    for (uint32_t l = shape.layer_count; l-- > 0;) {
      const NetworkShape::Layer& layer = shape.layers[l];
      accumulate(delta, inputs[l], layer.inputs, layer.outputs,
                 gradients.weights + size_t(layer.weights) * kVirtualLanes,
                 gradients.biases + size_t(layer.biases) * kVirtualLanes);
      const uint32_t wanted = l == 0 ? model.samples * model.features_per_corner : layer.inputs;
      multiply(model.weights + layer.weights, 1, layer.inputs, layer.outputs, wanted, nullptr, delta, below);
      if (l == 0) break;
      for (size_t i = 0; i < size_t(wanted) * kTrainLanes; i += hn::Lanes(d)) {
        const Vector z = hn::Load(d, sums[l - 1] + i), dy = hn::Load(d, below + i);
        const auto active = hn::And(hn::Gt(z, zero), hn::Lt(z, one));
        hn::Store(hn::IfThenElse(active, dy, hn::Mul(dy, leak)), d, delta + i);
      }
    }
    scatter(model, chunk, below, gradients.features);
  }
}

bool AdamUpdate(const AdamStep& step, size_t begin, size_t end, std::span<float* const> groups,
                float* HWY_RESTRICT master, float* HWY_RESTRICT first_moment,
                float* HWY_RESTRICT second_moment, float* HWY_RESTRICT quantised) {
  const auto update = [&](auto d, size_t i) HWY_ATTR {
    using V = hn::Vec<decltype(d)>;
    V gradient = hn::LoadU(d, groups[0] + i);
    hn::StoreU(hn::Zero(d), d, groups[0] + i);
    for (size_t g = 1; g < groups.size(); ++g) {
      gradient = hn::Add(gradient, hn::LoadU(d, groups[g] + i));
      hn::StoreU(hn::Zero(d), d, groups[g] + i);
    }
    gradient = hn::Mul(gradient, hn::Set(d, step.scale));
    const V m = hn::MulAdd(hn::Set(d, step.beta1), hn::LoadU(d, first_moment + i),
                           hn::Mul(hn::Set(d, 1 - step.beta1), gradient));
    const V v = hn::MulAdd(hn::Set(d, step.beta2), hn::LoadU(d, second_moment + i),
                           hn::Mul(hn::Set(d, 1 - step.beta2), hn::Mul(gradient, gradient)));
    hn::StoreU(m, d, first_moment + i);
    hn::StoreU(v, d, second_moment + i);
    const V root = hn::Add(hn::Sqrt(hn::Mul(v, hn::Set(d, step.correction2))), hn::Set(d, step.epsilon));
    const V change = hn::Div(hn::Mul(m, hn::Set(d, step.correction1 * step.learning_rate)), root);
    const V limit = hn::Set(d, step.limit);
    const V value = hn::Min(hn::Max(hn::Sub(hn::LoadU(d, master + i), change), hn::Neg(limit)), limit);
    hn::StoreU(value, d, master + i);
    hn::StoreU(hn::Mul(hn::Round(hn::Div(value, hn::Set(d, step.quantum))), hn::Set(d, step.quantum)), d,
               quantised + i);
    return hn::Mul(change, hn::Zero(d));  // NaN if the change was not finite
  };
  const Wide wide;
  const hn::FixedTag<float, 1> single;
  Vector poison = hn::Zero(wide);
  auto poison_left = hn::Zero(single);
  size_t i = begin;
  for (; i + hn::Lanes(wide) <= end; i += hn::Lanes(wide)) poison = hn::Add(poison, update(wide, i));
  for (; i < end; ++i) poison_left = hn::Add(poison_left, update(single, i));
  return hn::AllTrue(wide, hn::Eq(poison, poison)) && hn::AllTrue(single, hn::Eq(poison_left, poison_left));
}

const char* Target() { return hwy::TargetName(HWY_TARGET); }

}  // namespace HWY_NAMESPACE
}  // namespace nif::bake
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace nif::bake {

HWY_EXPORT(TrainSlice);
HWY_EXPORT(AdamUpdate);
HWY_EXPORT(Target);

size_t train_scratch_floats(const NetworkShape& shape) {
  size_t rows = 2 * size_t(shape.widest);
  for (uint32_t l = 0; l < shape.layer_count; ++l) rows += shape.layers[l].inputs + shape.layers[l].outputs;
  return rows * kTrainLanes;
}

void train_slice(const TrainingModel& model, const TrainingSlice& slice, uint32_t count, float* scratch,
                 GroupGradients& gradients) {
  HWY_DYNAMIC_DISPATCH(TrainSlice)(model, slice, count, scratch, gradients);
}

bool adam_update(const AdamStep& step, size_t begin, size_t end, std::span<float* const> groups,
                 float* master, float* first_moment, float* second_moment, float* quantised) {
  return HWY_DYNAMIC_DISPATCH(AdamUpdate)(step, begin, end, groups, master, first_moment, second_moment,
                                          quantised);
}

const char* trainer_target() { return HWY_DYNAMIC_DISPATCH(Target)(); }

}  // namespace nif::bake
#endif
