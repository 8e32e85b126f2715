// A thread is a fibre: ucontext starts it, setjmp and longjmp switch, which needs no system call. Fibres
// run until they meet at a barrier, ballot, shuffle or product; the last to come completes it.
#include "tests/gpu/emulator/emulator.hpp"

#include <setjmp.h>
#include <ucontext.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <deque>
#include <exception>
#include <limits>
#include <memory>
#include <numeric>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "kernels/reference/half.hpp"
#include "tests/gpu/emulator/stacks.hpp"

namespace nif::kernels::gpu {
namespace {

constexpr uint32_t kMaxThreads = 1024;
constexpr uint32_t kMostLanes = 64;

/// What a thread waits for: all other threads of its block or wave must arrive at the same.
enum class Meeting {
  none,
  block,
  wave,
  ballot,
  shuffle,
  wmma,
  mfma16,
  mfma32,
  mma,
  wmma_half,
  mfma_half,
  mma_half
};
constexpr const char* kNames[] = {"nothing",
                                  "sync()",
                                  "wave_sync()",
                                  "ballot()",
                                  "shuffle()",
                                  "wmma_16x16x16",
                                  "mfma_16x16x16",
                                  "mfma_16x16x32",
                                  "mma_16x8x32",
                                  "wmma_16x16x16 of halves",
                                  "mfma_16x16x16 of halves",
                                  "mma_16x8x16 of halves"};

// What threads bring to a meeting and take away; it lies on their stacks.
struct Ballot {
  bool value;
  uint64_t all;
};
struct Shuffle {
  uint32_t value, from, result;
};
struct Product {
  const void *a, *b;
  void* c;  ///< int32_t, or float where a and b are halves
};

/// Goes on where `to` stands, until somebody comes back to `from`. swapcontext() would do the same with a
/// system call each time, to keep signal masks that nobody changes.
[[gnu::noinline]] void switch_between(jmp_buf& from, jmp_buf& to) {
  if (_setjmp(from) == 0) _longjmp(to, 1);
}
[[gnu::noinline]] void switch_to_start(jmp_buf& from, const ucontext_t& to) {
  if (_setjmp(from) == 0) setcontext(&to);
}

[[noreturn]] void fail(const std::string& message) { throw EmulationError("emulated kernel: " + message); }

int32_t signed_byte(const void* bytes, uint32_t i) { return static_cast<const int8_t*>(bytes)[i]; }

/// a's rows times b's columns, each of `depth` bytes; where they lie is told by functions of (row or column,
/// byte) that return lane and byte within the lane's part.
struct Place {
  uint32_t lane, at;
};
template <class PlaceA, class PlaceB, class PlaceC>
void multiply(Product* const lanes[], uint32_t rows, uint32_t columns, uint32_t depth, PlaceA in_a,
              PlaceB in_b, PlaceC in_c) {
  int32_t a[16][32], b[16][32];
  for (uint32_t k = 0; k < depth; ++k) {
    for (uint32_t row = 0; row < rows; ++row) {
      const Place place = in_a(row, k);
      a[row][k] = signed_byte(lanes[place.lane]->a, place.at);
    }
    for (uint32_t column = 0; column < columns; ++column) {
      const Place place = in_b(column, k);
      b[column][k] = signed_byte(lanes[place.lane]->b, place.at);
    }
  }
  for (uint32_t row = 0; row < rows; ++row)
    for (uint32_t column = 0; column < columns; ++column) {
      int32_t sum = 0;
      for (uint32_t k = 0; k < depth; ++k) sum += a[row][k] * b[column][k];
      const Place place = in_c(row, column);
      static_cast<int32_t*>(lanes[place.lane]->c)[place.at] += sum;
    }
}

void multiply_wmma(Product* const lanes[]) {
  for (uint32_t l = 0; l < 16; ++l)
    if (std::memcmp(lanes[l]->a, lanes[l + 16]->a, 16) != 0 ||
        std::memcmp(lanes[l]->b, lanes[l + 16]->b, 16) != 0)
      fail("wmma_16x16x16 with lanes l and l + 16 that differ");
  const auto whole = [](uint32_t i, uint32_t k) { return Place{i, k}; };
  multiply(lanes, 16, 16, 16, whole, whole, [](uint32_t row, uint32_t column) {
    return Place{column + 16 * (row % 2), row / 2};
  });
}

/// One lane has kBytes of a row.
template <uint32_t kBytes>
void multiply_mfma(Product* const lanes[]) {
  const auto quarter = [](uint32_t i, uint32_t k) { return Place{i + 16 * (k / kBytes), k % kBytes}; };
  multiply(lanes, 16, 16, 4 * kBytes, quarter, quarter, [](uint32_t row, uint32_t column) {
    return Place{column + 16 * (row / 4), row % 4};
  });
}

void multiply_mma(Product* const lanes[]) {
  multiply(
      lanes, 16, 8, 32,
      [](uint32_t row, uint32_t k) {
        return Place{4 * (row % 8) + k % 16 / 4, 4 * (row / 8 + 2 * (k / 16)) + k % 4};
      },
      [](uint32_t column, uint32_t k) {
        return Place{4 * column + k % 16 / 4, 4 * (k / 16) + k % 4};
      },
      [](uint32_t row, uint32_t column) {
        return Place{4 * (row % 8) + column / 2, 2 * (row / 8) + column % 2};
      });
}

/// How an instruction sums products of halves, which are exact in single precision.
enum class HalfSums {
  forward,   ///< one after the other, each sum rounded to the nearest
  backward,  ///< the same from the last one on, and denormal halves are 0
  cut,       ///< all at once, and what a float has no room for is cut off
};

float element(const void* halves, uint32_t i, HalfSums how) {
  const uint16_t half = static_cast<const uint16_t*>(halves)[i];
  // from_half() is for finite numbers; what was never written need not be one.
  if ((half & kHalfExponent) == kHalfExponent) return std::numeric_limits<float>::quiet_NaN();
  return how == HalfSums::backward && (half & kHalfExponent) == 0 ? 0.0f : from_half(half);
}

float cut_off(double x) {
  const auto nearest = static_cast<float>(x);
  return std::fabs(double(nearest)) > std::fabs(x) ? std::nextafter(nearest, 0.0f) : nearest;
}

float sum_products(const float* a, const float* b, float c, HalfSums how) {
  double exact = c;  // nearly: what is lost here is far below a float's last bit
  for (uint32_t k = 0; k < 16; ++k) {
    const uint32_t at = how == HalfSums::backward ? 15 - k : k;
    if (how == HalfSums::cut)
      exact += double(a[at] * b[at]);
    else
      c = c + a[at] * b[at];
  }
  return how == HalfSums::cut ? cut_off(exact) : c;
}

/// As multiply(), of rows and columns of 16 halves.
template <class PlaceA, class PlaceB, class PlaceC>
void multiply_halves(Product* const lanes[], uint32_t columns, HalfSums how, PlaceA in_a, PlaceB in_b,
                     PlaceC in_c) {
  float a[16][16], b[16][16];
  for (uint32_t k = 0; k < 16; ++k) {
    for (uint32_t row = 0; row < 16; ++row) {
      const Place place = in_a(row, k);
      a[row][k] = element(lanes[place.lane]->a, place.at, how);
    }
    for (uint32_t column = 0; column < columns; ++column) {
      const Place place = in_b(column, k);
      b[column][k] = element(lanes[place.lane]->b, place.at, how);
    }
  }
  for (uint32_t row = 0; row < 16; ++row)
    for (uint32_t column = 0; column < columns; ++column) {
      const Place place = in_c(row, column);
      float& c = static_cast<float*>(lanes[place.lane]->c)[place.at];
      c = sum_products(a[row], b[column], c, how);
    }
}

void multiply_wmma_half(Product* const lanes[]) {
  for (uint32_t l = 0; l < 16; ++l)
    if (std::memcmp(lanes[l]->a, lanes[l + 16]->a, 32) != 0 ||
        std::memcmp(lanes[l]->b, lanes[l + 16]->b, 32) != 0)
      fail("wmma_16x16x16 of halves with lanes l and l + 16 that differ");
  const auto whole = [](uint32_t i, uint32_t k) { return Place{i, k}; };
  multiply_halves(lanes, 16, HalfSums::forward, whole, whole, [](uint32_t row, uint32_t column) {
    return Place{column + 16 * (row % 2), row / 2};
  });
}

void multiply_mfma_half(Product* const lanes[]) {
  const auto quarter = [](uint32_t i, uint32_t k) { return Place{i + 16 * (k / 4), k % 4}; };
  multiply_halves(lanes, 16, HalfSums::backward, quarter, quarter, [](uint32_t row, uint32_t column) {
    return Place{column + 16 * (row / 4), row % 4};
  });
}

void multiply_mma_half(Product* const lanes[]) {
  multiply_halves(
      lanes, 8, HalfSums::cut,
      [](uint32_t row, uint32_t k) {
        return Place{4 * (row % 8) + k % 8 / 2, 2 * (row / 8 + 2 * (k / 8)) + k % 2};
      },
      [](uint32_t column, uint32_t k) {
        return Place{4 * column + k % 8 / 2, 2 * (k / 8) + k % 2};
      },
      [](uint32_t row, uint32_t column) {
        return Place{4 * (row % 8) + column / 2, 2 * (row / 8) + column % 2};
      });
}

}  // namespace

/// One block at a time; its fibres' stacks serve all blocks of a grid.
class EmulatedBlock {
 public:
  EmulatedBlock(const EmulatedGrid& grid, const std::function<void(const EmulatedThread&)>& kernel)
      : grid_(grid),
        kernel_(kernel),
        fibres_(grid.threads),
        waves_((grid.threads + grid.wave - 1) / grid.wave),
        stacks_(grid.threads),
        shared_((grid.shared_bytes + 15) / 16 + 1) {}

