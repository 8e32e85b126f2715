// A driver for cards that are not there: the kernels run in the emulator, memory of a card is the host's.
// Together with the GPU module's own sources this makes libnif_hip_emulated.so.
#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <map>
#include <mutex>

#include "driver.hpp"
#include "tests/gpu/emulated_kernels.hpp"
#include "tests/gpu/emulated_machine.hpp"

namespace nif::gpu {
namespace {

namespace hip = kernels::hip;
using test::EmulatedKernel;
using test::EmulatedMachine;

EmulatedMachine machine;

/// Whether this call is the one that is to fail.
bool is_due(std::atomic<uint32_t>& countdown) { return countdown.load() != 0 && countdown.fetch_sub(1) == 1; }

void check_lost() {
  if (machine.lost) throw GpuError(NIF_ERROR_DEVICE_LOST, "GPU: the emulated card is lost");
}

struct Queue {
  explicit Queue(uint32_t of_card) : card(of_card) {}
  uint32_t card;
  std::vector<std::function<void()>> work;  ///< ever; empty where it is done
  size_t done = 0;
  std::mutex running;  ///< one thread at a time does a queue's work
};
/// An event.
struct Mark {
  std::shared_ptr<Queue> queue;  ///< a stream may end before its events
  size_t behind = 0;             ///< work of the queue that it comes after
  std::atomic<uint32_t> asked = 0;
};

/// All that the driver knows, of all cards.
class Ledger {
 public:
  void* allocate(uint32_t card, uint64_t bytes) {
    const std::lock_guard lock(mutex_);
    check_lost();
    if (is_due(machine.fail_allocation))
      throw GpuError(NIF_ERROR_OUT_OF_DEVICE_MEMORY, "GPU: the emulated card has no memory left");
    void* memory = std::aligned_alloc(256, (bytes + 511) / 256 * 256);
    std::memset(memory, 0xa5, bytes);
    memory_[static_cast<char*>(memory)] = {bytes, card};
    ++machine.allocations;
    machine.allocated += bytes;
    return memory;
  }
  void free(void* memory) {
    const std::lock_guard lock(mutex_);
    const auto at = memory_.find(static_cast<char*>(memory));
    if (at == memory_.end()) std::abort();
    --machine.allocations;
    machine.allocated -= at->second.bytes;
    memory_.erase(at);
    std::free(memory);
  }
  PointerKind kind_of(uint32_t card, const void* pointer) {
    const std::lock_guard lock(mutex_);
    const auto* address = static_cast<const char*>(pointer);
    auto at = memory_.upper_bound(const_cast<char*>(address));
    if (at == memory_.begin()) return PointerKind::host;
    --at;
    if (address >= at->first + at->second.bytes) return PointerKind::host;
    return at->second.card == card ? PointerKind::device : PointerKind::other_device;
  }

  Queue* make_queue(uint32_t card) {
    const std::lock_guard lock(mutex_);
    ++machine.streams;
    queues_.push_back(std::make_shared<Queue>(card));
    return queues_.back().get();
  }
  std::shared_ptr<Queue> share(const Queue& queue) {
    const std::lock_guard lock(mutex_);
    return *std::find_if(queues_.begin(), queues_.end(),
                         [&](const auto& known) { return known.get() == &queue; });
  }
  bool has_queue(uint32_t card, const void* stream) {
    const std::lock_guard lock(mutex_);
    return std::any_of(queues_.begin(), queues_.end(),
                       [&](const auto& queue) { return queue.get() == stream && queue->card == card; });
  }
  void free_queue(Queue* queue) {
    if (!machine.lost) drain(*queue, ~size_t{0});
    const std::lock_guard lock(mutex_);
    --machine.streams;
    std::erase_if(queues_, [&](const auto& known) { return known.get() == queue; });
  }
  void put(Queue& queue, std::function<void()> work) {
    check_lost();
    const std::lock_guard lock(mutex_);
    queue.work.push_back(std::move(work));
  }
  /// Does the work of a queue up to a number.
  void drain(Queue& queue, size_t end) {
    const std::lock_guard running(queue.running);
    for (;;) {
      std::function<void()> work;
      {
        const std::lock_guard lock(mutex_);
        if (queue.done >= std::min(end, queue.work.size())) return;
        work = std::move(queue.work[queue.done++]);
      }
      work();
    }
  }
  bool is_done(const Mark& mark) {
    const std::lock_guard lock(mutex_);
    return !mark.queue || mark.queue->done >= mark.behind;
  }
  size_t length(const Queue& queue) {
    const std::lock_guard lock(mutex_);
    return queue.work.size();
  }

