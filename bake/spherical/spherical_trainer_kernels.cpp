// A network with leaky ReLU and no biases, forward and backward, with Highway for each target. It also
// computes the gradients of its inputs, from which the grids of latent vectors learn.
#include "bake/spherical/spherical_trainer_kernels.hpp"

#include <algorithm>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "bake/spherical/spherical_trainer_kernels.cpp"
#include <hwy/foreach_target.h>  // must come before highway.h

#include <hwy/contrib/math/math-inl.h>
#include <hwy/highway.h>

#include "bake/layers-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace nif::bake {
namespace HWY_NAMESPACE {

/// x[input][ray] of the samples from `first` on.
void gather_latents(const SphericalModel& model, const SphericalSlice& slice, uint32_t first,
                    float* HWY_RESTRICT x) {
  for (uint32_t g = 0; g < model.grid_count; ++g) {
    const LatentGrid& grid = model.grids[g];
    const LatentLookup* lookups = slice.lookups[g] + first;
    const uint32_t features = grid.features;
    for (uint32_t ray = 0; ray < kTrainLanes; ++ray) {
      const LatentLookup& lookup = lookups[ray];
      const float* entries[4];
      for (uint32_t c = 0; c < grid.corners; ++c)
        entries[c] = grid.entries + size_t(lookup.entries[c]) * 3 * features;
      for (uint32_t f = 0; f < features; ++f) {
        float sum = lookup.weights[0] * entries[0][f];
        for (uint32_t c = 1; c < grid.corners; ++c) sum += lookup.weights[c] * entries[c][f];
        x[size_t(f) * kTrainLanes + ray] = sum;
      }
    }
    x += size_t(features) * kTrainLanes;
  }
}

/// Sum of the losses of the first output, and its derivative.
double sum_losses(SphericalLoss loss, const uint8_t* samples, const float* z, float* dz, uint8_t* wrong) {
  const Wide d;
  const Vector zero = hn::Zero(d), one = hn::Set(d, 1.0f), two = hn::Set(d, 2.0f);
  HWY_ALIGN float labels[kTrainLanes];
  HWY_ALIGN float losses[kTrainLanes];
  for (uint32_t ray = 0; ray < kTrainLanes; ++ray) {
    labels[ray] = samples[ray] ? 1.0f : 0.0f;
    wrong[ray] = (z[ray] >= 0) != (samples[ray] != 0);
  }
  for (size_t s = 0; s < kTrainLanes; s += hn::Lanes(d)) {
    const Vector odds = hn::Load(d, z + s);
    const Vector e = hn::Exp(d, hn::Neg(hn::Abs(odds)));
    const Vector larger = hn::Div(one, hn::Add(one, e)), smaller = hn::Mul(e, larger);
    const Vector probability = hn::IfThenElse(hn::Ge(odds, zero), larger, smaller);
    const Vector label = hn::Load(d, labels + s);
    const Vector off = hn::Sub(probability, label);
    if (loss == SphericalLoss::squared) {
      hn::Store(hn::Mul(hn::Mul(two, off), hn::Mul(larger, smaller)), d, dz + s);
      hn::Store(hn::Mul(off, off), d, losses + s);
    } else {
      const Vector against = hn::IfThenElse(hn::Gt(label, zero), hn::Neg(odds), odds);
      hn::Store(off, d, dz + s);
      hn::Store(hn::Add(hn::Max(against, zero), hn::Log1p(d, e)), d, losses + s);
    }
  }
  double sum = 0;
  for (float of_ray : losses) sum += double(of_ray);
  return sum;
}

/// The same for the outputs after the first: weighted squared differences from targets, [output][ray], for
/// samples whose label is 1.
double sum_target_losses(const SphericalModel& model, uint32_t count, const uint8_t* samples,
                         const float* targets, const float* z, float* dz) {
  const Wide d;
  HWY_ALIGN float counts[kTrainLanes];
  HWY_ALIGN float losses[kTrainLanes] = {};
  for (uint32_t ray = 0; ray < kTrainLanes; ++ray) counts[ray] = samples[ray] ? 1.0f : 0.0f;
  for (uint32_t t = 0; t < count; ++t) {
    const Vector weight = hn::Set(d, model.target_weights[t]), two = hn::Set(d, 2.0f);
    for (size_t s = 0; s < kTrainLanes; s += hn::Lanes(d)) {
      const size_t at = size_t(t) * kTrainLanes + s;
      const Vector off =
          hn::Mul(hn::Sub(hn::Load(d, z + at), hn::Load(d, targets + at)), hn::Load(d, counts + s));
      const Vector weighted = hn::Mul(weight, off);
      hn::Store(hn::Mul(two, weighted), d, dz + at);
      hn::Store(hn::MulAdd(weighted, off, hn::Load(d, losses + s)), d, losses + s);
    }
  }
  double sum = 0;
  for (float of_ray : losses) sum += double(of_ray);
  return sum;
}

void TrainSpherical(const SphericalModel& model, uint32_t count, float* scratch, SphericalSlice& slice) {
  const Wide d;
  const NetworkShape& shape = model.shape;
  float* inputs[kernels::kMaxLayers];
  float* sums[kernels::kMaxLayers];
  float* next = scratch;
  const auto take = [&](uint32_t rows) {
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

  slice.loss = 0;
  const Vector zero = hn::Zero(d), slope = hn::Set(d, model.slope);
  const uint32_t targets = shape.layers[shape.layer_count - 1].outputs - 1;
  for (uint32_t first = 0; first < count; first += kTrainLanes) {
    gather_latents(model, slice, first, inputs[0]);
    for (uint32_t l = 0; l < shape.layer_count; ++l) {
      const NetworkShape::Layer& layer = shape.layers[l];
      multiply(model.weights + layer.weights, layer.inputs, 1, layer.inputs, layer.outputs, nullptr,
               inputs[l], sums[l]);
      if (l + 1 == shape.layer_count) break;
      for (size_t i = 0; i < size_t(layer.outputs) * kTrainLanes; i += hn::Lanes(d)) {
        const Vector z = hn::Load(d, sums[l] + i);
        hn::Store(hn::Max(z, hn::Mul(slope, z)), d, inputs[l + 1] + i);
      }
    }
    const float* outputs = sums[shape.layer_count - 1];
    slice.loss += sum_losses(model.loss, slice.labels + first, outputs, delta, slice.wrong + first);
    if (targets > 0)
      slice.loss +=
          sum_target_losses(model, targets, slice.labels + first, slice.targets + size_t(first) * targets,
                            outputs + kTrainLanes, delta + kTrainLanes);

    for (uint32_t l = shape.layer_count; l-- > 0;) {
      const NetworkShape::Layer& layer = shape.layers[l];
      accumulate(delta, inputs[l], layer.inputs, layer.outputs,
                 slice.weight_gradients + size_t(layer.weights) * kVirtualLanes, nullptr);
      float* to = l == 0 ? slice.input_gradients + size_t(first) * layer.inputs : below;
      multiply(model.weights + layer.weights, 1, layer.inputs, layer.outputs, layer.inputs, nullptr, delta,
               to);
      if (l == 0) break;
      for (size_t i = 0; i < size_t(layer.inputs) * kTrainLanes; i += hn::Lanes(d)) {
        const Vector z = hn::Load(d, sums[l - 1] + i), dy = hn::Load(d, below + i);
        hn::Store(hn::IfThenElse(hn::Gt(z, zero), dy, hn::Mul(dy, slope)), d, delta + i);
      }
    }
  }
}

bool AdamSpherical(const AdamStep& step, size_t count, const float* HWY_RESTRICT gradients,
                   float* HWY_RESTRICT values, float* HWY_RESTRICT first_moment,
                   float* HWY_RESTRICT second_moment) {
  const auto update = [&](auto d, size_t i) HWY_ATTR {
    using V = hn::Vec<decltype(d)>;
    const V gradient = hn::Mul(hn::LoadU(d, gradients + i), hn::Set(d, step.scale));
    const V m = hn::MulAdd(hn::Set(d, step.beta1), hn::LoadU(d, first_moment + i),
                           hn::Mul(hn::Set(d, 1 - step.beta1), gradient));
    const V v = hn::MulAdd(hn::Set(d, step.beta2), hn::LoadU(d, second_moment + i),
                           hn::Mul(hn::Set(d, 1 - step.beta2), hn::Mul(gradient, gradient)));
    hn::StoreU(m, d, first_moment + i);
    hn::StoreU(v, d, second_moment + i);
    const V root = hn::Add(hn::Sqrt(hn::Mul(v, hn::Set(d, step.correction2))), hn::Set(d, step.epsilon));
    const V change = hn::Div(hn::Mul(m, hn::Set(d, step.correction1 * step.learning_rate)), root);
    const V limit = hn::Set(d, step.limit);
    hn::StoreU(hn::Min(hn::Max(hn::Sub(hn::LoadU(d, values + i), change), hn::Neg(limit)), limit), d,
               values + i);
    return hn::Mul(change, hn::Zero(d));  // NaN if the change was not finite
  };
  const Wide wide;
  const hn::FixedTag<float, 1> single;
  Vector poison = hn::Zero(wide);
  auto poison_left = hn::Zero(single);
  size_t i = 0;
  for (; i + hn::Lanes(wide) <= count; i += hn::Lanes(wide)) poison = hn::Add(poison, update(wide, i));
  for (; i < count; ++i) poison_left = hn::Add(poison_left, update(single, i));
  return hn::AllTrue(wide, hn::Eq(poison, poison)) && hn::AllTrue(single, hn::Eq(poison_left, poison_left));
}

void SumLanes(std::span<float* const> groups, size_t begin, size_t end, float* HWY_RESTRICT sums) {
  const Wide d;
  const size_t lanes = hn::Lanes(d);
  HWY_ALIGN float parts[kVirtualLanes];
  for (size_t w = begin; w < end; ++w) {
    for (size_t lane = 0; lane < kVirtualLanes; lane += lanes) {
      Vector sum = hn::Zero(d);
      for (float* group : groups) {
        float* at = group + w * kVirtualLanes + lane;
        sum = hn::Add(sum, hn::Load(d, at));
        hn::Store(hn::Zero(d), d, at);
      }
      hn::Store(sum, d, parts + lane);
    }
    for (size_t half = kVirtualLanes / 2; half > 0; half /= 2)
      for (size_t lane = 0; lane < half; ++lane) parts[lane] += parts[lane + half];
    sums[w] = parts[0];
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace nif::bake
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace nif::bake {

HWY_EXPORT(TrainSpherical);
HWY_EXPORT(AdamSpherical);
HWY_EXPORT(SumLanes);

size_t spherical_scratch_floats(const NetworkShape& shape) { return train_scratch_floats(shape); }

void train_spherical(const SphericalModel& model, uint32_t count, float* scratch, SphericalSlice& slice) {
  HWY_DYNAMIC_DISPATCH(TrainSpherical)(model, count, scratch, slice);
}

bool adam_step(const AdamStep& step, size_t count, const float* gradients, float* values, float* first_moment,
               float* second_moment) {
  return HWY_DYNAMIC_DISPATCH(AdamSpherical)(step, count, gradients, values, first_moment, second_moment);
}

void sum_lanes(std::span<float* const> groups, size_t begin, size_t end, float* sums) {
  HWY_DYNAMIC_DISPATCH(SumLanes)(groups, begin, end, sums);
}

}  // namespace nif::bake
#endif