  void run(uint32_t number, uint64_t order) {
    std::memset(shared_.data(), 0xa5, shared_.size() * sizeof(shared_[0]));
    // In turns, or each wave as far as it gets before another starts: that exposes a missing barrier.
    std::mt19937_64 random(order);
    const bool by_turns = order == 0 || random() % 2 == 0;
    const std::vector<uint32_t> sequence = sequence_of_threads(order != 0 ? &random : nullptr);
    for (Wave& wave : waves_) wave = {};
    running_ = grid_.threads;
    at_barrier_ = 0;
    ready_.clear();
    for (const uint32_t i : sequence) {
      Fibre& fibre = fibres_[i];
      fibre.thread.owner_ = this;
      fibre.thread.block_number_ = number;
      fibre.thread.index_ = i;
      fibre.thread.wave_size_ = grid_.wave;
      fibre.waits_for = Meeting::none;
      fibre.ended = false;
      fibre.syncs = 0;
      ++waves_[i / grid_.wave].running;
      ready_.push_back(i);
    }
    while (!ready_.empty()) {
      const uint32_t i = by_turns ? ready_.front() : ready_.back();
      if (by_turns)
        ready_.pop_front();
      else
        ready_.pop_back();
      Fibre& fibre = fibres_[i];
      const bool waits = fibre.started;
      if (!waits) prepare(i);
      own_stack_.leave_for(fibre.stack);
      if (waits)
        switch_between(scheduler_, fibre.place);
      else
        switch_to_start(scheduler_, fibre.context);
      own_stack_.arrive(nullptr);
      if (failure_) std::rethrow_exception(failure_);
      meet(i / grid_.wave);
    }
    if (running_ > 0) fail_waiting();
  }

