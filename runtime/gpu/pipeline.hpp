// What the pipeline (kernels/gpu/pipeline_kernels.hpp) needs besides a scene: its kernels, and GPU memory for
// rays in progress. Also decides whether the pipeline or the one kernel is faster.
#pragma once

#include <mutex>
#include <string>
#include <vector>

#include "gpu/module.hpp"
#include "kernels/gpu/kernel_list.hpp"
#include "kernels/gpu/pipeline_kernels.hpp"
#include "memory.hpp"

namespace nif::gpu {

/// A kernel for scenes of certain kinds of objects, in two versions: without details, and with them.
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
/// Returns the first that supports all of these kinds, which is the most specialised.
const KindKernels& kernels_for(const std::vector<KindKernels>& kernels, uint32_t kinds);

struct PipelineKernels {
  std::vector<KindKernels> traversals;
  KindKernels traverse_one;  ///< for scenes of one instance of a supported object
  Kernel offsets, order, pack_bits;
  Kernel stages[kernels::gpu::kStages];

  /// The context is entered.
  explicit PipelineKernels(Context& context);
};

/// The shape that all blocks of a stage share.
struct StageShape {
  uint32_t threads;
  bool inner;  ///< is it measured with the inner networks?
};
extern const StageShape kStageShapes[kernels::gpu::kStages];

/// All lists of a scene, stage by stage.
struct PipelineLists {
  const kernels::gpu::PipelineList* lists;       ///< in GPU memory
  uint32_t first[kernels::gpu::kStages + 1];     ///< first list of each stage
  uint32_t traversal_words;                      ///< shared memory per thread of a traversal
  uint32_t shared_bytes[kernels::gpu::kStages];  ///< shared memory per block of each stage
  uint32_t count() const { return first[kernels::gpu::kStages]; }
};

/// After this many rounds of items, the one kernel answers the rays that are still undecided.
inline constexpr uint32_t kPipelineRounds = 4;
/// Rays in the pipeline at a time: enough for a large GPU. Each takes 69 bytes, or 181 (docs/gpu.md).
inline constexpr uint32_t kPipelineRays = 1u << 20;

/// The GPU memory of a running query: pointers into one block.
struct PipelineArrays {
  kernels::gpu::PipelineItems items[2];  ///< for even and odd rounds; `counts` are set in each round
  kernels::gpu::PipelineMemory memory;
  unsigned char* visible;  ///< [capacity]
  uint32_t* counts;        ///< [kPipelineRounds + 1][1 + lists]
  size_t counts_bytes;
};
/// Lays out the arrays from `base` on; returns how many bytes they take. Several instances need arrays for
/// more rounds than one instance does.
size_t lay_out(uint32_t rays, uint32_t lists, bool several_instances, unsigned char* base,
               PipelineArrays& arrays);

struct PipelineScratch {
  Memory memory;
  Event last_use = nullptr;  ///< recorded after the last query that used it
};

/// A device's scratch memory, for as many queries as run at the same time. It is freed only with the device,
/// or if memory is short, because freeing could wait for the GPU. Thread-safe; the GPU must be entered.
class ScratchPool {
 public:
  explicit ScratchPool(Context& context) : context_(context) {}
  /// Frees all of it.
  void clear();

  /// Lends at least `bytes` bytes; later work in the stream runs after their last use. If the GPU has no
  /// memory left, lends memory that another query still uses. Throws GpuError if there is none.
  PipelineScratch borrow(size_t bytes, Stream stream);
  /// Call it after the work that uses the scratch was put into the stream.
  void give_back(PipelineScratch scratch, Stream stream);

 private:
  /// Returns false if the GPU has no memory left.
  bool make(size_t bytes, PipelineScratch& scratch);
  /// Frees memory that no query uses; returns false if there is none.
  bool free_done();

  Context& context_;
  std::mutex mutex_;
  size_t blocks_ = 0;                  ///< how many exist
  std::vector<PipelineScratch> idle_;  ///< not lent at the moment
};

/// Learns which way is faster for a scene's queries. For each power of two of rays, with and without details,
/// the first queries use both ways in turn, and the GPU's clock is read once they are done. Nothing waits.
/// Thread-safe; the GPU must be entered.
class WayChoice {
 public:
  static constexpr uint32_t kTrials = 2;  ///< for each way

  struct Trial {
    bool by_pipeline;
    Timer timer;  ///< start it before the query and stop it after; none if the way is decided
    uint32_t kind = 0;
    uint64_t rays = 0;
  };
  Trial choose(Context& context, uint64_t rays, bool details);
  /// Adds a trial whose timer is stopped.
  void add(Trial trial);
  /// Forgets everything.
  void clear();

 private:
  struct Kind {
    uint32_t started[2] = {}, done[2] = {};
    double best[2] = {};  ///< seconds per ray
  };
  void look();

  std::mutex mutex_;
  Kind kinds_[2][64];  ///< [details][binary logarithm of rays]
  std::vector<Trial> trials_;
};

}  // namespace nif::gpu
