// Tests the block emulator itself: what threads of a GPU can rely on, and what they cannot.
#include "tests/gpu/emulator/emulator.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <string>
#include <vector>

namespace nif::kernels::gpu {
namespace {

std::string failure_of(const EmulatedGrid& grid, const std::function<void(const EmulatedThread&)>& kernel) {
  try {
    emulate(grid, kernel);
  } catch (const EmulationError& error) {
    return error.what();
  }
  return "";
}

/// Both sizes of waves, in several orders.
class EmulatorTest : public testing::TestWithParam<std::tuple<uint32_t, uint64_t>> {
 protected:
  EmulatedGrid grid(uint32_t threads, uint32_t blocks = 1) const {
    return {.blocks = blocks,
            .threads = threads,
            .shared_bytes = 4096,
            .wave = std::get<0>(GetParam()),
            .order = std::get<1>(GetParam())};
  }
};
INSTANTIATE_TEST_SUITE_P(Each, EmulatorTest,
                         testing::Combine(testing::Values(32u, 64u), testing::Values(0u, 1u, 77u)));

TEST_P(EmulatorTest, EveryThreadOfEveryBlockRunsOnce) {
  std::vector<int> runs(5 * 100);
  emulate(grid(100, 5), [&](const EmulatedThread& thread) {
    EXPECT_EQ(thread.blocks(), 5u);
    EXPECT_EQ(thread.threads(), 100u);
    EXPECT_EQ(thread.index(), thread.wave() * thread.wave_size() + thread.lane());
    ++runs[thread.block() * 100 + thread.index()];
  });
  EXPECT_EQ(runs, std::vector<int>(500, 1));
}

TEST_P(EmulatorTest, SharedMemoryIsOfTheBlockAndBarriersOrderIt) {
  const uint32_t threads = 200;
  std::vector<uint32_t> sums(3 * threads);
  emulate(grid(threads, 3), [&](const EmulatedThread& thread) {
    auto* values = reinterpret_cast<uint32_t*>(thread.shared());
    values[thread.index()] = thread.index() + 1000 * thread.block();
    for (uint32_t round = 0; round < 3; ++round) {
      thread.sync();
      const uint32_t next = values[(thread.index() + 1) % threads];
      thread.sync();
      values[thread.index()] = next;
    }
    sums[thread.block() * threads + thread.index()] = values[thread.index()];
  });
  for (uint32_t i = 0; i < sums.size(); ++i)
    ASSERT_EQ(sums[i], (i % threads + 3) % threads + 1000 * (i / threads));
}

TEST_P(EmulatorTest, BallotsAndShufflesAreOfTheWave) {
  const EmulatedGrid g = grid(150);
  emulate(g, [&](const EmulatedThread& thread) {
    const uint64_t odd = thread.ballot(thread.index() % 2 == 1);
    const uint32_t first = thread.wave() * thread.wave_size(), lanes = std::min(g.wave, 150 - first);
    uint64_t expected = 0;
    for (uint32_t l = 1; l < lanes; l += 2) expected |= uint64_t{1} << l;
    EXPECT_EQ(odd, expected);
    const uint32_t from = (thread.lane() + 5) % lanes;
    EXPECT_EQ(thread.shuffle(100 * thread.index(), from), 100 * (first + from));
  });
}

TEST_P(EmulatorTest, LanesThatHaveEndedAreLeftOut) {
  emulate(grid(128), [&](const EmulatedThread& thread) {
    if (thread.lane() % 4 != 0) return;
    const uint64_t all = thread.ballot(true);
    EXPECT_EQ(all, 0x1111111111111111u & (thread.wave_size() == 64 ? ~uint64_t{0} : 0xffffffffu));
  });
}

TEST_P(EmulatorTest, SumsAreAtomicAndTheirOrderIsNotTold) {
  uint32_t count = 0;
  std::vector<uint32_t> before(6 * 96);
  emulate(grid(96, 6), [&](const EmulatedThread& thread) {
    before[thread.block() * 96 + thread.index()] = thread.add(&count, 1);
  });
  EXPECT_EQ(count, before.size());
  EXPECT_EQ(std::set<uint32_t>(before.begin(), before.end()).size(), before.size());
  EXPECT_EQ(std::is_sorted(before.begin(), before.end()), std::get<1>(GetParam()) == 0);
}

TEST_P(EmulatorTest, WavesRunApartBetweenBarriers) {
  emulate(grid(256), [&](const EmulatedThread& thread) {
    for (uint32_t i = 0; i <= thread.wave(); ++i) thread.wave_sync();
    thread.sync();
  });
}

/// A wave that does not wait for the others reads memory that they have not written yet.
TEST(Emulator, AMissingBarrierShows) {
  uint32_t seen = 0;
  for (uint64_t order = 1; order <= 16; ++order)
    emulate({.threads = 128, .shared_bytes = 4096, .order = order}, [&](const EmulatedThread& thread) {
      thread.shared()[thread.index()] = 1;
      thread.wave_sync();
      if (thread.shared()[(thread.index() + 64) % 128] != 1) ++seen;
    });
  EXPECT_GT(seen, 100u);
}

TEST_P(EmulatorTest, ABarrierThatSomePassByEndingIsAnError) {
  EXPECT_NE(failure_of(grid(128),
                       [](const EmulatedThread& thread) {
                         if (thread.index() == 77) return;
                         thread.sync();
                       })
                .find("ended while others wait at sync()"),
            std::string::npos);
}

TEST_P(EmulatorTest, ABarrierWithinABranchIsAnError) {
  EXPECT_NE(failure_of(grid(128),
                       [](const EmulatedThread& thread) {
                         if (thread.lane() < 3)
                           thread.sync();
                         else
                           thread.wave_sync();
                         thread.sync();
                       })
                .find("for others at sync()"),
            std::string::npos);
}

TEST_P(EmulatorTest, LanesAtDifferentOperationsAreAnError) {
  EXPECT_NE(failure_of(grid(64),
                       [](const EmulatedThread& thread) {
                         if (thread.lane() == 0)
                           thread.ballot(true);
                         else
                           thread.shuffle(1, 0);
                       })
                .find("lanes of a wave are at"),
            std::string::npos);
}

TEST_P(EmulatorTest, AShuffleFromNowhereIsAnError) {
  EXPECT_NE(failure_of(grid(40), [](const EmulatedThread& thread) { thread.shuffle(1, 60); }), "");
  EXPECT_NE(failure_of(grid(64),
                       [](const EmulatedThread& thread) {
                         if (thread.lane() != 3) thread.shuffle(1, 3);
                       }),
            "");
}

TEST_P(EmulatorTest, ProductsNeedAllLanesAndTheirSizeOfWave) {
  const auto wmma = [](const EmulatedThread& thread) {
    if (thread.index() == 63) return;
    int32_t c[8] = {};
    thread.wmma_16x16x16({0, 0, 0, 0}, {0, 0, 0, 0}, c);
  };
  const auto mfma = [](const EmulatedThread& thread) {
    int32_t c[4] = {};
    thread.mfma_16x16x16(0, 0, c);
  };
  EXPECT_NE(failure_of(grid(64), wmma), "");
  EXPECT_EQ(failure_of(grid(64), mfma) == "", std::get<0>(GetParam()) == 64);
  EXPECT_NE(failure_of(grid(60), mfma), "");
}

/// Lanes l and l + 16 hold the same rows and columns: where one lane has another operand, the hardware may
/// take either.
template <class Sum, uint32_t kWords>
void expect_both_halves_alike() {
  const auto failure = [](uint32_t lane, uint32_t word, bool in_b) {
    return failure_of({.threads = 32}, [&](const EmulatedThread& thread) {
      uint32_t operands[2][kWords];
      for (uint32_t i = 0; i < kWords; ++i)
        operands[0][i] = operands[1][i] = 0x01010101 * (thread.lane() % 16 + i);
      if (thread.lane() == lane) operands[in_b][word] ^= 0x100;
      Sum c[8] = {};
      thread.wmma_16x16x16(operands[0], operands[1], c);
    });
  };
  EXPECT_EQ(failure(32, 0, false), "");
  for (const bool in_b : {false, true})
    for (const uint32_t lane : {0u, 7u, 15u, 16u, 31u})
      for (uint32_t word = 0; word < kWords; ++word)
        EXPECT_NE(failure(lane, word, in_b).find("lanes l and l + 16 that differ"), std::string::npos)
            << "lane " << lane << ", word " << word << " of " << (in_b ? "b" : "a");
}
TEST(Emulator, ProductsOfWmmaNeedBothHalvesAlike) { expect_both_halves_alike<int32_t, 4>(); }
TEST(Emulator, ProductsOfWmmaOfHalvesNeedBothHalvesAlike) { expect_both_halves_alike<float, 8>(); }

TEST(Emulator, WhatAKernelThrowsComesOut) {
  EXPECT_THROW(emulate({.threads = 64},
                       [](const EmulatedThread& thread) {
                         thread.sync();
                         if (thread.index() == 9) throw std::out_of_range("nine");
                       }),
               std::out_of_range);
}

TEST(Emulator, RefusesInvalidBlocks) {
  const auto nothing = [](const EmulatedThread&) {};
  EXPECT_NE(failure_of({.threads = 0}, nothing), "");
  EXPECT_NE(failure_of({.threads = 1025}, nothing), "");
  EXPECT_NE(failure_of({.threads = 64, .wave = 16}, nothing), "");
  EXPECT_EQ(failure_of({.blocks = 0}, nothing), "");
}

}  // namespace
}  // namespace nif::kernels::gpu
