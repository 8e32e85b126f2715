// Layers of a network in training, forward and backward, for kTrainLanes rays at a time. The trainers of all
// encodings share them.
//
// Compiled once for each target.
#if defined(NIF_LAYERS_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef NIF_LAYERS_INL
#undef NIF_LAYERS_INL
#else
#define NIF_LAYERS_INL
#endif

#include <hwy/highway.h>

#include "bake/network/network_trainer_kernels.hpp"

HWY_BEFORE_NAMESPACE();
namespace nif::bake {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;
using Wide = hn::CappedTag<float, kVirtualLanes>;
using Vector = hn::Vec<Wide>;

/// y[o][ray] = sum_i weights[o * row + i * column] x[i][ray] (+ biases[o]) for `rows` outputs.
template <uint32_t kRows>
HWY_INLINE void multiply_rows(const float* HWY_RESTRICT weights, uint32_t row, uint32_t column,
                              uint32_t inputs, const float* HWY_RESTRICT biases, const float* HWY_RESTRICT x,
                              float* HWY_RESTRICT y) {
  const Wide d;
  const size_t lanes = hn::Lanes(d);
  for (size_t s = 0; s < kTrainLanes; s += 2 * lanes) {
    Vector sums[kRows][2];
    for (uint32_t o = 0; o < kRows; ++o) {
      sums[o][0] = sums[o][1] = biases ? hn::Set(d, biases[o]) : hn::Zero(d);
    }
    for (uint32_t i = 0; i < inputs; ++i) {
      const Vector x0 = hn::Load(d, x + size_t(i) * kTrainLanes + s);
      const Vector x1 = hn::Load(d, x + size_t(i) * kTrainLanes + s + lanes);
      for (uint32_t o = 0; o < kRows; ++o) {
        const Vector w = hn::Set(d, weights[size_t(o) * row + size_t(i) * column]);
        sums[o][0] = hn::MulAdd(w, x0, sums[o][0]);
        sums[o][1] = hn::MulAdd(w, x1, sums[o][1]);
      }
    }
    for (uint32_t o = 0; o < kRows; ++o) {
      hn::Store(sums[o][0], d, y + size_t(o) * kTrainLanes + s);
      hn::Store(sums[o][1], d, y + size_t(o) * kTrainLanes + s + lanes);
    }
  }
}

HWY_INLINE void multiply(const float* weights, uint32_t row, uint32_t column, uint32_t inputs,
                         uint32_t outputs, const float* biases, const float* x, float* y) {
  uint32_t o = 0;
  for (; o + 4 <= outputs; o += 4) {
    multiply_rows<4>(weights + size_t(o) * row, row, column, inputs, biases ? biases + o : nullptr, x,
                     y + size_t(o) * kTrainLanes);
  }
  for (; o < outputs; ++o) {
    multiply_rows<1>(weights + size_t(o) * row, row, column, inputs, biases ? biases + o : nullptr, x,
                     y + size_t(o) * kTrainLanes);
  }
}

/// weights[o][i][lane] += sum over rays of dz[o][ray] x[i][ray], ray % kVirtualLanes == lane; the same for
/// biases, if not null.
HWY_INLINE void accumulate(const float* HWY_RESTRICT dz, const float* HWY_RESTRICT x, uint32_t inputs,
                           uint32_t outputs, float* HWY_RESTRICT weights, float* HWY_RESTRICT biases) {
  const Wide d;
  const size_t lanes = hn::Lanes(d);
  constexpr size_t kParts = kTrainLanes / kVirtualLanes;
  for (size_t lane = 0; lane < kVirtualLanes; lane += lanes) {
    for (uint32_t o = 0; o < outputs; ++o) {
      Vector dzs[kParts];
      for (size_t p = 0; p < kParts; ++p)
        dzs[p] = hn::Load(d, dz + size_t(o) * kTrainLanes + p * kVirtualLanes + lane);
      if (biases) {
        Vector bias = hn::Load(d, biases + size_t(o) * kVirtualLanes + lane);
        for (size_t p = 0; p < kParts; ++p) bias = hn::Add(bias, dzs[p]);
        hn::Store(bias, d, biases + size_t(o) * kVirtualLanes + lane);
      }
      float* to = weights + size_t(o) * inputs * kVirtualLanes + lane;
      for (uint32_t i = 0; i < inputs; ++i) {
        Vector sum = hn::Load(d, to + size_t(i) * kVirtualLanes);
        for (size_t p = 0; p < kParts; ++p) {
          sum = hn::MulAdd(dzs[p], hn::Load(d, x + size_t(i) * kTrainLanes + p * kVirtualLanes + lane), sum);
        }
        hn::Store(sum, d, to + size_t(i) * kVirtualLanes);
      }
    }
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace nif::bake
HWY_AFTER_NAMESPACE();

#endif