  /// Call it after the last run().
  void end() { stacks_.give_back(); }

  /// Called by a thread: returns once all have arrived.
  void wait(uint32_t index, Meeting meeting, void* part) {
    Fibre& fibre = fibres_[index];
    if (meeting == Meeting::block && is_left_out(++fibre.syncs)) return;
    fibre.waits_for = meeting;
    fibre.part = part;
    if (meeting == Meeting::block)
      ++at_barrier_;
    else
      ++waves_[index / grid_.wave].waiting;
    to_scheduler(fibre);
  }

  const EmulatedGrid& grid() const { return grid_; }
  unsigned char* shared() { return shared_[0].bytes; }

 private:
  struct Fibre {
    ucontext_t context;  ///< where it starts
    jmp_buf place;       ///< where it waits
    Stack stack;
    bool started = false;
    EmulatedThread thread;
    Meeting waits_for;
    void* part;
    bool ended;
    uint32_t syncs;  ///< calls of sync()
  };
  struct Wave {
    uint32_t running = 0, waiting = 0;
  };
  struct alignas(16) Chunk {
    unsigned char bytes[16];
  };

  bool is_left_out(uint32_t call) const {
    return grid_.left_out == (call % 2 == 1 ? LeftOut::odd_syncs : LeftOut::even_syncs);
  }

