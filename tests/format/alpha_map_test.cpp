// Alpha maps are decoded as what was encoded, whatever their size; and damage of their code is found, or gives a map that
// stays within its borders.
#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "formats/nif/holes/coded_alpha_map.hpp"
#include "tests/support/test_random.hpp"

namespace nif {
namespace {

using kernels::AlphaMap;
using Bytes = std::vector<std::byte>;
using Tiles = std::vector<uint64_t>;

AlphaMap map_of(uint32_t width, uint32_t height) {
  AlphaMap map;
  map.width = width;
  map.height = height;
  return map;
}

size_t tile_count(const AlphaMap& map) { return size_t{(map.width + 7) / 8} * ((map.height + 7) / 8); }

/// Tiles of a map whose texel (x, y) is solid(x, y).
template <class Solid>
Tiles tiles_of(const AlphaMap& map, const Solid& solid) {
  Tiles tiles(tile_count(map));
  for (uint32_t y = 0; y < map.height; ++y)
    for (uint32_t x = 0; x < map.width; ++x)
      if (solid(x, y))
        tiles[size_t{y / 8} * ((map.width + 7) / 8) + x / 8] |= uint64_t{1} << (x % 8 + 8 * (y % 8));
  return tiles;
}

Bytes encoded(const AlphaMap& map, const Tiles& tiles) {
  Tiles known(tiles.size());
  RangeEncoder encoder;
  EXPECT_TRUE(format::AlphaMapCoder(encoder, map, tiles.data(), known.data()).code());
  EXPECT_EQ(known, tiles);
  return encoder.finish();
}

/// Empty if the code is refused.
Tiles decoded(const AlphaMap& map, const Bytes& code) {
  Tiles tiles(tile_count(map));
  RangeDecoder decoder(code);
  if (!format::AlphaMapCoder(decoder, map, nullptr, tiles.data()).code() || !decoder.complete()) return {};
  return tiles;
}

/// Pictures of several kinds.
enum Picture : uint32_t { kClear, kSolid, kNoise, kDisc, kTiles, kSparse, kPictures };

Tiles picture(uint32_t kind, const AlphaMap& map, test::Random& random) {
  const uint64_t salt = random.below(1u << 30);
  const float share = kind == kSparse ? 0.02f : random.unit();
  return tiles_of(map, [&](uint32_t x, uint32_t y) {
    const int dx = 2 * int(x) - int(map.width), dy = 2 * int(y) - int(map.height);
    switch (kind) {
      case kClear:
        return false;
      case kSolid:
        return true;
      case kDisc:
        return dx * dx + dy * dy < int(map.width * map.height) / 2;
      case kTiles:  // each clear, solid or noise
        switch (test::Random(salt + 1000 * (y / 8) + x / 8).below(3)) {
          case 0:
            return false;
          case 1:
            return true;
          default:
            return random.below(2) == 0;
        }
      default:
        return random.unit() < share;
    }
  });
}

TEST(AlphaMap, DecodesWhatWasEncoded) {
  test::Random random(1);
  for (uint32_t width = 1; width <= 70; ++width)
    for (uint32_t height = 1; height <= 70; ++height) {
      const AlphaMap map = map_of(width, height);
      for (uint32_t kind = 0; kind < kPictures; ++kind) {
        const bool all = (width < 10 && height < 10) || (width % 16 < 2 && height % 16 < 2);
        if (!all && (width + height) % kPictures != kind) continue;
        const Tiles tiles = picture(kind, map, random);
        ASSERT_EQ(decoded(map, encoded(map, tiles)), tiles) << width << " x " << height << ", " << kind;
      }
    }
}

TEST(AlphaMap, OneKindOfTileTakesFewBytes) {
  for (const bool solid : {false, true})
    for (const uint32_t side : {1u, 1000u, 1001u}) {
      const AlphaMap map = map_of(side, side);
      const Tiles tiles = tiles_of(map, [&](uint32_t, uint32_t) { return solid; });
      EXPECT_LE(encoded(map, tiles).size(), 32u) << side;
    }
}

/// No texel beyond the borders, and the same again if it is encoded.
void check(const AlphaMap& map, const Tiles& tiles) {
  const Tiles within = tiles_of(map, [&](uint32_t x, uint32_t y) {
    return (tiles[size_t{y / 8} * ((map.width + 7) / 8) + x / 8] >> (x % 8 + 8 * (y % 8)) & 1) != 0;
  });
  ASSERT_EQ(within, tiles);
  ASSERT_EQ(decoded(map, encoded(map, tiles)), tiles);
}

TEST(AlphaMap, DamageIsRefusedOrStaysWithinBorders) {
  test::Random random(2);
  uint32_t refused = 0, read = 0;
  for (uint32_t run = 0; run < 2000; ++run) {
    const AlphaMap map = map_of(1 + random.below(70), 1 + random.below(70));
    Bytes code = encoded(map, picture(random.below(kPictures), map, random));
    switch (random.below(5)) {
      case 0:
        code.resize(random.below(uint32_t(code.size())));
        break;
      case 1:
        code.resize(code.size() + 1 + random.below(8), std::byte(random.below(256)));
        break;
      case 2:
        for (std::byte& byte : code) byte = std::byte(random.below(256));
        break;
      default:
        code[random.below(uint32_t(code.size()))] ^= std::byte(1u << random.below(8));
    }
    // Memory of its own, so that sanitizers see what is read beyond it.
    const Tiles tiles = decoded(map, Bytes(code.begin(), code.end()));
    ++(tiles.empty() ? refused : read);
    if (tiles.empty()) continue;
    ASSERT_NO_FATAL_FAILURE(check(map, tiles)) << run;
  }
  EXPECT_GT(refused, 500u);
  EXPECT_GT(read, 50u);
}

/// Counts the bits that are decoded.
class CountingDecoder : public RangeDecoder {
 public:
  using RangeDecoder::RangeDecoder;
  bool bit(BitModel& model, bool value) {
    ++bits;
    return RangeDecoder::bit(model, value);
  }
  uint64_t bits = 0;
};

/// A few bytes that say nothing of a large map do not take the time of the whole map.
TEST(AlphaMap, DamageOfLargeMapsIsFoundSoon) {
  test::Random random(4);
  const AlphaMap map = map_of(4096, 4096);
  Tiles tiles(tile_count(map));
  for (uint32_t run = 0; run < 50; ++run) {
    Bytes code(random.below(100));
    for (std::byte& byte : code) byte = std::byte(random.below(256));
    std::fill(tiles.begin(), tiles.end(), 0);
    CountingDecoder decoder(code);
    EXPECT_FALSE(format::AlphaMapCoder(decoder, map, nullptr, tiles.data()).code() && decoder.complete());
    EXPECT_LT(decoder.bits, 200'000u);
  }
}

/// A map of another size than was encoded.
TEST(AlphaMap, OtherSizesAreRefusedOrStayWithinBorders) {
  test::Random random(3);
  for (uint32_t run = 0; run < 500; ++run) {
    const AlphaMap map = map_of(1 + random.below(70), 1 + random.below(70));
    const Bytes code = encoded(map, picture(random.below(kPictures), map, random));
    const AlphaMap other = map_of(1 + random.below(70), 1 + random.below(70));
    const Tiles tiles = decoded(other, code);
    if (tiles.empty()) continue;
    ASSERT_NO_FATAL_FAILURE(check(other, tiles)) << run;
  }
}

}  // namespace
}  // namespace nif
