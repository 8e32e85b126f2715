// A driver for emulated GPUs: the kernels run in the emulator, and the GPUs' memory is host memory.
// Together with the GPU module's own sources this makes libnif_gpu_emulated.so.
#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <map>
#include <mutex>

#include "driver.hpp"
#include "tests/gpu/emulator/kernels.hpp"
#include "tests/gpu/emulator/machine.hpp"

namespace nif::gpu {
namespace {

using test::EmulatedKernel;
using test::EmulatedMachine;

EmulatedMachine machine;

/// Is this the call that must fail?
bool is_due(std::atomic<uint32_t>& countdown) { return countdown.load() != 0 && countdown.fetch_sub(1) == 1; }

void check_lost() {
  if (machine.lost) throw GpuError(NIF_ERROR_DEVICE_LOST, "GPU: the emulated device is lost");
}

struct Queue {
  explicit Queue(uint32_t of_gpu) : gpu(of_gpu) {}
  uint32_t gpu;
  std::vector<std::function<void()>> work;  ///< ever; empty where it is done
  std::vector<double> clock;                ///< [work]: when it is done, in seconds
  size_t done = 0;
  std::mutex running;  ///< one thread at a time does a queue's work
};
/// An event.
struct Mark {
  std::shared_ptr<Queue> queue;  ///< a stream may end before its events
  size_t behind = 0;             ///< work of the queue that it comes after
  std::atomic<uint32_t> asked = 0;
};

/// The driver's state, for all GPUs.
class Ledger {
 public:
  void* allocate(uint32_t gpu, uint64_t bytes, bool managed) {
    const std::lock_guard lock(mutex_);
    check_lost();
    if (is_due(machine.fail_allocation))
      throw GpuError(NIF_ERROR_OUT_OF_DEVICE_MEMORY, "GPU: the emulated device has no memory left");
    void* memory = std::aligned_alloc(256, (bytes + 511) / 256 * 256);
    std::memset(memory, 0xa5, bytes);
    memory_[static_cast<char*>(memory)] = {bytes, gpu, managed};
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
  PointerKind kind_of(uint32_t gpu, const void* pointer) {
    const std::lock_guard lock(mutex_);
    const auto* address = static_cast<const char*>(pointer);
    auto at = memory_.upper_bound(const_cast<char*>(address));
    if (at == memory_.begin()) return PointerKind::host;
    --at;
    if (address >= at->first + at->second.bytes) return PointerKind::host;
    if (at->second.managed) return PointerKind::both;
    return at->second.gpu == gpu ? PointerKind::device : PointerKind::other_device;
  }

  Queue* make_queue(uint32_t gpu) {
    const std::lock_guard lock(mutex_);
    ++machine.streams;
    queues_.push_back(std::make_shared<Queue>(gpu));
    return queues_.back().get();
  }
  std::shared_ptr<Queue> share(const Queue& queue) {
    const std::lock_guard lock(mutex_);
    return *std::find_if(queues_.begin(), queues_.end(),
                         [&](const auto& known) { return known.get() == &queue; });
  }
  bool has_queue(uint32_t gpu, const void* stream) {
    const std::lock_guard lock(mutex_);
    return std::any_of(queues_.begin(), queues_.end(),
                       [&](const auto& queue) { return queue.get() == stream && queue->gpu == gpu; });
  }
  void free_queue(Queue* queue) {
    if (!machine.lost) drain(*queue, ~size_t{0});
    const std::lock_guard lock(mutex_);
    --machine.streams;
    std::erase_if(queues_, [&](const auto& known) { return known.get() == queue; });
  }
  void put(Queue& queue, std::function<void()> work, double seconds = 0) {
    check_lost();
    const std::lock_guard lock(mutex_);
    queue.work.push_back(std::move(work));
    queue.clock.push_back((queue.clock.empty() ? 0 : queue.clock.back()) + 1e-6 + seconds);
  }
  /// Does the work of a queue up to a number.
  void drain(Queue& queue, size_t end) {
    const std::lock_guard running(queue.running);
    for (;;) {
      std::function<void()> work;
      {
        const std::lock_guard lock(mutex_);
        if (queue.done >= std::min(end, queue.work.size())) return;
        work = std::move(queue.work[queue.done]);
      }
      work();
      const std::lock_guard lock(mutex_);
      ++queue.done;  // not before: others may ask meanwhile
    }
  }
  bool is_done(const Mark& mark) {
    const std::lock_guard lock(mutex_);
    return !mark.queue || mark.queue->done >= mark.behind;
  }
  double time_of(const Mark& mark) {
    const std::lock_guard lock(mutex_);
    return mark.behind > 0 ? mark.queue->clock[mark.behind - 1] : 0;
  }
  size_t length(const Queue& queue) {
    const std::lock_guard lock(mutex_);
    return queue.work.size();
  }

 private:
  struct Piece {
    uint64_t bytes;
    uint32_t gpu;
    bool managed;
  };
  std::mutex mutex_;
  std::map<char*, Piece> memory_;
  std::vector<std::shared_ptr<Queue>> queues_;
};

Ledger& ledger() {
  static Ledger ledger;
  return ledger;
}

test::MatrixKind kind_of_gpu(uint32_t gpu) { return test::kMatrixKinds[gpu % std::size(test::kMatrixKinds)]; }

class EmulatedContext final : public Context {
 public:
  explicit EmulatedContext(uint32_t gpu)
      : gpu_(gpu), default_stream_(ledger().make_queue(gpu)), kind_(kind_of_gpu(gpu)) {}
  ~EmulatedContext() override { ledger().free_queue(default_stream_); }

