// Lays out the scratch memory of queries, and lends a block again once the event of its last use is done.
// Also times the first queries both by the pipeline and by the one kernel, then uses the faster way.
#include "pipeline.hpp"

#include <algorithm>
#include <bit>

namespace nif::gpu {
namespace {

/// Divides a block of memory into arrays, one after the other. Without a block, computes how large it must
/// be.
class Carver {
 public:
  explicit Carver(unsigned char* base) : base_(base) {}
  template <class T>
  T* take(size_t count) {
    const size_t at = bytes_;
    bytes_ = (at + count * sizeof(T) + kAlignment - 1) / kAlignment * kAlignment;
    return base_ ? reinterpret_cast<T*>(base_ + at) : nullptr;
  }
  size_t bytes() const { return bytes_; }

 private:
  static constexpr size_t kAlignment = 256;
  unsigned char* base_;
  size_t bytes_ = 0;
};

/// Until there are measurements, queries of fewer rays than this use the one kernel.
constexpr uint64_t kGuessedThreshold = 8192;

/// How many lists a block has room for: a power of two, or more if they take next to nothing compared to the
/// rays. So a growing scene seldom needs larger blocks; its old blocks stay until memory is short.
size_t room_for_lists(uint32_t rays, uint32_t lists) { return std::bit_ceil(std::max(lists, rays >> 14)); }

}  // namespace

const KindKernels& kernels_for(const std::vector<KindKernels>& kernels, uint32_t kinds) {
  return *std::find_if(kernels.begin(), kernels.end(),
                       [&](const KindKernels& known) { return (kinds & ~known.kinds) == 0; });
}

PipelineKernels::PipelineKernels(Context& context)
    : traverse_one(context, kernels::gpu::kSegments, "nif_pipeline_traverse_one") {
  const auto find = [&](const char* name) { return context.find_kernel(name); };
#define NIF_TRAVERSE(name, kinds, blocks) \
  traversals.emplace_back(context, kernels::gpu::kinds, "nif_pipeline_traverse_" #name);
  NIF_TRAVERSAL_KERNELS(NIF_TRAVERSE)
#undef NIF_TRAVERSE
  offsets = find("nif_pipeline_offsets");
  order = find("nif_pipeline_order");
  pack_bits = find("nif_pack_bits");
#define NIF_STAGE(number, name, ...) stages[kernels::gpu::number] = find("nif_pipeline_" #name);
  NIF_PIPELINE_STAGES(NIF_STAGE)
#undef NIF_STAGE
}

#define NIF_STAGE(number, name, threads, blocks, inner, ...) {kernels::gpu::threads, inner},
const StageShape kStageShapes[kernels::gpu::kStages] = {NIF_PIPELINE_STAGES(NIF_STAGE)};
#undef NIF_STAGE

size_t lay_out(uint32_t rays, uint32_t lists, bool several_instances, unsigned char* base,
               PipelineArrays& arrays) {
  Carver carver(base);
  arrays = {};
  const size_t room = room_for_lists(rays, lists);
  const size_t counters = size_t(kPipelineRounds + 1) * (1 + room);
  arrays.counts = carver.take<uint32_t>(counters);
  arrays.counts_bytes = counters * sizeof(uint32_t);
  arrays.visible = carver.take<unsigned char>(rays);
  kernels::gpu::PipelineMemory& memory = arrays.memory;
  memory.capacity = rays;
  memory.about = carver.take<uint32_t>(rays);
  memory.words = carver.take<uint32_t>(size_t(rays) * kernels::gpu::kItemWords);
  arrays.items[0].ray = carver.take<uint32_t>(rays);
  if (!several_instances && lists <= 2) return carver.bytes();  // nothing to sort
  memory.list = carver.take<uint32_t>(rays);
  memory.place = carver.take<uint32_t>(rays);
  memory.order = carver.take<uint32_t>(rays + room * kernels::gpu::kTileItems);
  memory.first_tile = carver.take<uint32_t>(1 + room);
  arrays.items[0].instance = carver.take<uint32_t>(rays);
  if (!several_instances) return carver.bytes();
  arrays.items[1].ray = carver.take<uint32_t>(rays);
  arrays.items[1].instance = carver.take<uint32_t>(rays);
  for (kernels::gpu::PipelineItems& items : arrays.items) {
    items.logit = carver.take<int32_t>(rays);
    items.way = carver.take<kernels::gpu::SceneWay>(rays);
  }
  return carver.bytes();
}

void ScratchPool::clear() {
  for (const PipelineScratch& scratch : idle_) context_.free_event(scratch.last_use);
  idle_.clear();
  blocks_ = 0;
}

bool ScratchPool::free_done() {
  const size_t before = idle_.size();
  for (size_t i = 0; i < idle_.size();) {
    if (!context_.is_done(idle_[i].last_use)) {
      ++i;
      continue;
    }
    context_.free_event(idle_[i].last_use);
    idle_.erase(idle_.begin() + ptrdiff_t(i));
    --blocks_;
  }
  return idle_.size() < before;
}

bool ScratchPool::make(size_t bytes, PipelineScratch& scratch) {
  try {
    idle_.reserve(blocks_ + 1);  // so that give_back() allocates nothing
    PipelineScratch made{Memory(context_, bytes)};
    made.last_use = context_.make_event(false);
    ++blocks_;
    scratch = std::move(made);
    return true;
  } catch (const GpuError& error) {
    if (error.code() != NIF_ERROR_OUT_OF_DEVICE_MEMORY) throw;
    return false;
  }
}

PipelineScratch ScratchPool::borrow(size_t bytes, Stream stream) {
  const std::lock_guard lock(mutex_);
  const auto take = [&](auto wanted) {
    PipelineScratch taken;
    const auto at = std::find_if(idle_.begin(), idle_.end(), wanted);
    if (at == idle_.end()) return taken;
    taken = std::move(*at);
    idle_.erase(at);
    return taken;
  };
  PipelineScratch scratch = take([&](const PipelineScratch& idle) {
    return idle.memory.bytes() >= bytes && context_.is_done(idle.last_use);
  });
  if (scratch.last_use) return scratch;
  if (make(bytes, scratch) || (free_done() && make(bytes, scratch))) return scratch;
  scratch = take([&](const PipelineScratch& idle) { return idle.memory.bytes() >= bytes; });
  if (!scratch.last_use) throw GpuError(NIF_ERROR_OUT_OF_DEVICE_MEMORY, "GPU: the device has no memory left");
  try {
    context_.hold_back(stream, scratch.last_use);
  } catch (...) {
    idle_.push_back(std::move(scratch));
    throw;
  }
  return scratch;
}

void ScratchPool::give_back(PipelineScratch scratch, Stream stream) {
  const std::lock_guard lock(mutex_);
  idle_.push_back(std::move(scratch));
  context_.record(idle_.back().last_use, stream);
}

WayChoice::Trial WayChoice::choose(Context& context, uint64_t rays, bool details) {
  const std::lock_guard lock(mutex_);
  look();
  const auto logarithm = uint32_t(std::bit_width(rays)) - 1;  // there is at least one
  Kind& kind = kinds_[details][logarithm];
  if (kind.started[0] < kTrials || kind.started[1] < kTrials) {
    const bool by_pipeline = kind.started[1] <= kind.started[0];
    Trial trial{by_pipeline, Timer(context), uint32_t(details) * 64 + logarithm, rays};
    ++kind.started[by_pipeline];
    return trial;
  }
  const bool measured = kind.done[0] > 0 && kind.done[1] > 0;
  return {measured ? kind.best[1] < kind.best[0] : rays >= kGuessedThreshold, {}};
}

void WayChoice::add(Trial trial) {
  const std::lock_guard lock(mutex_);
  trials_.push_back(std::move(trial));
}

void WayChoice::look() {
  // Removed one by one, so that the trials are consistent if a call throws.
  for (size_t i = 0; i < trials_.size();) {
    const Trial& trial = trials_[i];
    if (!trial.timer.is_done()) {
      ++i;
      continue;
    }
    Kind& kind = kinds_[trial.kind / 64][trial.kind % 64];
    const double seconds = trial.timer.seconds() / double(trial.rays);
    double& best = kind.best[trial.by_pipeline];
    best = kind.done[trial.by_pipeline]++ == 0 ? seconds : std::min(best, seconds);
    trials_.erase(trials_.begin() + ptrdiff_t(i));
  }
}

void WayChoice::clear() {
  const std::lock_guard lock(mutex_);
  trials_.clear();
  for (auto& of : kinds_) std::fill(std::begin(of), std::end(of), Kind{});
}

}  // namespace nif::gpu
