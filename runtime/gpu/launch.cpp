// Turns a query into launches in a stream: of the one kernel or of the pipeline, in as many chunks as it
// takes.
#include <algorithm>
#include <bit>

#include "device.hpp"
#include "query/outputs.hpp"

namespace nif::gpu {
namespace {

using kernels::gpu::HitOutputs;
using kernels::gpu::PackWork;
using kernels::gpu::PipelineWork;
using kernels::gpu::SceneQuery;
using kernels::gpu::SceneWork;
using kernels::gpu::Stage;
using runtime::GpuMeasure;
using runtime::GpuWay;

template <class T>
void advance(T*& array, uint64_t bytes) {
  if (array) array += bytes;
}

/// Skips the first `rays` rays, a multiple of 8.
void skip(SceneQuery& query, uint64_t rays) {
  for (int a = 0; a < 3; ++a) {
    advance(query.origin[a], rays * query.origin_stride);
    advance(query.direction[a], rays * query.direction_stride);
  }
  advance(query.tmin, rays * query.tmin_stride);
  advance(query.tmax, rays * query.tmax_stride);
  advance(query.mask, rays * query.mask_stride);
  runtime::visit_outputs(
      [&](const runtime::OutputArray& about, unsigned char*& array) { advance(array, about.bytes(rays)); },
      query);
}

uint32_t blocks_for(uint64_t count, uint32_t threads) { return uint32_t((count + threads - 1) / threads); }

/// The measured stages, in the order of time_stages().
enum Measured : uint32_t {
  kTraversal,
  kOrdering,
  kOuterInputs,
  kOuterNetworks,
  kInnerInputs,
  kInnerNetworks,
  kRest
};
static_assert(kRest + 1 == runtime::kMeasuredStages);

/// Measures the time of launches.
class StageClock {
 public:
  StageClock(Context& context, Stream stream) : context_(context), stream_(stream) {}
  template <class Work>
  void time(Measured what, const Work& work) {
    laps_.emplace_back(what, Timer(context_));
    laps_.back().second.start(stream_);
    work();
    laps_.back().second.stop(stream_);
  }
  void read(double* seconds) const {
    std::fill_n(seconds, runtime::kMeasuredStages, 0.0);
    for (const auto& [what, timer] : laps_) {
      timer.wait();
      seconds[what] += timer.seconds();
    }
    // Networks were timed together with their inputs: subtract those.
    for (const Measured network : {kOuterNetworks, kInnerNetworks})
      seconds[network] = std::max(0.0, seconds[network] - seconds[network - 1]);
  }

 private:
  Context& context_;
  Stream stream_;
  std::vector<std::pair<Measured, Timer>> laps_;
};

/// Puts launches into a stream.
class Launcher {
 public:
  Launcher(GpuDevice& device, GpuScene& scene, Stream stream, StageClock* clock = nullptr)
      : device_(device), scene_(scene), stream_(stream), clock_(clock) {}

  /// Uses the kernel for measurements from now on.
  void measure_single_bvh() { single_bvh_ = true; }

  /// Answers all of the query's rays, or those in a list.
  void one_kernel(const SceneQuery& query, const kernels::gpu::RayList& list = {}) {
    const KindKernels& kernels = kernels_for(device_.kernels, scene_.kinds);
    const kernels::gpu::SceneLayout& layout = scene_.arrays.layout;
    SceneWork work{scene_.arrays, query, list};
    const uint32_t blocks = blocks_for(query.count, layout.rays);
    const Kernel kernel = single_bvh_ ? device_.single_bvh : kernels.kernel(query.details());
    timed(kRest, [&] {
      put(kernel, work,
          {list.rays ? spread(blocks, 32) : std::min(blocks, kMostBlocks), kernels::gpu::kSceneThreads,
           layout.bytes});
    });
  }