  void enter() override {
    if (entered_) std::abort();
    entered_ = this;
  }
  void leave() noexcept override { entered_ = nullptr; }

  Kernel find_kernel(const char* name) override {
    check_entered();
    if (const EmulatedKernel* kernel = test::find_emulated_kernel(name, kind_))
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
    const auto& emulated = *static_cast<const EmulatedKernel*>(kernel);
    // What any kernel for scenes is given begins alike.
    const bool one_kernel = emulated.name.starts_with("nif_scene_hits") ||
                            (emulated.name.starts_with("nif_scene_") &&
                             !static_cast<const kernels::gpu::SceneWork*>(arguments[0])->list.rays);
    if (one_kernel)
      machine.rays_launched += static_cast<const kernels::gpu::SceneWork*>(arguments[0])->query.count;
    if (emulated.name.starts_with("nif_pipeline_")) {
      const auto& work = *static_cast<const kernels::gpu::PipelineWork*>(arguments[0]);
      ++machine.pipelined;
      if (emulated.name.starts_with("nif_pipeline_traverse") && !work.before.counts)
        machine.rays_launched += work.query.count;
    }
    if (machine.discard) return;
    const kernels::gpu::EmulatedGrid grid{shape.blocks,         shape.threads, shape.shared_bytes,
                                          test::wave_of(kind_), machine.order, left_out_of(emulated)};
    ledger().put(
        queue_of(stream), [run = emulated.bind(arguments[0]), grid] { kernels::gpu::emulate(grid, run); },
        one_kernel ? machine.seconds_of_one_kernel : 0);
  }
  uint32_t most_rays() const override { return machine.most_rays; }
  uint32_t processors() const override { return machine.processors; }

  void* allocate(size_t bytes) override {
    check_entered();
    return ledger().allocate(gpu_, bytes, false);
  }
  void free(void* memory) noexcept override { ledger().free(memory); }
  void* allocate_host(size_t bytes) override {
    check_lost();
    if (is_due(machine.fail_pinning))
      throw GpuError(NIF_ERROR_OUT_OF_DEVICE_MEMORY, "GPU: the emulated machine cannot pin more memory");
    void* memory = nullptr;
    if (posix_memalign(&memory, 256, bytes) != 0) throw std::bad_alloc();
    ++machine.pinnings;
    ++machine.pinned;
    return memory;
  }
  void free_host(void* memory) noexcept override {
    --machine.pinned;
    std::free(memory);
  }
  void copy_in(void* to, const void* from, size_t bytes, Stream stream) override {
    check_entered();
    if (kind_of(to) != PointerKind::device) std::abort();
    ++machine.uploads;
    ledger().put(queue_of(stream), [=] { std::memcpy(to, from, bytes); });
  }
  void copy_out(void* to, const void* from, size_t bytes, Stream stream) override {
    check_entered();
    if (const PointerKind kind = kind_of(from); kind != PointerKind::device && kind != PointerKind::both)
      std::abort();
    if (is_due(machine.fail_copy_out))
      throw GpuError(NIF_ERROR_UNKNOWN, "GPU: copying from the GPU: refused");
    ledger().put(queue_of(stream), [=] { std::memcpy(to, from, bytes); });
  }

  void clear(void* memory, size_t bytes, Stream stream) override {
    check_entered();
    if (kind_of(memory) != PointerKind::device) std::abort();
    ledger().put(queue_of(stream), [=] { std::memset(memory, 0, bytes); });
  }

