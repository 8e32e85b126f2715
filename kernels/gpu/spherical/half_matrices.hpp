// Evaluates a layer of a network in half precision for all rays of a wave at once, as matrices.hpp does in
// integers: one structure for each kind of matrix instruction, with the layout of its operands over the
// lanes.
//
// All do the same: to the sums of 16 neurons for each of the wave's rays they add the products of 16 inputs.
// Weights are stored row by row as halves, rows 16-byte aligned. Sums are in single precision, with the same
// layout over the lanes as for the matching integer instruction: group g of a lane belongs to ray ray(lane,
// g) and to neurons 4 quad(lane, g) to 4 quad(lane, g) + 3.
//
// A lane's part of the inputs is words in registers: load() takes them from rays' rows of halves, and
// pass_on() makes them from a layer's outputs. These are already in the lane, or in one that it swaps with:
// the order in which an instruction counts inputs is free as long as weights come in the same order, and it
// is chosen for that. So activations never go through memory.
//
// The hardware decides in which order an instruction sums, and how it rounds on the way: kinds differ in the
// last bits.
#pragma once

#include "kernels/gpu/network/matrices.hpp"

namespace nif::kernels::gpu {

inline constexpr uint32_t kHalfTileInputs = 16;

/// [group][neuron of four]
using HalfTileSums = float[kTileGroups][4];
/// A tile's outputs as halves, two to a word: [group][neurons 0 and 1, or 2 and 3, of four]
using HalfTileOutputs = uint32_t[kTileGroups][2];

/// Eight words, 16-byte aligned.
NIF_HOST_DEVICE inline void load_eight(const unsigned char* from, uint32_t (&words)[8]) {
  const AlignedWords<4> low = load_words<4>(from), high = load_words<4>(from + 16);
  for (uint32_t k = 0; k < 4; ++k) words[k] = low.word[k], words[k + 4] = high.word[k];
}

/// Dot products of two halves, one ray per lane: gfx1030, and any other target.
struct DotHalfMatrix : DotMatrix {
  using Inputs = uint32_t[8];  ///< those of the lane's ray

  template <class Thread>
  NIF_HOST_DEVICE static void load(const Thread& thread, const unsigned char* rows, uint32_t stride,
                                   Inputs& inputs) {
    load_eight(rows + thread.lane() * stride, inputs);
  }
  template <class Thread>
  NIF_HOST_DEVICE static void pass_on(const Thread&, const HalfTileOutputs& outputs, Inputs& inputs) {
    for (uint32_t k = 0; k < 8; ++k) inputs[k] = outputs[k / 2][k % 2];
  }
  template <class Thread>
  NIF_HOST_DEVICE static void multiply(const Thread& thread, const unsigned char* weights, uint32_t stride,
                                       const Inputs& inputs, HalfTileSums& sums) {
    NIF_UNROLL
    for (uint32_t n = 0; n < kTileNeurons; ++n) {
      uint32_t row[8];
      load_eight(weights + n * stride, row);
      for (uint32_t k = 0; k < 8; ++k)
        sums[n / 4][n % 4] = thread.dot2(sums[n / 4][n % 4], row[k], inputs[k]);
    }
  }
};

/// v_wmma_f32_16x16x16_f16: gfx11. Lanes l and l + 16 hold the same inputs, and half of the outputs each.
struct WmmaHalfMatrix : WmmaMatrix {
  using Inputs = uint32_t[2][8];  ///< of two rays

  template <class Thread>
  NIF_HOST_DEVICE static void load(const Thread& thread, const unsigned char* rows, uint32_t stride,
                                   Inputs& inputs) {
    for (uint32_t tile = 0; tile < 2; ++tile)
      load_eight(rows + (16 * tile + thread.lane() % 16) * stride, inputs[tile]);
  }
  template <class Thread>
  NIF_HOST_DEVICE static void pass_on(const Thread& thread, const HalfTileOutputs& outputs, Inputs& inputs) {
    const bool upper = thread.lane() >= 16;
    for (uint32_t tile = 0; tile < 2; ++tile)
      for (uint32_t k = 0; k < 4; ++k) {
        const uint32_t own = outputs[2 * tile + k / 2][k % 2], other = thread.swap_16(own);
        inputs[tile][k] = upper ? other : own;
        inputs[tile][k + 4] = upper ? own : other;
      }
  }
  template <class Thread>
  NIF_HOST_DEVICE static void multiply(const Thread& thread, const unsigned char* weights, uint32_t stride,
                                       const Inputs& inputs, HalfTileSums& sums) {
    const uint32_t row = thread.lane() % 16, neuron = 8 * (row % 2) + row / 2;
    uint32_t a[8];
    load_eight(weights + neuron * stride, a);
    for (uint32_t tile = 0; tile < 2; ++tile) {
      float c[8];
      for (uint32_t i = 0; i < 8; ++i) c[i] = sums[2 * tile + i / 4][i % 4];
      thread.wmma_16x16x16(a, inputs[tile], c);
      for (uint32_t i = 0; i < 8; ++i) sums[2 * tile + i / 4][i % 4] = c[i];
    }
  }
};

/// v_mfma_f32_16x16x16_f16: gfx90a and gfx942. Sums have the layout of inputs.
struct MfmaHalfMatrix : Mfma32Matrix {
  using Inputs = uint64_t[kTileGroups];  ///< four of each of four rays

