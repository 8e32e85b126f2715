// What the pipeline (kernels/gpu/pipeline_kernels.hpp) takes besides a scene: its kernels, and memory of the
// card for the rays that are on their way. And which way is the faster, it or the one kernel.
#pragma once

#include <mutex>
#include <string>
#include <vector>

#include "gpu/module.hpp"
#include "kernels/gpu/kernel_list.hpp"
#include "kernels/gpu/pipeline_kernels.hpp"
#include "memory.hpp"

namespace nif::gpu {

/// A kernel for scenes of some kinds of objects: without details, and with them.
struct KindKernels {
  uint32_t kinds;
  Kernel visible, details;

  /// The context is entered.
  KindKernels(Context& context, uint32_t of_kinds, const std::string& name)
      : kinds(of_kinds),
        visible(context.find_kernel(name.c_str())),
        details(context.find_kernel((name + "_details").c_str())) {}
  Kernel kernel(bool with_details) const { return with_details ? details : visible; }
};
/// The first that is for all of these kinds: the one for the fewest.
const KindKernels& kernels_for(const std::vector<KindKernels>& kernels, uint32_t kinds);

struct PipelineKernels {
  std::vector<KindKernels> walks;
  KindKernels walk_one;  ///< for scenes of one instance of such an object
  Kernel offsets, order, pack_bits;
  Kernel stages[kernels::gpu::kStages];

  /// The context is entered.
  explicit PipelineKernels(Context& context);
};

/// What is the same for all blocks of a stage.
struct StageShape {
  uint32_t threads;
  bool inner;  ///< as which networks it is measured
};
extern const StageShape kStageShapes[kernels::gpu::kStages];

/// All lists of a scene, those of a stage one after the other.
struct PipelineLists {
  const kernels::gpu::PipelineList* lists;       ///< memory of the card
  uint32_t first[kernels::gpu::kStages + 1];     ///< of each stage
  uint32_t walk_words;                           ///< of shared memory, for each thread of a walk
  uint32_t shared_bytes[kernels::gpu::kStages];  ///< that each stage's blocks take
  uint32_t count() const { return first[kernels::gpu::kStages]; }
};

/// Rounds of items after which rays that are still on their way are left to the one kernel.
inline constexpr uint32_t kPipelineRounds = 4;
/// Rays that go through it at a time: enough for a large card. Each takes 69 bytes, or 181 (docs/gpu.md).
inline constexpr uint32_t kPipelineRays = 1u << 20;

/// What a query on its way has of the card's memory: pointers into one block of it.
struct PipelineArrays {
  kernels::gpu::PipelineItems items[2];  ///< of even rounds and of odd ones; `counts` are set by round
  kernels::gpu::PipelineMemory memory;
  unsigned char* visible;  ///< [capacity]
  uint32_t* counts;        ///< [kPipelineRounds + 1][1 + lists]
  size_t counts_bytes;
};
/// Lays them out from `base` on; returns how many bytes they take. Several instances take more rounds than
/// one does.
size_t lay_out(uint32_t rays, uint32_t lists, bool several_instances, unsigned char* base,
               PipelineArrays& arrays);

struct PipelineScratch {
  Memory memory;
  Event last_use = nullptr;  ///< recorded behind the last query that used it
};

/// The scratch memory of a device: for as many queries as are under way at the same time. It is given back
/// with the device or where memory is short, because to free it could wait for the card. Thread-safe; the
/// card is entered.
class ScratchPool {
 public:
  explicit ScratchPool(Context& context) : context_(context) {}
  /// Gives all of it back.
  void clear();

  /// At least so many bytes; what is put into the stream from now on comes after their last use. Where the
  /// card has no memory left, what another query still uses. Throws GpuError where there is none.
  PipelineScratch borrow(size_t bytes, Stream stream);
  /// After what uses it has been put into the stream.
  void give_back(PipelineScratch scratch, Stream stream);

 private:
  /// False where the card has no memory left.
  bool make(size_t bytes, PipelineScratch& scratch);
  /// Gives back what no query uses; false where there is nothing.
  bool free_done();

  Context& context_;
  std::mutex mutex_;
  size_t blocks_ = 0;                  ///< that there are
  std::vector<PipelineScratch> idle_;  ///< that nobody is putting a query together with
};

/// Which way is the faster for queries of a scene, learned from them: for each power of two of rays, with
/// details and without, the first ones go both ways in turns, and the card's clock is looked at when it has
/// come so far. Nothing is waited for. Thread-safe; the card is entered.
class WayChoice {
 public:
  static constexpr uint32_t kTrials = 2;  ///< of each way

  struct Trial {
    bool by_pipeline;
    Timer timer;  ///< to be started before the query and stopped behind it; none where it is decided
    uint32_t kind = 0;
    uint64_t rays = 0;
  };
  Trial choose(Context& context, uint64_t rays, bool details);
  /// One whose timer is stopped.
  void add(Trial trial);
  /// Forgets everything.
  void clear();

 private:
  struct Kind {
    uint32_t started[2] = {}, done[2] = {};
    double best[2] = {};  ///< seconds a ray
  };
  void look();

  std::mutex mutex_;
  Kind kinds_[2][64];  ///< [details][binary logarithm of rays]
  std::vector<Trial> trials_;
};

}  // namespace nif::gpu
