// The range coder: what is encoded is decoded, in few bytes, also if an encoder ends otherwise than ours.
#include "formats/base/range_coder.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "tests/support/test_random.hpp"

namespace nif {
namespace {

using Bytes = std::vector<std::byte>;
using Bits = std::vector<bool>;

Bytes encoded(const Bits& bits, size_t models) {
  std::vector<BitModel> known(models);
  RangeEncoder encoder;
  for (size_t i = 0; i < bits.size(); ++i) encoder.bit(known[i % models], bits[i]);
  return encoder.finish();
}

/// Empty if the bytes are not what an encoder could make of this many bits.
std::optional<Bits> decoded(const Bytes& bytes, size_t count, size_t models) {
  std::vector<BitModel> known(models);
  RangeDecoder decoder(bytes);
  Bits bits;
  for (size_t i = 0; i < count; ++i) bits.push_back(decoder.bit(known[i % models]));
  if (!decoder.complete()) return std::nullopt;
  return bits;
}

Bits random_bits(test::Random& random, size_t count, float share) {
  Bits bits;
  for (size_t i = 0; i < count; ++i) bits.push_back(random.unit() < share);
  return bits;
}

TEST(RangeCoder, DecodesWhatWasEncoded) {
  test::Random random(1);
  for (uint64_t run = 0; run < 400; ++run) {
    const size_t count = random.below(run % 10 == 0 ? 20'000 : 100), models = 1 + random.below(5);
    const float share = run % 4 == 0 ? 0.0f : run % 4 == 1 ? 1.0f : random.unit();
    const Bits bits = random_bits(random, count, share);
    EXPECT_EQ(decoded(encoded(bits, models), count, models), bits) << run;
  }
}

TEST(RangeCoder, TakesLittleMoreThanEntropy) {
  test::Random random(2);
  constexpr size_t kCount = 100'000;
  for (const float share : {0.01f, 0.1f, 0.5f, 0.95f}) {
    const auto p = double(share);
    const double entropy = -double(kCount) * (p * std::log2(p) + (1 - p) * std::log2(1 - p)) / 8;
    const auto bytes = double(encoded(random_bits(random, kCount, share), 1).size());
    EXPECT_GT(bytes, 0.97 * entropy) << share;
    EXPECT_LT(bytes, 1.12 * entropy) << share;
  }
}

/// A carry through many bytes of 255: improbable bits keep the number just below a power of 2.
TEST(RangeCoder, CarriesThroughManyBytes) {
  test::Random random(3);
  size_t long_runs = 0;
  for (int run = 0; run < 20'000; ++run) {
    const Bits bits = random_bits(random, 64, 0.5f);
    const Bytes bytes = encoded(bits, 64);
    for (size_t i = 1; i < bytes.size(); ++i)
      long_runs += bytes[i - 1] == std::byte{0xff} && bytes[i] == std::byte{0xff};
    ASSERT_EQ(decoded(bytes, bits.size(), 64), bits);
  }
  EXPECT_GT(long_runs, 0u);
}

/// The shortest code of the same bits: the last range is at least 2^24, so it holds a number whose last three
/// bytes are 0, and these may be left out.
Bytes shortest(Bytes bytes) {
  const auto rest = bytes.end() - 3;
  if (std::any_of(rest, bytes.end(), [](std::byte b) { return b != std::byte{0}; }))
    for (size_t at = bytes.size() - 4; (bytes[at] = std::byte(uint8_t(bytes[at]) + 1)) == std::byte{0};) --at;
  bytes.erase(rest, bytes.end());
  return bytes;
}

/// A reader does not ask which of the numbers in its range an encoder ends with.
TEST(RangeCoder, DecodesWhatOtherEncodersEndWith) {
  test::Random random(4);
  for (int run = 0; run < 2000; ++run) {
    const size_t count = 1 + random.below(80);
    const Bits bits = random_bits(random, count, random.unit());
    const Bytes good = encoded(bits, 2);
    EXPECT_EQ(decoded(shortest(good), count, 2), bits);
    for (size_t more = 1; more <= 3; ++more) {
      Bytes longer = shortest(good);
      longer.resize(longer.size() + more);
      EXPECT_EQ(decoded(longer, count, 2), bits);
    }
    // All bytes are needed; without more than three of them, other bits follow, or none.
    for (const std::byte value : {std::byte{0}, std::byte{1}, std::byte{255}}) {
      Bytes longer = good;
      longer.push_back(value);
      EXPECT_FALSE(decoded(longer, count, 2));
    }
    for (size_t length = 0; length + 4 <= good.size(); ++length)
      EXPECT_NE(decoded(Bytes(good.begin(), good.begin() + ptrdiff_t(length)), count, 2), bits);
  }
}

TEST(RangeCoder, RefusesANumberBeyondItsRange) {
  // An encoder never reaches this state, for any bits.
  for (size_t zeros = 0; zeros < 8; ++zeros) {
    Bytes bytes(4, std::byte{0xff});
    bytes.resize(4 + zeros);
    for (size_t count = 0; count < 64; ++count) EXPECT_FALSE(decoded(bytes, count, 1)) << count;
  }
}

TEST(RangeCoder, CodesNumbers) {
  RangeEncoder encoder;
  struct Models {
    SymbolModel<8> symbol;
    NumberModel<9> number;
    DifferenceModel<6> difference;
  };
  Models models;
  for (uint32_t i = 0; i < 256; ++i) EXPECT_EQ(models.symbol.code(encoder, i), i);
  for (uint32_t i = 0; i <= 510; ++i) EXPECT_EQ(models.number.code(encoder, i), i);
  for (int32_t i = -63; i <= 63; ++i) EXPECT_EQ(models.difference.code(encoder, i), i);
  const Bytes bytes = encoder.finish();
  models = {};
  RangeDecoder decoder(bytes);
  for (uint32_t i = 0; i < 256; ++i) EXPECT_EQ(models.symbol.code(decoder, 0), i);
  for (uint32_t i = 0; i <= 510; ++i) EXPECT_EQ(models.number.code(decoder, 0), i);
  for (int32_t i = -63; i <= 63; ++i) EXPECT_EQ(models.difference.code(decoder, 0), i);
  EXPECT_TRUE(decoder.complete());
}

/// Probabilities never reach a value where a bit cannot be coded.
TEST(RangeCoder, ModelsNeverGetCertain) {
  for (const bool bit : {false, true}) {
    BitModel model;
    for (int i = 0; i < 100'000; ++i) model.learn(bit);
    EXPECT_GT(bit ? 0x10000 - model.probability() : model.probability(), 32u);
    const uint32_t before = model.probability();
    model.learn(!bit);
    EXPECT_EQ(model.probability() > before, !bit);
  }
}

}  // namespace
}  // namespace nif