  /// Wave by wave; waves, and the lanes of each, are shuffled.
  std::vector<uint32_t> sequence_of_threads(std::mt19937_64* random) const {
    std::vector<uint32_t> waves(waves_.size()), lanes(grid_.wave), sequence;
    std::iota(waves.begin(), waves.end(), 0u);
    std::iota(lanes.begin(), lanes.end(), 0u);
    if (random) std::shuffle(waves.begin(), waves.end(), *random);
    for (const uint32_t wave : waves) {
      if (random) std::shuffle(lanes.begin(), lanes.end(), *random);
      for (const uint32_t lane : lanes)
        if (wave * grid_.wave + lane < grid_.threads) sequence.push_back(wave * grid_.wave + lane);
    }
    return sequence;
  }

  /// Gives a fibre its stack and start. Apart from other code, because compilers take getcontext() for a
  /// function that returns twice.
  void prepare(uint32_t index) {
    fibres_[index].started = true;
    ucontext_t& context = fibres_[index].context;
    getcontext(&context);
    context.uc_stack.ss_sp = stacks_[index];
    context.uc_stack.ss_size = kStackBytes;
    fibres_[index].stack.bottom = context.uc_stack.ss_sp;
    fibres_[index].stack.bytes = kStackBytes;
    context.uc_link = nullptr;
    const auto self = reinterpret_cast<uintptr_t>(this);
    makecontext(&context, reinterpret_cast<void (*)()>(&EmulatedBlock::start), 3, unsigned(self >> 32),
                unsigned(self), index);
  }

  static void start(unsigned high, unsigned low, unsigned index) {
    auto* self = reinterpret_cast<EmulatedBlock*>(uintptr_t(high) << 32 | low);
    Fibre& fibre = self->fibres_[index];
    fibre.stack.arrive(&self->own_stack_);
    // Once for each block: a fibre starts only once.
    for (;;) {
      try {
        self->kernel_(fibre.thread);
      } catch (...) {
        self->failure_ = std::current_exception();
      }
      fibre.ended = true;
      --self->running_;
      --self->waves_[index / self->grid_.wave].running;
      self->to_scheduler(fibre);
    }
  }

  void to_scheduler(Fibre& fibre) {
    fibre.stack.leave_for(own_stack_);
    switch_between(fibre.place, scheduler_);
    fibre.stack.arrive(&own_stack_);
  }