  /// Runs the kernel that lists open rays. `first`: the number of the first ray.
  void open(const SceneQuery& query, const kernels::gpu::OpenLists& lists, uint32_t first) {
    const kernels::gpu::SceneLayout& layout = scene_.arrays.layout;
    kernels::gpu::OpenWork work{scene_.arrays, query, lists, first};
    put(device_.open[has_holes()], work,
        {std::min(blocks_for(query.count, layout.rays), kMostBlocks), kernels::gpu::kSceneThreads,
         layout.bytes});
  }

  /// Runs the kernel that finds first hits.
  void first_hits(const SceneQuery& query, const HitOutputs& hits) {
    const kernels::gpu::SceneLayout& layout = scene_.arrays.layout;
    kernels::gpu::HitWork work{scene_.arrays, query, hits};
    put(device_.hits[has_holes()], work,
        {std::min(blocks_for(query.count, layout.rays), kMostBlocks), kernels::gpu::kSceneThreads,
         layout.bytes});
  }

  /// Requires that the arrays have room for all rays.
  void pipeline(SceneQuery query, PipelineArrays& arrays) {
    Context& context = *device_.context;
    const uint32_t lists = scene_.lists.count();
    unsigned char* const bits = std::exchange(query.visible_bits, nullptr);
    if (bits && !query.visible) query.visible = arrays.visible;
    context.clear(arrays.counts, arrays.counts_bytes, stream_);
    const bool several = scene_.arrays.instance_count > 1;
    PipelineWork work{scene_.arrays, query, scene_.lists.lists, lists, {}, {}, arrays.memory, 0, 0, 0};
    for (uint32_t round = 0;; ++round) {
      work.items = arrays.items[round % 2];
      work.items.counts = arrays.counts + size_t(round) * (1 + lists);
      traverse(work);
      if (round == kPipelineRounds) break;
      ask_networks(work);
      if (!several) break;
      work.before = work.items;
    }
    if (several) one_kernel(query, {work.items.ray, work.items.counts});
    if (!bits) return;
    PackWork pack{query.visible, bits, query.count};
    timed(kRest, [&] {
      put(device_.pipeline.pack_bits, pack,
          {blocks_for((query.count + 7) / 8, kernels::gpu::kBlockThreads), kernels::gpu::kBlockThreads, 0});
    });
  }

 private:
  static constexpr uint32_t kMostBlocks = 1u << 20;

  bool has_holes() const { return (scene_.kinds & ~kernels::gpu::kAnyKind) != 0; }

  template <class Work>
  void put(Kernel kernel, Work& work, const LaunchShape& shape) {
    void* arguments[] = {&work};
    device_.context->launch(kernel, shape, stream_, arguments);
  }
  template <class Work>
  void timed(Measured what, const Work& work) {
    if (clock_) return clock_->time(what, work);
    work();
  }
  /// Limits a launch to the number of blocks that keeps the GPU busy: at most `blocks` of them find work.
  uint32_t spread(uint32_t blocks, uint32_t per_processor) const {
    return std::max(1u, std::min(blocks, device_.context->processors() * per_processor));
  }

  void traverse(PipelineWork& work) {
    using namespace kernels::gpu;
    const uint32_t blocks = blocks_for(work.query.count, kBlockThreads);
    const KindKernels& one = device_.pipeline.traverse_one;
    if (scene_.arrays.instance_count == 1 && (scene_.kinds & ~one.kinds) == 0)
      return timed(kTraversal, [&] {
        put(one.kernel(work.query.details()), work,
            {spread(blocks, 8), kBlockThreads, kKeptWords * kBlockThreads * uint32_t(sizeof(uint32_t))});
      });
    const KindKernels& kernels = kernels_for(device_.pipeline.traversals, scene_.kinds);
    timed(kTraversal, [&] {
      put(kernels.kernel(work.query.details()), work,
          {work.before.counts ? spread(blocks, 16) : blocks, kBlockThreads,
           scene_.lists.traversal_words * kBlockThreads * uint32_t(sizeof(uint32_t))});
    });
  }

