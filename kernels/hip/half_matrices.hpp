// A layer of a network in half precision for all rays of a wave at once, as matrices.hpp has it in integers:
// a name for each kind of matrix instruction, and how its operands lie over the lanes.
//
// All do the same: to the sums of 16 neurons for each of the wave's rays they add the products of 16 inputs.
// Weights lie row by row, inputs ray by ray, both as halves, rows 16-byte aligned. Sums are in single
// precision and lie over the lanes as those of the integer instruction of the same make: group g of a lane is
// of ray ray(lane, g) and of neurons 4 quad(lane, g) to 4 quad(lane, g) + 3.
//
// In which order an instruction sums, and how it rounds on the way, is the hardware's: kinds differ in last
// bits.
#pragma once

#include "kernels/hip/matrices.hpp"

namespace nif::kernels::hip {

inline constexpr uint32_t kHalfTileInputs = 16;

/// [group][neuron of four]
using HalfTileSums = float[kTileGroups][4];

/// Dot products of two halves, a ray to a lane: gfx1030, and any other.
struct DotHalfMatrix : DotMatrix {
  template <class Thread>
  NIF_HOST_DEVICE static void multiply(const Thread& thread, const unsigned char* weights,
                                       uint32_t weight_stride, const unsigned char* inputs, uint32_t stride,
                                       HalfTileSums& sums) {
    const unsigned char* own = inputs + thread.lane() * stride;
    NIF_NO_UNROLL
    for (uint32_t k = 0; k < kHalfTileInputs; k += 8) {
      uint32_t x[4];
      for (uint32_t i = 0; i < 4; ++i) x[i] = load_word(own + 2 * k + 4 * i);
      NIF_UNROLL
      for (uint32_t n = 0; n < kTileNeurons; ++n)
        for (uint32_t i = 0; i < 4; ++i)
          sums[n / 4][n % 4] =
              thread.dot2(sums[n / 4][n % 4], load_word(weights + n * weight_stride + 2 * k + 4 * i), x[i]);
    }
  }
};

/// v_wmma_f32_16x16x16_f16: gfx11.
struct WmmaHalfMatrix : WmmaMatrix {
  template <class Thread>
  NIF_HOST_DEVICE static void multiply(const Thread& thread, const unsigned char* weights,
                                       uint32_t weight_stride, const unsigned char* inputs, uint32_t stride,
                                       HalfTileSums& sums) {
    const uint32_t row = thread.lane() % 16, neuron = 8 * (row % 2) + row / 2;
    uint32_t a[8];
    for (uint32_t k = 0; k < 8; ++k) a[k] = load_word(weights + neuron * weight_stride + 4 * k);
    for (uint32_t tile = 0; tile < 2; ++tile) {
      uint32_t b[8];
      float c[8];
      for (uint32_t k = 0; k < 8; ++k) b[k] = load_word(inputs + (16 * tile + row) * stride + 4 * k);
      for (uint32_t i = 0; i < 8; ++i) c[i] = sums[2 * tile + i / 4][i % 4];
      thread.wmma_16x16x16(a, b, c);
      for (uint32_t i = 0; i < 8; ++i) sums[2 * tile + i / 4][i % 4] = c[i];
    }
  }
};

/// v_mfma_f32_16x16x16_f16: gfx90a and gfx942.
struct MfmaHalfMatrix : Mfma32Matrix {
  template <class Thread>
  NIF_HOST_DEVICE static void multiply(const Thread& thread, const unsigned char* weights,
                                       uint32_t weight_stride, const unsigned char* inputs, uint32_t stride,
                                       HalfTileSums& sums) {
    const uint32_t row = thread.lane() % 16, byte = 8 * (thread.lane() / 16);
    const uint64_t a = load_two(weights + row * weight_stride + byte);
    for (uint32_t tile = 0; tile < kTileGroups; ++tile)
      thread.mfma_16x16x16(a, load_two(inputs + (16 * tile + row) * stride + byte), sums[tile]);
  }
};

/// mma.sync m16n8k16: sm_80 on.
struct MmaHalfMatrix : ImmaMatrix {
  template <class Thread>
  NIF_HOST_DEVICE static void multiply(const Thread& thread, const unsigned char* weights,
                                       uint32_t weight_stride, const unsigned char* inputs, uint32_t stride,
                                       HalfTileSums& sums) {
    const uint32_t row = thread.lane() / 4, byte = 4 * (thread.lane() % 4);
    uint32_t b[2][2];
    for (uint32_t n = 0; n < 2; ++n) {
      const uint32_t neuron = 4 * (row / 2) + 2 * n + row % 2;
      for (uint32_t half = 0; half < 2; ++half)
        b[n][half] = load_word(weights + neuron * weight_stride + 16 * half + byte);
    }
    for (uint32_t tile = 0; tile < 2; ++tile) {
      uint32_t a[4];
      for (uint32_t i = 0; i < 4; ++i)
        a[i] = load_word(inputs + (16 * tile + row + 8 * (i % 2)) * stride + 16 * (i / 2) + byte);
      for (uint32_t n = 0; n < 2; ++n) {
        float c[4];
        for (uint32_t i = 0; i < 4; ++i) c[i] = sums[2 * tile + i / 2][2 * n + i % 2];
        thread.mma_16x8x16(a, b[n], c);
        for (uint32_t i = 0; i < 4; ++i) sums[2 * tile + i / 2][2 * n + i % 2] = c[i];
      }
    }
  }
};

#if defined(__CUDACC__)
using DeviceHalfMatrix = MmaHalfMatrix;
#elif defined(__gfx1100__)
using DeviceHalfMatrix = WmmaHalfMatrix;
#elif defined(__gfx90a__) || defined(__gfx942__)
using DeviceHalfMatrix = MfmaHalfMatrix;
#else
using DeviceHalfMatrix = DotHalfMatrix;
#endif

}  // namespace nif::kernels::hip