  /// Lets those go on whose meeting is complete: of a wave, or of the block.
  void meet(uint32_t number) {
    Wave& wave = waves_[number];
    const uint32_t first = number * grid_.wave, end = std::min(first + grid_.wave, grid_.threads);
    if (wave.running > 0 && wave.waiting == wave.running) {
      Meeting meeting = Meeting::none;
      for (uint32_t i = first; i < end; ++i) {
        if (fibres_[i].ended) continue;
        if (meeting == Meeting::none) meeting = fibres_[i].waits_for;
        if (fibres_[i].waits_for != meeting)
          fail(std::string("lanes of a wave are at ") + kNames[int(meeting)] + " and at " +
               kNames[int(fibres_[i].waits_for)]);
      }
      complete(meeting, first, end);
      wave.waiting = 0;
      release(first, end);
    }
    if (running_ > 0 && at_barrier_ == running_) {
      if (running_ != grid_.threads) fail("threads have ended while others wait at sync()");
      at_barrier_ = 0;
      release(0, grid_.threads);
    }
  }

  void release(uint32_t first, uint32_t end) {
    for (uint32_t i = first; i < end; ++i) {
      if (fibres_[i].ended) continue;
      fibres_[i].waits_for = Meeting::none;
      ready_.push_back(i);
    }
  }

  void complete(Meeting meeting, uint32_t first, uint32_t end) {
    switch (meeting) {
      case Meeting::none:
      case Meeting::block:
      case Meeting::wave:
        return;
      case Meeting::ballot: {
        uint64_t all = 0;
        for (uint32_t i = first; i < end; ++i)
          if (!fibres_[i].ended && static_cast<Ballot*>(fibres_[i].part)->value)
            all |= uint64_t{1} << (i - first);
        for (uint32_t i = first; i < end; ++i)
          if (!fibres_[i].ended) static_cast<Ballot*>(fibres_[i].part)->all = all;
        return;
      }
      case Meeting::shuffle:
        for (uint32_t i = first; i < end; ++i) {
          if (fibres_[i].ended) continue;
          auto* part = static_cast<Shuffle*>(fibres_[i].part);
          if (part->from >= end - first || fibres_[first + part->from].ended)
            fail("shuffle() from a lane that is not there");
          part->result = static_cast<Shuffle*>(fibres_[first + part->from].part)->value;
        }
        return;
      default:
        complete_product(meeting, first, end);
    }
  }

  void complete_product(Meeting meeting, uint32_t first, uint32_t end) {
    const bool of_64 =
        meeting == Meeting::mfma16 || meeting == Meeting::mfma32 || meeting == Meeting::mfma_half;
    const uint32_t lanes = of_64 ? 64 : 32;
    if (grid_.wave != lanes) fail(std::string(kNames[int(meeting)]) + " in a wave of another size");
    if (waves_[first / grid_.wave].running != lanes)
      fail(std::string(kNames[int(meeting)]) + " without all lanes");
    Product* parts[kMostLanes];
    for (uint32_t i = first; i < end; ++i) parts[i - first] = static_cast<Product*>(fibres_[i].part);
    switch (meeting) {
      case Meeting::wmma:
        return multiply_wmma(parts);
      case Meeting::mfma16:
        return multiply_mfma<4>(parts);
      case Meeting::mfma32:
        return multiply_mfma<8>(parts);
      case Meeting::wmma_half:
        return multiply_wmma_half(parts);
      case Meeting::mfma_half:
        return multiply_mfma_half(parts);
      case Meeting::mma_half:
        return multiply_mma_half(parts);
      default:
        return multiply_mma(parts);
    }
  }

  [[noreturn]] void fail_waiting() const {
    for (const Fibre& fibre : fibres_)
      if (!fibre.ended && fibre.waits_for != Meeting::none && fibre.waits_for != Meeting::block)
        fail("a wave's lanes wait at " + std::string(kNames[int(fibre.waits_for)]) + " for others at sync()");
    fail("threads have ended while others wait at sync()");
  }