  void ask_networks(PipelineWork& work) {
    using namespace kernels::gpu;
    if (work.memory.order) put_in_order(work);
    for (uint32_t stage = 0; stage < kStages; ++stage) {
      work.first_list = scene_.lists.first[stage];
      work.end_list = scene_.lists.first[stage + 1];
      if (work.first_list < work.end_list) ask_networks(work, Stage(stage));
    }
  }

  void put_in_order(PipelineWork& work) {
    using namespace kernels::gpu;
    timed(kOrdering, [&] {
      put(device_.pipeline.offsets, work, {1, kBlockThreads, kBlockThreads * uint32_t(sizeof(uint32_t))});
      put(device_.pipeline.order, work,
          {spread(blocks_for(work.query.count, kBlockThreads), 16), kBlockThreads, 0});
    });
  }

  void ask_networks(PipelineWork& work, Stage stage) {
    using namespace kernels::gpu;
    const bool inner = kStageShapes[stage].inner;
    const uint32_t tiles = blocks_for(work.query.count, kTileItems) + work.end_list - work.first_list;
    // Items that single threads process may have a block each.
    const uint32_t most = stage == kAlone ? std::max(tiles, work.query.count) : tiles;
    const auto put_stage = [&] {
      put(device_.pipeline.stages[stage], work,
          {spread(most, 2048 / kStageShapes[stage].threads), kStageShapes[stage].threads,
           scene_.lists.shared_bytes[stage]});
    };
    if (stage == kAlone) return timed(kRest, put_stage);
    if (clock_) {
      work.inputs_alone = 1;
      clock_->time(inner ? kInnerInputs : kOuterInputs, put_stage);
      work.inputs_alone = 0;
    }
    timed(inner ? kInnerNetworks : kOuterNetworks, put_stage);
  }

