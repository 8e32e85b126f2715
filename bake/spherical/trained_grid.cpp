// Trains a grid. An entry stores its latent vector followed by Adam's two moments. A step gathers the entries
// that the batch touches, updates them in one SIMD call and puts them back.
#include "bake/spherical/trained_grid.hpp"

namespace nif::bake {
namespace {

constexpr uint32_t kNone = 0xffffffffu;

}  // namespace

TrainedGrid::TrainedGrid(GridKind kind, uint32_t resolution, uint32_t features, size_t objects, float reach,
                         Random& random)
    : kind_(kind), resolution_(resolution), features_(features) {
  per_object_ = size_t(resolution) * (kind == GridKind::distance ? 1 : resolution);
  entries_.assign(objects * per_object_ * 3 * features, 0.f);
  for (size_t e = 0; e < objects * per_object_; ++e)
    for (uint32_t f = 0; f < features; ++f)
      entries_[e * 3 * features + f] = static_cast<float>(random.uniform(-double(reach), double(reach)));
  slots_.assign(objects * per_object_, kNone);
  saved_ = entries_;
}

void TrainedGrid::put(StateWriter& state, bool ended) const {
  if (!ended) return state.put_all(entries_);
  Floats latent;
  for (size_t e = 0; e < entries_.size(); e += 3 * features_)
    latent.insert(latent.end(), &entries_[e], &entries_[e] + features_);
  state.put_all(latent);
}

void TrainedGrid::get(StateReader& state, bool ended) {
  if (!ended) {
    state.get_finite(entries_);
    for (size_t e = 0; e < entries_.size(); e += 3 * features_)
      for (uint32_t f = 0; f < features_; ++f)
        state.require(std::abs(entries_[e + f]) <= kernels::kMaxSphericalValue);
    return;
  }
  Floats latent(entries_.size() / 3);
  state.get_within(latent, kernels::kMaxSphericalValue);
  for (size_t i = 0; i < latent.size(); ++i)
    entries_[i / features_ * 3 * features_ + i % features_] = latent[i];
}

LatentLookup TrainedGrid::look_up(const FieldSample& sample) const {
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

bool TrainedGrid::update(const AdamStep& step, std::span<const LatentLookup> lookups,
                         const float* input_gradients, uint32_t inputs, uint32_t offset) {
  touched_.clear();
  gradients_.clear();
  for (size_t s = 0; s < lookups.size(); ++s) {
    const float* from = input_gradients + (s / kTrainLanes * inputs + offset) * kTrainLanes + s % kTrainLanes;
    for (uint32_t c = 0; c < corners(); ++c) {
      uint32_t& slot = slots_[lookups[s].entries[c]];
      if (slot == kNone) {
        slot = uint32_t(touched_.size());
        touched_.push_back(lookups[s].entries[c]);
        gradients_.resize(gradients_.size() + features_, 0.f);
      }
      float* to = gradients_.data() + size_t(slot) * features_;
      for (uint32_t f = 0; f < features_; ++f) to[f] += lookups[s].weights[c] * from[size_t(f) * kTrainLanes];
    }
  }
  const size_t count = gradients_.size();
  for (Floats& part : parts_) part.resize(count);
  // One loop for all three: a latent vector is too short for calls of copying functions to pay off.
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

std::vector<float> TrainedGrid::values(size_t object, bool half) const {
  std::vector<float> values;
  values.reserve(per_object_ * features_);
  for (size_t e = object * per_object_; e < (object + 1) * per_object_; ++e)
    for (uint32_t f = 0; f < features_; ++f) {
      const float value = entries_[e * 3 * features_ + f];
      values.push_back(half ? kernels::from_half(kernels::to_half(value)) : value);
    }
  return values;
}

std::vector<TrainedGrid> grids_over_angles(uint32_t resolution, uint32_t features, size_t objects,
                                           float reach, Random& random) {
  std::vector<TrainedGrid> grids;
  for (const GridKind kind : {GridKind::position, GridKind::direction})
    grids.emplace_back(kind, resolution, features, objects, reach, random);
  return grids;
}

}  // namespace nif::bake