 private:
  struct Piece {
    uint64_t bytes;
    uint32_t card;
  };
  std::mutex mutex_;
  std::map<char*, Piece> memory_;
  std::vector<std::shared_ptr<Queue>> queues_;
};

Ledger& ledger() {
  static Ledger ledger;
  return ledger;
}

class EmulatedContext final : public Context {
 public:
  explicit EmulatedContext(uint32_t card)
      : card_(card), default_stream_(ledger().make_queue(card)), wave_(card % 2 ? 64 : 32) {}
  ~EmulatedContext() override { ledger().free_queue(default_stream_); }

  void enter() override {
    if (entered_) std::abort();
    entered_ = this;
  }
  void leave() noexcept override { entered_ = nullptr; }

  Kernel find_kernel(const char* name) override {
    check_entered();
    if (const EmulatedKernel* kernel = test::find_emulated_kernel(name))
      return const_cast<EmulatedKernel*>(kernel);
    throw GpuError(NIF_ERROR_UNKNOWN, std::string("there is no kernel ") + name);
  }
  void launch(Kernel kernel, const LaunchShape& shape, Stream stream, void** arguments) override {
    check_entered();
    check_lost();
    if (is_due(machine.fail_launch)) {
      machine.lost = true;
      check_lost();
    }
    ++machine.launches;
    const auto scene = *static_cast<const hip::SceneArrays*>(arguments[0]);
    const auto query = *static_cast<const hip::SceneQuery*>(arguments[1]);
    machine.rays_launched += query.count;
    if (machine.discard) return;
    const hip::EmulatedGrid grid{shape.blocks, shape.threads, shape.shared_bytes, wave_, machine.order};
    ledger().put(queue_of(stream), [kernel, scene, query, grid] {
      hip::emulate(grid, [&](const hip::EmulatedThread& thread) {
        static_cast<const EmulatedKernel*>(kernel)->run(thread, scene, query);
      });
    });
  }
  uint32_t most_rays() const override { return machine.most_rays; }

  void* allocate(size_t bytes) override {
    check_entered();
    return ledger().allocate(card_, bytes);
  }
  void free(void* memory) noexcept override { ledger().free(memory); }
  void* allocate_host(size_t bytes) override {
    check_lost();
    return std::aligned_alloc(256, (bytes + 255) / 256 * 256);
  }
  void free_host(void* memory) noexcept override { std::free(memory); }
  void copy_in(void* to, const void* from, size_t bytes, Stream stream) override {
    check_entered();
    if (kind_of(to) != PointerKind::device) std::abort();
    ++machine.uploads;
    ledger().put(queue_of(stream), [=] { std::memcpy(to, from, bytes); });
  }
  void copy_out(void* to, const void* from, size_t bytes, Stream stream) override {
    check_entered();
    if (kind_of(from) != PointerKind::device) std::abort();
    ledger().put(queue_of(stream), [=] { std::memcpy(to, from, bytes); });
  }

  Stream make_stream() override {
    check_lost();
    return ledger().make_queue(card_);
  }
  void free_stream(Stream stream) noexcept override { ledger().free_queue(static_cast<Queue*>(stream)); }
  void wait_stream(Stream stream) override {
    check_entered();
    ++machine.waits;
    check_lost();
    ledger().drain(queue_of(stream), ~size_t{0});
  }
  bool owns(Stream stream) override { return ledger().has_queue(card_, stream); }

