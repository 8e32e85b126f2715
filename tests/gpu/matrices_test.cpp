// Every kind of matrix instruction multiplies what it should, and puts it where it says.
#include "kernels/gpu/spherical/half_matrices.hpp"

#include <gtest/gtest.h>

#include <vector>

#include "kernels/reference/half.hpp"
#include "tests/gpu/emulator/emulator.hpp"
#include "tests/support/test_random.hpp"

namespace nif::kernels::gpu {
namespace {

template <class Matrix>
void expect_products(uint32_t wave) {
  constexpr uint32_t kStride = 48;
  test::Random random(wave);
  std::vector<unsigned char> weights(16 * kStride), inputs(wave * kStride);
  for (auto& w : weights) w = static_cast<unsigned char>(random.between(-127, 127));
  for (auto& x : inputs) x = static_cast<unsigned char>(random.between(0, 127));
  std::vector<int32_t> sums(16 * wave, -1), times(16 * wave);
  emulate({.threads = wave, .wave = wave}, [&](const EmulatedThread& thread) {
    TileSums own;
    for (auto& group : own)
      for (int32_t& sum : group) sum = 5;
    Matrix::multiply(thread, weights.data(), inputs.data(), kStride, own);
    for (uint32_t g = 0; g < kTileGroups; ++g)
      for (uint32_t k = 0; k < 4; ++k) {
        const uint32_t at = 16 * Matrix::ray(thread.lane(), g) + 4 * Matrix::quad(thread.lane(), g) + k;
        ASSERT_LT(at, sums.size());
        sums[at] = own[g][k];
        ++times[at];
      }
  });
  for (uint32_t ray = 0; ray < wave; ++ray)
    for (uint32_t neuron = 0; neuron < 16; ++neuron) {
      int32_t expected = 5;
      for (uint32_t k = 0; k < kTileInputs; ++k)
        expected += int8_t(weights[neuron * kStride + k]) * int32_t(inputs[ray * kStride + k]);
      ASSERT_EQ(sums[16 * ray + neuron], expected) << "ray " << ray << ", neuron " << neuron;
      ASSERT_EQ(times[16 * ray + neuron], 1);
    }
}

/// Of halves that are integers, which no order of sums rounds; with inputs that are loaded, and with some
/// that are passed on as outputs.
template <class Matrix>
void expect_half_products(uint32_t wave) {
  constexpr uint32_t kWeightStride = 48, kStride = 80;
  test::Random random(wave);
  std::vector<uint16_t> weights(16 * kWeightStride / 2), inputs(wave * kStride / 2);
  for (auto& w : weights) w = to_half(float(random.between(-127, 127)));
  for (auto& x : inputs) x = to_half(float(random.between(-1000, 1000)));
  for (const bool passed_on : {false, true}) {
    std::vector<float> sums(16 * wave, -1);
    std::vector<int> times(16 * wave);
    emulate({.threads = wave, .wave = wave}, [&](const EmulatedThread& thread) {
      const auto place = [&](uint32_t group) {
        return std::pair(Matrix::ray(thread.lane(), group), 4 * Matrix::quad(thread.lane(), group));
      };
      typename Matrix::Inputs own_inputs;
      if (passed_on) {
        HalfTileOutputs outputs;
        for (uint32_t g = 0; g < kTileGroups; ++g)
          for (uint32_t k = 0; k < 2; ++k)
            outputs[g][k] = load_word(&inputs[place(g).first * kStride / 2 + place(g).second + 2 * k]);
        Matrix::pass_on(thread, outputs, own_inputs);
      } else {
        Matrix::load(thread, reinterpret_cast<const unsigned char*>(inputs.data()), kStride, own_inputs);
      }
      HalfTileSums own;
      for (auto& group : own)
        for (float& sum : group) sum = 5;
      Matrix::multiply(thread, reinterpret_cast<const unsigned char*>(weights.data()), kWeightStride,
                       own_inputs, own);
      for (uint32_t g = 0; g < kTileGroups; ++g)
        for (uint32_t k = 0; k < 4; ++k) {
          const uint32_t at = 16 * place(g).first + place(g).second + k;
          ASSERT_LT(at, sums.size());
          sums[at] = own[g][k];
          ++times[at];
        }
    });
    for (uint32_t ray = 0; ray < wave; ++ray)
      for (uint32_t neuron = 0; neuron < 16; ++neuron) {
        float expected = 5;
        for (uint32_t k = 0; k < kHalfTileInputs; ++k)
          expected +=
              from_half(weights[neuron * kWeightStride / 2 + k]) * from_half(inputs[ray * kStride / 2 + k]);
        ASSERT_EQ(sums[16 * ray + neuron], expected) << "ray " << ray << ", neuron " << neuron;
        ASSERT_EQ(times[16 * ray + neuron], 1);
      }
  }
}

TEST(Matrices, Dot) {
  expect_products<DotMatrix>(32);
  expect_products<DotMatrix>(64);
}
TEST(Matrices, Wmma) { expect_products<WmmaMatrix>(32); }
TEST(Matrices, Mfma16) { expect_products<Mfma16Matrix>(64); }
TEST(Matrices, Mfma32) { expect_products<Mfma32Matrix>(64); }
TEST(Matrices, Imma) { expect_products<ImmaMatrix>(32); }

TEST(Matrices, DotHalf) {
  expect_half_products<DotHalfMatrix>(32);
  expect_half_products<DotHalfMatrix>(64);
}
TEST(Matrices, WmmaHalf) { expect_half_products<WmmaHalfMatrix>(32); }
TEST(Matrices, MfmaHalf) { expect_half_products<MfmaHalfMatrix>(64); }
TEST(Matrices, MmaHalf) { expect_half_products<MmaHalfMatrix>(32); }

}  // namespace
}  // namespace nif::kernels::gpu
