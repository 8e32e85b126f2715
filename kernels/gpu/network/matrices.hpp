// Evaluates a layer of a network for all rays of a wave at once with the target's matrix instructions: one
// structure for each kind of instruction, with the layout of its operands over the lanes.
//
// All do the same: to the sums of 16 neurons for each of the wave's rays they add the products of 32 inputs.
// Weights are stored row by row (a neuron's inputs one after the other), inputs ray by ray, both as bytes,
// rows 16-byte aligned. Each lane gets the sums of 16 (neuron, ray) pairs in four groups: group g belongs to
// ray ray(lane, g) and to neurons 4 quad(lane, g) to 4 quad(lane, g) + 3, so that the outputs of a group are
// one word of the ray's next inputs. Neurons are assigned to the instruction's rows accordingly.
//
// Integer sums do not depend on their order: every kind gives the same bits.
#pragma once

#include "kernels/gpu/shim.hpp"

namespace nif::kernels::gpu {

inline constexpr uint32_t kTileNeurons = 16, kTileInputs = 32, kTileGroups = 4;

/// [group][neuron of four]
using TileSums = int32_t[kTileGroups][4];

/// Dot products of four bytes, one ray per lane: gfx1030, and any other target.
struct DotMatrix {
  static constexpr uint32_t kWave = 0;  ///< any
  NIF_HOST_DEVICE static uint32_t ray(uint32_t lane, uint32_t) { return lane; }
  NIF_HOST_DEVICE static uint32_t quad(uint32_t, uint32_t group) { return group; }

  template <class Thread>
  NIF_HOST_DEVICE static void multiply(const Thread& thread, const unsigned char* weights,
                                       const unsigned char* inputs, uint32_t stride, TileSums& sums) {
    const unsigned char* own = inputs + thread.lane() * stride;
    NIF_NO_UNROLL
    for (uint32_t k = 0; k < kTileInputs; k += 16) {
      uint32_t x[4];
      for (uint32_t i = 0; i < 4; ++i) x[i] = load_word(own + k + 4 * i);
      NIF_UNROLL
      for (uint32_t n = 0; n < kTileNeurons; ++n)
        for (uint32_t i = 0; i < 4; ++i)
          sums[n / 4][n % 4] =
              thread.dot4(sums[n / 4][n % 4], load_word(weights + n * stride + k + 4 * i), x[i]);
    }
  }
};

/// v_wmma_i32_16x16x16_iu8: gfx11. Lanes get every other row, so even rows are the first eight neurons.
struct WmmaMatrix {
  static constexpr uint32_t kWave = 32;
  NIF_HOST_DEVICE static uint32_t ray(uint32_t lane, uint32_t group) { return 16 * (group / 2) + lane % 16; }
  NIF_HOST_DEVICE static uint32_t quad(uint32_t lane, uint32_t group) { return 2 * (lane / 16) + group % 2; }

  template <class Thread>
  NIF_HOST_DEVICE static void multiply(const Thread& thread, const unsigned char* weights,
                                       const unsigned char* inputs, uint32_t stride, TileSums& sums) {
    const uint32_t row = thread.lane() % 16, neuron = 8 * (row % 2) + row / 2;
    for (uint32_t half = 0; half < 2; ++half) {
      uint32_t a[4];
      for (uint32_t k = 0; k < 4; ++k) a[k] = load_word(weights + neuron * stride + 16 * half + 4 * k);
      for (uint32_t tile = 0; tile < 2; ++tile) {
        uint32_t b[4];
        int32_t c[8];
        for (uint32_t k = 0; k < 4; ++k)
          b[k] = load_word(inputs + (16 * tile + row) * stride + 16 * half + 4 * k);
        for (uint32_t i = 0; i < 8; ++i) c[i] = sums[2 * tile + i / 4][i % 4];
        thread.wmma_16x16x16(a, b, c);
        for (uint32_t i = 0; i < 8; ++i) sums[2 * tile + i / 4][i % 4] = c[i];
      }
    }
  }
};

/// v_mfma_i32_16x16x16_i8: gfx90a.
struct Mfma16Matrix {
  static constexpr uint32_t kWave = 64;
  NIF_HOST_DEVICE static uint32_t ray(uint32_t lane, uint32_t group) { return 16 * group + lane % 16; }
  NIF_HOST_DEVICE static uint32_t quad(uint32_t lane, uint32_t) { return lane / 16; }