  const EmulatedGrid& grid_;
  const std::function<void(const EmulatedThread&)>& kernel_;
  std::vector<Fibre> fibres_;
  std::vector<Wave> waves_;
  Stacks stacks_;
  std::vector<Chunk> shared_;
  std::deque<uint32_t> ready_;
  jmp_buf scheduler_;
  Stack own_stack_;  ///< of the scheduler: where run() was called
  std::exception_ptr failure_;
  uint32_t running_ = 0, at_barrier_ = 0;
};

uint32_t EmulatedThread::blocks() const { return owner_->grid().blocks; }
uint32_t EmulatedThread::threads() const { return owner_->grid().threads; }
unsigned char* EmulatedThread::shared() const { return owner_->shared(); }
void EmulatedThread::sync() const { owner_->wait(index_, Meeting::block, nullptr); }
void EmulatedThread::wave_sync() const { owner_->wait(index_, Meeting::wave, nullptr); }

uint64_t EmulatedThread::ballot(bool value) const {
  Ballot part{value, 0};
  owner_->wait(index_, Meeting::ballot, &part);
  return part.all;
}

uint32_t EmulatedThread::shuffle(uint32_t value, uint32_t from) const {
  Shuffle part{value, from, 0};
  owner_->wait(index_, Meeting::shuffle, &part);
  return part.result;
}

int32_t EmulatedThread::dot4(int32_t sum, uint32_t a, uint32_t b) const {
  for (uint32_t i = 0; i < 4; ++i) sum += signed_byte(&a, i) * signed_byte(&b, i);
  return sum;
}

float EmulatedThread::dot2(float sum, uint32_t a, uint32_t b) const {
  for (uint32_t i = 0; i < 2; ++i)
    sum = sum + element(&a, i, HalfSums::forward) * element(&b, i, HalfSums::forward);
  return sum;
}

void EmulatedThread::wmma_16x16x16(const uint32_t (&a)[4], const uint32_t (&b)[4], int32_t (&c)[8]) const {
  Product part{a, b, c};
  owner_->wait(index_, Meeting::wmma, &part);
}
void EmulatedThread::mfma_16x16x16(uint32_t a, uint32_t b, int32_t (&c)[4]) const {
  Product part{&a, &b, c};
  owner_->wait(index_, Meeting::mfma16, &part);
}
void EmulatedThread::mfma_16x16x32(uint64_t a, uint64_t b, int32_t (&c)[4]) const {
  Product part{&a, &b, c};
  owner_->wait(index_, Meeting::mfma32, &part);
}
void EmulatedThread::mma_16x8x32(const uint32_t (&a)[4], const uint32_t (&b)[2], int32_t (&c)[4]) const {
  Product part{a, b, c};
  owner_->wait(index_, Meeting::mma, &part);
}
void EmulatedThread::wmma_16x16x16(const uint32_t (&a)[8], const uint32_t (&b)[8], float (&c)[8]) const {
  Product part{a, b, c};
  owner_->wait(index_, Meeting::wmma_half, &part);
}
void EmulatedThread::mfma_16x16x16(uint64_t a, uint64_t b, float (&c)[4]) const {
  Product part{&a, &b, c};
  owner_->wait(index_, Meeting::mfma_half, &part);
}
void EmulatedThread::mma_16x8x16(const uint32_t (&a)[4], const uint32_t (&b)[2], float (&c)[4]) const {
  Product part{a, b, c};
  owner_->wait(index_, Meeting::mma_half, &part);
}

void emulate(const EmulatedGrid& grid, const std::function<void(const EmulatedThread&)>& kernel) {
  if (grid.threads == 0 || grid.threads > kMaxThreads || (grid.wave != 32 && grid.wave != 64))
    fail("there are no blocks of " + std::to_string(grid.threads) + " threads in waves of " +
         std::to_string(grid.wave));
  EmulatedBlock block(grid, kernel);
  std::vector<uint32_t> sequence(grid.blocks);
  std::iota(sequence.begin(), sequence.end(), 0u);
  std::mt19937_64 random(grid.order);
  if (grid.order != 0) std::shuffle(sequence.begin(), sequence.end(), random);
  for (const uint32_t number : sequence) block.run(number, grid.order != 0 ? random() | 1 : 0);
  block.end();
}

}  // namespace nif::kernels::gpu