  Stream make_stream() override {
    check_lost();
    return ledger().make_queue(gpu_);
  }
  void free_stream(Stream stream) noexcept override { ledger().free_queue(static_cast<Queue*>(stream)); }
  void wait_stream(Stream stream) override {
    check_entered();
    ++machine.waits;
    check_lost();
    ledger().drain(queue_of(stream), ~size_t{0});
  }
  void hold_back(Stream stream, Event event) override {
    check_entered();
    check_lost();
    ++machine.held_back;
    const auto& mark = *static_cast<const Mark*>(event);
    if (!mark.queue || mark.queue.get() == &queue_of(stream)) return;
    ledger().put(queue_of(stream),
                 [queue = mark.queue, behind = mark.behind] { ledger().drain(*queue, behind); });
  }
  bool owns(Stream stream) override { return ledger().has_queue(gpu_, stream); }

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
    if (is_due(machine.fail_record)) throw GpuError(NIF_ERROR_UNKNOWN, "GPU: recording an event: refused");
    auto& mark = *static_cast<Mark*>(event);
    mark.queue = ledger().share(queue_of(stream));
    mark.behind = ledger().length(*mark.queue);
    mark.asked = 0;
  }
  /// Time passes with each call: after some calls the work is done.
  bool is_done(Event event) override {
    check_entered();
    check_lost();
    if (is_due(machine.fail_asking)) throw GpuError(NIF_ERROR_UNKNOWN, "GPU: asking for an event: refused");
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
    return ledger().time_of(end) - ledger().time_of(start);
  }

  PointerKind kind_of(const void* pointer) override { return ledger().kind_of(gpu_, pointer); }

 private:
  void check_entered() const {
    if (entered_ != this) std::abort();
  }
  Queue& queue_of(Stream stream) const { return stream ? *static_cast<Queue*>(stream) : *default_stream_; }
  static void wait_for(const Mark& mark) {
    if (mark.queue) ledger().drain(*mark.queue, mark.behind);
  }

  static kernels::gpu::LeftOut left_out_of(const EmulatedKernel& kernel) {
    using kernels::gpu::LeftOut;
    if (kernel.name != machine.defective) return LeftOut::none;
    return machine.without_odd_syncs ? LeftOut::odd_syncs : LeftOut::even_syncs;
  }

  static thread_local const Context* entered_;
  uint32_t gpu_;
  Queue* default_stream_;
  test::MatrixKind kind_;
};
thread_local const Context* EmulatedContext::entered_ = nullptr;

class EmulatedDriver final : public Driver {
 public:
  const char* backend() const override { return "hip"; }
  uint32_t count() override { return machine.gpus; }
  GpuProperties describe(uint32_t gpu) override {
    GpuProperties about{"emulated GPU " + std::to_string(gpu), name_of(kind_of_gpu(gpu)), "emulated 1.0",
                        uint64_t{1} << 30};
    if (!machine.no_place) about.place = {1, gpu + 2, 3, 1, {0xab, uint8_t(gpu)}, {0xcd, uint8_t(gpu)}};
    return about;
  }
  std::string trouble(uint32_t gpu) override {
    if (!machine.no_image) return "";
    return "the GPU module has no kernels for " + describe(gpu).target;
  }
  std::unique_ptr<Context> open(uint32_t gpu) override {
    check_lost();
    return std::make_unique<EmulatedContext>(gpu);
  }
};

}  // namespace

Drivers find_drivers() {
  Drivers drivers;
  if (machine.no_driver)
    drivers.why_none = "there is no driver in the emulated machine";
  else if (machine.driver_too_old)
    drivers.why_none = "the emulated driver is too old";
  else if (machine.gpus == 0)
    drivers.why_none = "the emulated driver finds no GPU";
  else
    drivers.found.push_back(std::make_unique<EmulatedDriver>());
  return drivers;
}

}  // namespace nif::gpu

extern "C" NIF_API nif::test::EmulatedMachine* nif_emulated_machine(void) {
  using namespace nif::gpu;
  machine.allocate = [](uint32_t gpu, uint64_t bytes) { return ledger().allocate(gpu, bytes, false); };
  machine.allocate_managed = [](uint32_t gpu, uint64_t bytes) { return ledger().allocate(gpu, bytes, true); };
  machine.free = [](void* memory) { ledger().free(memory); };
  machine.make_stream = [](uint32_t gpu) -> void* { return ledger().make_queue(gpu); };
  machine.free_stream = [](void* stream) { ledger().free_queue(static_cast<Queue*>(stream)); };
  machine.wait_stream = [](void* stream) { ledger().drain(*static_cast<Queue*>(stream), ~size_t{0}); };
  machine.launch = [](void* stream, std::function<void()> kernel) {
    ledger().put(*static_cast<Queue*>(stream), std::move(kernel));
  };
  return &machine;
}