  template <class Thread>
  NIF_HOST_DEVICE static void multiply(const Thread& thread, const unsigned char* weights,
                                       const unsigned char* inputs, uint32_t stride, TileSums& sums) {
    const uint32_t row = thread.lane() % 16, byte = 4 * (thread.lane() / 16);
    for (uint32_t half = 0; half < 2; ++half) {
      const uint32_t a = load_word(weights + row * stride + 16 * half + byte);
      for (uint32_t tile = 0; tile < kTileGroups; ++tile)
        thread.mfma_16x16x16(a, load_word(inputs + (16 * tile + row) * stride + 16 * half + byte),
                             sums[tile]);
    }
  }
};

/// v_mfma_i32_16x16x32_i8: gfx942.
struct Mfma32Matrix {
  static constexpr uint32_t kWave = 64;
  NIF_HOST_DEVICE static uint32_t ray(uint32_t lane, uint32_t group) { return 16 * group + lane % 16; }
  NIF_HOST_DEVICE static uint32_t quad(uint32_t lane, uint32_t) { return lane / 16; }

  template <class Thread>
  NIF_HOST_DEVICE static void multiply(const Thread& thread, const unsigned char* weights,
                                       const unsigned char* inputs, uint32_t stride, TileSums& sums) {
    const uint32_t row = thread.lane() % 16, byte = 8 * (thread.lane() / 16);
    const uint64_t a = load_two(weights + row * stride + byte);
    for (uint32_t tile = 0; tile < kTileGroups; ++tile)
      thread.mfma_16x16x32(a, load_two(inputs + (16 * tile + row) * stride + byte), sums[tile]);
  }

 private:
  NIF_HOST_DEVICE static uint64_t load_two(const unsigned char* from) {
    return uint64_t(load_word(from)) | uint64_t(load_word(from + 4)) << 32;
  }
};

/// mma.sync m16n8k32: sm_80 and newer. Rays are the instruction's rows, neurons its columns. A lane gets two
/// neighbouring columns of each of two products, which are combined into one group.
struct ImmaMatrix {
  static constexpr uint32_t kWave = 32;
  NIF_HOST_DEVICE static uint32_t ray(uint32_t lane, uint32_t group) { return 8 * group + lane / 4; }
  NIF_HOST_DEVICE static uint32_t quad(uint32_t lane, uint32_t) { return lane % 4; }

  template <class Thread>
  NIF_HOST_DEVICE static void multiply(const Thread& thread, const unsigned char* weights,
                                       const unsigned char* inputs, uint32_t stride, TileSums& sums) {
    const uint32_t row = thread.lane() / 4, byte = 4 * (thread.lane() % 4);
    uint32_t b[2][2];
    for (uint32_t n = 0; n < 2; ++n) {
      const uint32_t neuron = 4 * (row / 2) + 2 * n + row % 2;
      for (uint32_t half = 0; half < 2; ++half)
        b[n][half] = load_word(weights + neuron * stride + 16 * half + byte);
    }
    for (uint32_t tile = 0; tile < 2; ++tile) {
      uint32_t a[4];
      for (uint32_t i = 0; i < 4; ++i)
        a[i] = load_word(inputs + (16 * tile + row + 8 * (i % 2)) * stride + 16 * (i / 2) + byte);
      for (uint32_t n = 0; n < 2; ++n) {
        int32_t c[4];
        for (uint32_t i = 0; i < 4; ++i) c[i] = sums[2 * tile + i / 2][2 * n + i % 2];
        thread.mma_16x8x32(a, b[n], c);
        for (uint32_t i = 0; i < 4; ++i) sums[2 * tile + i / 2][2 * n + i % 2] = c[i];
      }
    }
  }
};

#if defined(__CUDACC__)
using DeviceMatrix = ImmaMatrix;
#elif defined(__gfx1100__)
using DeviceMatrix = WmmaMatrix;
#elif defined(__gfx90a__)
using DeviceMatrix = Mfma16Matrix;
#elif defined(__gfx942__)
using DeviceMatrix = Mfma32Matrix;
#else
using DeviceMatrix = DotMatrix;
#endif

}  // namespace nif::kernels::gpu
