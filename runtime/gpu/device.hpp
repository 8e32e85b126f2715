// One card as the module uses it: what the opaque types of runtime/src/gpu/module.hpp stand for.
#pragma once

#include <atomic>
#include <mutex>
#include <vector>

#include "driver.hpp"
#include "gpu/module.hpp"
#include "kernels/gpu/hit_kernels.hpp"
#include "kernels/gpu/open_kernels.hpp"
#include "kernels/gpu/upload.hpp"
#include "pipeline.hpp"

namespace nif::gpu {

/// What a query of host memory goes through, part by part: memory of the host that is copied from and to, and
/// of the card. Laid out alike: kRays rays, then the outputs one after the other (query/outputs.hpp).
class Staging {
 public:
  static constexpr uint64_t kRays = 1 << 18;
  static constexpr size_t kRayBytes = kRays * sizeof(NifRay);

  /// For every output.
  explicit Staging(Context& context);
  ~Staging();
  Staging(const Staging&) = delete;
  Staging& operator=(const Staging&) = delete;

  unsigned char* host() const { return host_; }
  unsigned char* card() const { return card_.data(); }
  Stream stream() const { return stream_; }
  /// For whoever has it in hand.
  Event answered() const { return answered_; }

 private:
  void release() noexcept;
  Context& context_;
  Memory card_;
  unsigned char* host_ = nullptr;
  Stream stream_ = nullptr;
  Event answered_ = nullptr;
};

/// An object on the card.
using CardObject = kernels::gpu::ObjectPlan;

}  // namespace nif::gpu

namespace nif::runtime {

struct GpuDevice {
  std::unique_ptr<gpu::Context> context;
  GpuSettings settings;
  std::vector<gpu::KindKernels> kernels;  ///< the one kernel, for scenes of some kinds of objects
  gpu::Kernel single_bvh;                 ///< for measurements
  gpu::Kernel open;                       ///< what proofs leave open
  gpu::Kernel hits;                       ///< first hits
  gpu::PipelineKernels pipeline;
  gpu::Stream uploads = nullptr;
  std::atomic<bool> lost = false;  ///< nothing on the card works any more
  gpu::ScratchPool scratch;
  std::mutex mutex;                                     ///< of the rest
  std::vector<std::unique_ptr<gpu::Staging>> stagings;  ///< that nobody uses

  GpuDevice(std::unique_ptr<gpu::Context> opened, const GpuSettings& settings);
  ~GpuDevice();
};

struct GpuAsset {
  gpu::Memory memory;
  std::vector<gpu::CardObject> objects;
};

struct GpuScene {
  gpu::Memory memory;
  kernels::gpu::SceneArrays arrays{};
  gpu::PipelineLists lists{};
  uint32_t kinds = 0;
  bool ready = false;
  gpu::WayChoice choice;

  // Recorded after each query, in its stream, so that the scene is not changed under it.
  std::mutex mutex;
  std::vector<gpu::Event> events;
};

struct GpuJob {
  gpu::Event event;
};

}  // namespace nif::runtime

namespace nif::gpu {

using runtime::GpuAsset;
using runtime::GpuDevice;
using runtime::GpuScene;
using runtime::GpuSceneView;

// The thread has entered the card. They throw GpuError.

/// `details`: [count], or null.
std::unique_ptr<GpuAsset> copy_asset(GpuDevice& device, const kernels::AnyField* fields,
                                     const kernels::HitDetails* details, uint32_t count);
/// Waits for the scene's queries, then copies.
void copy_scene(GpuDevice& device, const GpuSceneView& view, GpuScene& scene);
/// And forgets them; of a lost card they are only forgotten.
void wait_for_queries(GpuDevice& device, GpuScene& scene);
/// Puts the launches that answer a query of memory of the card into the stream.
void put_query(GpuDevice& device, GpuScene& scene, const kernels::gpu::SceneQuery& query, uint64_t count,
               Stream stream, runtime::GpuMeasure how = runtime::GpuMeasure::query);
/// The same of what proofs alone say, with the other rays in lists.
void put_open_query(GpuDevice& device, GpuScene& scene, const kernels::gpu::SceneQuery& query, uint64_t count,
                    const kernels::gpu::OpenLists& lists, Stream stream);
/// The same of first hits.
void put_hit_query(GpuDevice& device, GpuScene& scene, const kernels::gpu::SceneQuery& query, uint64_t count,
                   const kernels::gpu::HitOutputs& hits, Stream stream);
/// Answers it by the pipeline, and tells how long its stages took: seconds[kMeasuredStages]. A scene without
/// networks, and what does not go through the pipeline, counts as the last one.
void time_stages(GpuDevice& device, GpuScene& scene, const kernels::gpu::SceneQuery& query, uint64_t count,
                 Stream stream, double* seconds);
void answer_query(GpuDevice& device, GpuScene& scene, const NifRays& rays, const NifAnswers& answers);
/// Of memory of the card.
void list_open_rays(GpuDevice& device, GpuScene& scene, const NifRays& rays, const NifAnswers& answers,
                    const NifOpenRays& open);
void find_hits(GpuDevice& device, GpuScene& scene, const NifRays& rays, const NifHits& hits);
/// Of host memory: on the card alone, once and then `rounds` times; then the answers are copied. seconds:
/// [rounds], or, of the pipeline's stages, [rounds][kMeasuredStages].
void time_query(GpuDevice& device, GpuScene& scene, const NifRays& rays, const NifAnswers& answers,
                runtime::GpuMeasure measure, uint32_t rounds, double* seconds);

}  // namespace nif::gpu