  Event make_event(bool) override {
    check_lost();
    ++machine.events;
    return new Mark;
  }
  void free_event(Event event) noexcept override {
    --machine.events;
    delete static_cast<Mark*>(event);
  }
  void record(Event event, Stream stream) override {
    check_entered();
    check_lost();
    auto& mark = *static_cast<Mark*>(event);
    mark.queue = ledger().share(queue_of(stream));
    mark.behind = ledger().length(*mark.queue);
    mark.asked = 0;
  }
  /// Time passes while somebody asks: after some times the work is done.
  bool is_done(Event event) override {
    check_entered();
    check_lost();
    auto& mark = *static_cast<Mark*>(event);
    if (ledger().is_done(mark)) return true;
    if (++mark.asked < 10) return false;
    wait_for(mark);
    return true;
  }
  void wait(Event event) override {
    check_entered();
    ++machine.waits;
    check_lost();
    wait_for(*static_cast<const Mark*>(event));
  }

  double seconds_between(Event from, Event to) override {
    const auto &start = *static_cast<const Mark*>(from), &end = *static_cast<const Mark*>(to);
    if (!ledger().is_done(start) || !ledger().is_done(end)) std::abort();
    return 1e-6 * double(end.behind - start.behind);  // a microsecond for each piece of work
  }

  PointerKind kind_of(const void* pointer) override { return ledger().kind_of(card_, pointer); }

 private:
  void check_entered() const {
    if (entered_ != this) std::abort();
  }
  Queue& queue_of(Stream stream) const { return stream ? *static_cast<Queue*>(stream) : *default_stream_; }
  static void wait_for(const Mark& mark) {
    if (mark.queue) ledger().drain(*mark.queue, mark.behind);
  }

  static thread_local const Context* entered_;
  uint32_t card_;
  Queue* default_stream_;
  uint32_t wave_;
};
thread_local const Context* EmulatedContext::entered_ = nullptr;

class EmulatedDriver final : public Driver {
 public:
  uint32_t count() override { return machine.cards; }
  CardDescription describe(uint32_t card) override {
    return {"emulated card " + std::to_string(card), card % 2 ? "emulated64" : "emulated32", "emulated 1.0",
            uint64_t{1} << 30};
  }
  std::string trouble(uint32_t card) override {
    if (!machine.no_image) return "";
    return "the GPU module has no kernels for " + describe(card).target;
  }
  std::unique_ptr<Context> open(uint32_t card) override {
    check_lost();
    return std::make_unique<EmulatedContext>(card);
  }
};

}  // namespace

Drivers find_drivers() {
  Drivers drivers;
  if (machine.no_driver)
    drivers.why_none = "there is no driver in the emulated machine";
  else if (machine.driver_too_old)
    drivers.why_none = "the emulated driver is too old";
  else if (machine.cards == 0)
    drivers.why_none = "the emulated driver finds no card";
  else
    drivers.found.push_back(std::make_unique<EmulatedDriver>());
  return drivers;
}

}  // namespace nif::gpu

extern "C" NIF_API nif::test::EmulatedMachine* nif_emulated_machine(void) {
  using namespace nif::gpu;
  machine.allocate = [](uint32_t card, uint64_t bytes) { return ledger().allocate(card, bytes); };
  machine.free = [](void* memory) { ledger().free(memory); };
  machine.make_stream = [](uint32_t card) -> void* { return ledger().make_queue(card); };
  machine.free_stream = [](void* stream) { ledger().free_queue(static_cast<Queue*>(stream)); };
  machine.wait_stream = [](void* stream) { ledger().drain(*static_cast<Queue*>(stream), ~size_t{0}); };
  return &machine;
}
