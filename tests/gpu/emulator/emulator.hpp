// Runs GPU kernels on the host, to test them without a GPU: the threads of a block are fibres, which yield to
// each other wherever threads of a GPU would wait for each other.
//
// One block at a time, in one thread of the host. What GPUs leave open (which block, wave and lane comes
// first) follows from a seed, so that tests can ask whether answers depend on it. What is an error on a GPU,
// or only works on some, ends with an EmulationError: a barrier that some threads have passed by ending or
// wait for elsewhere, lanes of a wave that are at different operations, a shuffle from a lane that is not
// there, a matrix product without all lanes.
//
// For x86-64 and other machines with ucontext.h.
#pragma once

#include <cstdint>
#include <functional>
#include <stdexcept>

namespace nif::kernels::gpu {

class EmulationError : public std::logic_error {
 public:
  using std::logic_error::logic_error;
};

/// Barriers that a kernel is run without: of each thread's calls of sync() the first, third and so on, or the
/// second, fourth and so on.
enum class LeftOut : uint32_t { none, odd_syncs, even_syncs };

struct EmulatedGrid {
  uint32_t blocks = 1, threads = 128;  ///< threads of a block: 1 to 1024, no need for whole waves
  uint32_t shared_bytes = 0;           ///< filled with 0xa5 for each block
  uint32_t wave = 32;                  ///< lanes: 32 or 64
  uint64_t order = 0;                  ///< seed of the order of blocks, waves and lanes; 0: as numbered
  LeftOut left_out = LeftOut::none;    ///< a defect, for tests that are to notice it
};

class EmulatedBlock;

/// What kernels/gpu/shim.hpp says of Thread. Only for the kernel that was given it.
class EmulatedThread {
 public:
  uint32_t block() const { return block_number_; }
  uint32_t blocks() const;
  uint32_t index() const { return index_; }
  uint32_t threads() const;
  uint32_t lane() const { return index_ % wave_size(); }
  uint32_t wave() const { return index_ / wave_size(); }
  uint32_t wave_size() const { return wave_size_; }
  unsigned char* shared() const;

  void sync() const;
  void wave_sync() const;
  uint64_t ballot(bool value) const;
  uint32_t shuffle(uint32_t value, uint32_t from) const;
  uint32_t swap_16(uint32_t value) const { return shuffle(value, lane() ^ 16); }
  uint32_t add(uint32_t* to, uint32_t n) const {
    const uint32_t before = *to;
    *to += n;
    return before;
  }
  int32_t dot4(int32_t sum, uint32_t a, uint32_t b) const;
  float dot2(float sum, uint32_t a, uint32_t b) const;

  // As AMD's and NVIDIA's manuals lay matrices out over lanes. With l the lane, byte k of a row or column:
  /// v_wmma_i32_16x16x16_iu8, 32 lanes. a: row l % 16, bytes 0..15; b: column l % 16 likewise; both alike in
  /// lanes l and l + 16. c[r]: row 2 r + l / 16, column l % 16.
  void wmma_16x16x16(const uint32_t (&a)[4], const uint32_t (&b)[4], int32_t (&c)[8]) const;
  /// v_mfma_i32_16x16x16_i8, 64 lanes. a: row l % 16, bytes 4 (l / 16) on; b: column l % 16 likewise.
  /// c[r]: row 4 (l / 16) + r, column l % 16.
  void mfma_16x16x16(uint32_t a, uint32_t b, int32_t (&c)[4]) const;
  /// v_mfma_i32_16x16x32_i8, 64 lanes. The same with bytes 8 (l / 16) on.
  void mfma_16x16x32(uint64_t a, uint64_t b, int32_t (&c)[4]) const;
  /// mma.sync.m16n8k32, 32 lanes. a[i]: row l / 4 + 8 (i % 2), bytes 4 (l % 4) + 16 (i / 2) on; b[i]: column
  /// l / 4, bytes 4 (l % 4) + 16 i on. c[i]: row l / 4 + 8 (i / 2), column 2 (l % 4) + i % 2.
  void mma_16x8x32(const uint32_t (&a)[4], const uint32_t (&b)[2], int32_t (&c)[4]) const;

  // Likewise of halves, k counting those, with sums in single precision. Products are exact; the order of
  // sums and their rounding, which manuals leave open, is another for each instruction.
  /// v_wmma_f32_16x16x16_f16, 32 lanes. As with integers, halves 0..15; each sum is rounded to the nearest.
  void wmma_16x16x16(const uint32_t (&a)[8], const uint32_t (&b)[8], float (&c)[8]) const;
  /// v_mfma_f32_16x16x16_f16, 64 lanes. As with integers, halves 4 (l / 16) on; from the last to the first.
  /// Denormal halves count as 0, as on gfx90a.
  void mfma_16x16x16(uint64_t a, uint64_t b, float (&c)[4]) const;
  /// mma.sync.m16n8k16, 32 lanes. a[i]: row l / 4 + 8 (i % 2), halves 2 (l % 4) + 8 (i / 2) on; b[i]: column
  /// l / 4, halves 2 (l % 4) + 8 i on; c as with integers. Sums are cut off, not rounded.
  void mma_16x8x16(const uint32_t (&a)[4], const uint32_t (&b)[2], float (&c)[4]) const;

 private:
  friend class EmulatedBlock;
  EmulatedBlock* owner_ = nullptr;
  uint32_t block_number_ = 0, index_ = 0, wave_size_ = 32;
};

/// Runs kernel(thread) for every thread of the grid. Throws EmulationError, or whatever the kernel throws;
/// the other threads of its block then end where they are, without destructors.
void emulate(const EmulatedGrid& grid, const std::function<void(const EmulatedThread&)>& kernel);

}  // namespace nif::kernels::gpu