  GpuDevice& device_;
  GpuScene& scene_;
  Stream stream_;
  StageClock* clock_;
  bool single_bvh_ = false;
};

/// Calls `put` for chunks of at most `most` rays, a multiple of 8.
template <class Put>
void for_each_part(SceneQuery query, uint64_t count, uint64_t most, const Put& put) {
  while (count > 0) {
    query.count = uint32_t(std::min(count, most));
    put(query);
    count -= query.count;
    skip(query, query.count);
  }
}

/// Returns false if the GPU has no memory for it; nothing has then been put into the stream.
bool put_by_pipeline(GpuDevice& device, GpuScene& scene, const SceneQuery& query, uint64_t count,
                     Stream stream, StageClock* clock) {
  const uint32_t lists = scene.lists.count();
  const bool several = scene.arrays.instance_count > 1;
  uint64_t rays =
      std::bit_ceil(std::min<uint64_t>(std::max<uint64_t>(count, kernels::gpu::kTileItems), kPipelineRays));
  rays = std::min<uint64_t>(rays, device.context->most_rays());
  PipelineArrays arrays;
  PipelineScratch scratch;
  try {
    scratch = device.scratch.borrow(lay_out(uint32_t(rays), lists, several, nullptr, arrays), stream);
  } catch (const GpuError& error) {
    if (error.code() == NIF_ERROR_OUT_OF_DEVICE_MEMORY) return false;
    throw;
  }
  lay_out(uint32_t(rays), lists, several, scratch.memory.data(), arrays);
  Launcher launcher(device, scene, stream, clock);
  try {
    for_each_part(query, count, rays, [&](const SceneQuery& part) { launcher.pipeline(part, arrays); });
  } catch (...) {
    device.scratch.give_back(std::move(scratch), stream);
    throw;
  }
  device.scratch.give_back(std::move(scratch), stream);
  return true;
}

void put_by_one_kernel(GpuDevice& device, GpuScene& scene, const SceneQuery& query, uint64_t count,
                       Stream stream, StageClock* clock, bool single_bvh = false) {
  Launcher launcher(device, scene, stream, clock);
  if (single_bvh) launcher.measure_single_bvh();
  for_each_part(query, count, device.context->most_rays(),
                [&](const SceneQuery& part) { launcher.one_kernel(part); });
}

/// Returns false if there is no network that the pipeline could evaluate.
bool has_pipeline(const GpuScene& scene) {
  return scene.lists.count() > 0 && scene.arrays.instance_count > 0;
}

}  // namespace

void put_query(GpuDevice& device, GpuScene& scene, const SceneQuery& query, uint64_t count, Stream stream,
               GpuMeasure how) {
  if (count == 0) return;
  if (how == GpuMeasure::single_bvh) {
    if ((scene.kinds & ~uint32_t{kernels::gpu::kBvhObject}) != 0 || query.details())
      throw GpuError(NIF_ERROR_INVALID_ARGUMENT,
                     "query: in single precision only what is visible of bvh objects is measured");
    return put_by_one_kernel(device, scene, query, count, stream, nullptr, true);
  }
  const GpuWay wanted = how == GpuMeasure::one_kernel ? GpuWay::one_kernel
                        : how == GpuMeasure::pipeline ? GpuWay::pipeline
                                                      : device.settings.way;
  const bool possible = has_pipeline(scene) && !query.mask;
  const bool by_choice = wanted == GpuWay::automatic && possible && !device.settings.half;
  WayChoice::Trial trial{possible && wanted != GpuWay::one_kernel, {}};
  if (by_choice) trial = scene.choice.choose(*device.context, count, query.details());
  if (trial.timer) trial.timer.start(stream);
  if (!trial.by_pipeline || !put_by_pipeline(device, scene, query, count, stream, nullptr)) {
    if (trial.by_pipeline && !by_choice)
      throw GpuError(NIF_ERROR_OUT_OF_DEVICE_MEMORY,
                     "GPU: the device has no memory left for the pipeline of a query");
    trial.by_pipeline = false;
    put_by_one_kernel(device, scene, query, count, stream, nullptr);
  }
  if (!trial.timer) return;
  trial.timer.stop(stream);
  scene.choice.add(std::move(trial));
}

void put_open_query(GpuDevice& device, GpuScene& scene, const SceneQuery& query, uint64_t count,
                    const kernels::gpu::OpenLists& lists, Stream stream) {
  device.context->clear(lists.count, sizeof(*lists.count), stream);
  Launcher launcher(device, scene, stream);
  uint32_t first = 0;
  for_each_part(query, count, device.context->most_rays(), [&](const SceneQuery& part) {
    launcher.open(part, lists, first);
    first += part.count;
  });
}

void put_hit_query(GpuDevice& device, GpuScene& scene, const SceneQuery& query, uint64_t count,
                   const HitOutputs& hits, Stream stream) {
  Launcher launcher(device, scene, stream);
  HitOutputs rest = hits;
  for_each_part(query, count, device.context->most_rays(), [&](const SceneQuery& part) {
    launcher.first_hits(part, rest);
    runtime::visit_hit_outputs([&](const runtime::OutputArray& about,
                                   unsigned char*& array) { advance(array, about.bytes(part.count)); },
                               rest);
  });
}

void time_stages(GpuDevice& device, GpuScene& scene, const SceneQuery& query, uint64_t count, Stream stream,
                 double* seconds) {
  StageClock clock(*device.context, stream);
  if (!has_pipeline(scene))
    put_by_one_kernel(device, scene, query, count, stream, &clock);
  else if (!put_by_pipeline(device, scene, query, count, stream, &clock))
    throw GpuError(NIF_ERROR_OUT_OF_DEVICE_MEMORY,
                   "GPU: the device has no memory left for the pipeline of a query");
  clock.read(seconds);
}

}  // namespace nif::gpu