  NIF_HOST_DEVICE static uint64_t load_two(const unsigned char* from) {
    const AlignedWords<2> words = load_words<2>(from);
    return words.word[0] | uint64_t(words.word[1]) << 32;
  }

  template <class Thread>
  NIF_HOST_DEVICE static void load(const Thread& thread, const unsigned char* rows, uint32_t stride,
                                   Inputs& inputs) {
    for (uint32_t tile = 0; tile < kTileGroups; ++tile)
      inputs[tile] = load_two(rows + (16 * tile + thread.lane() % 16) * stride + 8 * (thread.lane() / 16));
  }
  template <class Thread>
  NIF_HOST_DEVICE static void pass_on(const Thread&, const HalfTileOutputs& outputs, Inputs& inputs) {
    for (uint32_t tile = 0; tile < kTileGroups; ++tile)
      inputs[tile] = outputs[tile][0] | uint64_t(outputs[tile][1]) << 32;
  }
  template <class Thread>
  NIF_HOST_DEVICE static void multiply(const Thread& thread, const unsigned char* weights, uint32_t stride,
                                       const Inputs& inputs, HalfTileSums& sums) {
    const uint64_t a = load_two(weights + thread.lane() % 16 * stride + 8 * (thread.lane() / 16));
    for (uint32_t tile = 0; tile < kTileGroups; ++tile) thread.mfma_16x16x16(a, inputs[tile], sums[tile]);
  }
};

/// mma.sync m16n8k16: sm_80 and newer. Rays are rows. A lane's four inputs of a ray are consecutive; the
/// instruction counts the first two of them as 2 q and 2 q + 1, the others as 2 q + 8 and 2 q + 9, with q =
/// lane % 4.
struct MmaHalfMatrix : ImmaMatrix {
  using Inputs = uint32_t[2][4];  ///< four of each of two pairs of rays

  template <class Thread>
  NIF_HOST_DEVICE static void load(const Thread& thread, const unsigned char* rows, uint32_t stride,
                                   Inputs& inputs) {
    for (uint32_t g = 0; g < kTileGroups; ++g) {
      const AlignedWords<2> four =
          load_words<2>(rows + ray(thread.lane(), g) * stride + 8 * (thread.lane() % 4));
      for (uint32_t k = 0; k < 2; ++k) inputs[g / 2][g % 2 + 2 * k] = four.word[k];
    }
  }
  template <class Thread>
  NIF_HOST_DEVICE static void pass_on(const Thread&, const HalfTileOutputs& outputs, Inputs& inputs) {
    for (uint32_t g = 0; g < kTileGroups; ++g)
      for (uint32_t k = 0; k < 2; ++k) inputs[g / 2][g % 2 + 2 * k] = outputs[g][k];
  }
  template <class Thread>
  NIF_HOST_DEVICE static void multiply(const Thread& thread, const unsigned char* weights, uint32_t stride,
                                       const Inputs& inputs, HalfTileSums& sums) {
    const uint32_t column = thread.lane() / 4, byte = 8 * (thread.lane() % 4);
    for (uint32_t n = 0; n < 2; ++n) {
      const uint32_t neuron = 4 * (column / 2) + 2 * n + column % 2;
      const AlignedWords<2> b = load_words<2>(weights + neuron * stride + byte);
      for (uint32_t tile = 0; tile < 2; ++tile) {
        float c[4];
        for (uint32_t i = 0; i < 4; ++i) c[i] = sums[2 * tile + i / 2][2 * n + i % 2];
        thread.mma_16x8x16(inputs[tile], b.word, c);
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

}  // namespace nif::kernels::gpu
