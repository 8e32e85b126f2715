// Defines the opaque types of runtime/src/gpu/module.hpp: an open GPU, and the assets, scenes and jobs on it.
#pragma once

#include <atomic>
#include <mutex>
#include <span>
#include <string>
#include <vector>

#include "driver.hpp"
#include "gpu/module.hpp"
#include "kernels/gpu/hit_kernels.hpp"
#include "kernels/gpu/open_kernels.hpp"
#include "kernels/gpu/upload.hpp"
#include "pipeline.hpp"

namespace nif::gpu {

/// Staging memory for queries in host memory, which go through it chunk by chunk: host memory to copy from
/// and to, and GPU memory. Both have the same layout: the chunk's rays and, right behind them, their masks, so
/// that one copy takes both; from kInputBytes on the outputs one after the other (query/outputs.hpp).
class Staging {
 public:
  static constexpr uint64_t kRays = 1 << 18;
  static constexpr size_t kInputBytes = kRays * (sizeof(NifRay) + sizeof(uint32_t));

  /// Has room for every output.
  explicit Staging(Context& context);
  ~Staging();
  Staging(const Staging&) = delete;
  Staging& operator=(const Staging&) = delete;

  unsigned char* host() const { return host_; }
  unsigned char* gpu() const { return gpu_.data(); }
  Stream stream() const { return stream_; }
  /// For the current user of the staging memory.
  Event answered() const { return answered_; }

 private:
  void release() noexcept;
  Context& context_;
  Memory gpu_;
  unsigned char* host_ = nullptr;
  Stream stream_ = nullptr;
  Event answered_ = nullptr;
};

/// An object on the GPU.
using DeviceObject = kernels::gpu::ObjectPlan;

}  // namespace nif::gpu

namespace nif::runtime {

struct GpuDevice {
  std::unique_ptr<gpu::Context> context;
  GpuSettings settings;
  std::vector<gpu::KindKernels> kernels;  ///< the one kernel, for different kinds of objects
  gpu::Kernel single_bvh;                 ///< for measurements
  gpu::Kernel open[2];                    ///< lists open rays; the second of scenes with holes
  gpu::Kernel hits[2];                    ///< first hits; likewise
  gpu::PipelineKernels pipeline;
  gpu::Stream uploads = nullptr;
  std::atomic<bool> lost = false;  ///< nothing on the GPU works any more
  gpu::ScratchPool scratch;
  std::mutex mutex;                                     ///< guards the members below
  std::vector<std::unique_ptr<gpu::Staging>> stagings;  ///< idle ones

  GpuDevice(std::unique_ptr<gpu::Context> opened, const GpuSettings& settings);
  ~GpuDevice();
};

struct GpuAsset {
  gpu::Memory memory;
  std::vector<gpu::DeviceObject> objects;
};

struct GpuScene {
  gpu::Memory memory;
  kernels::gpu::SceneArrays arrays{};
  gpu::PipelineLists lists{};
  uint32_t kinds = 0;
  bool ready = false;
  gpu::WayChoice choice;

  // Recorded after each query, in its stream, so that the scene is not changed while a query runs.
  std::mutex mutex;
  std::vector<gpu::Event> events;
};

struct GpuJob {
  gpu::Event event;
};

/// Pinned host memory that the GPU's arrays are copied to. The thread that makes or destroys it must have entered the GPU.
struct GpuFetch {
  explicit GpuFetch(gpu::Context& of) : context(of), arrived(of.make_event(false)) {}
  ~GpuFetch();  ///< waits for copies that are under way
  GpuFetch(const GpuFetch&) = delete;
  GpuFetch& operator=(const GpuFetch&) = delete;

  gpu::Context& context;
  gpu::Event arrived;  ///< after the last copies
  unsigned char* host = nullptr;
  uint64_t capacity = 0;
  bool under_way = false;  ///< copies may be writing
  bool whole = false;      ///< all of the last copies are there, or will be
};

}  // namespace nif::runtime

namespace nif::gpu {

using runtime::GpuAsset;
using runtime::GpuDevice;
using runtime::GpuScene;
using runtime::GpuSceneView;

// For the functions below the thread must have entered the GPU. They throw GpuError.

/// `details`: [count], or null.
std::unique_ptr<GpuAsset> copy_asset(GpuDevice& device, const kernels::AnyField* fields,
                                     const kernels::HitDetails* details, uint32_t count);
/// Waits for the scene's queries, then copies.
void copy_scene(GpuDevice& device, const GpuSceneView& view, GpuScene& scene);
/// Waits for the scene's queries and forgets them; if the GPU is lost, only forgets them.
void wait_for_queries(GpuDevice& device, GpuScene& scene);
/// Puts the launches that answer a query in GPU memory into the stream.
void put_query(GpuDevice& device, GpuScene& scene, const kernels::gpu::SceneQuery& query, uint64_t count,
               Stream stream, runtime::GpuMeasure how = runtime::GpuMeasure::query);
/// The same for a query that answers only proven rays, and lists the others.
void put_open_query(GpuDevice& device, GpuScene& scene, const kernels::gpu::SceneQuery& query, uint64_t count,
                    const kernels::gpu::OpenLists& lists, Stream stream);
/// The same for first hits.
void put_hit_query(GpuDevice& device, GpuScene& scene, const kernels::gpu::SceneQuery& query, uint64_t count,
                   const kernels::gpu::HitOutputs& hits, Stream stream);
/// Answers a query by the pipeline, and measures how long its stages took: seconds[kMeasuredStages]. Scenes
/// without networks, and work outside the pipeline, count as the last stage.
void time_stages(GpuDevice& device, GpuScene& scene, const kernels::gpu::SceneQuery& query, uint64_t count,
                 Stream stream, double* seconds);
void answer_query(GpuDevice& device, GpuScene& scene, const NifRays& rays, const NifAnswers& answers);
/// For queries in GPU memory.
void list_open_rays(GpuDevice& device, GpuScene& scene, const NifRays& rays, const NifAnswers& answers,
                    const NifOpenRays& open);
void find_hits(GpuDevice& device, GpuScene& scene, const NifRays& rays, const NifHits& hits);
/// Checks the arrays of a query in host memory that the CPU answers. `open` and `hits` may be null.
void check_for_cpu(GpuDevice& device, const NifRays& rays, const NifAnswers& answers, const NifOpenRays* open,
                   const NifHits* hits);
void check_for_cpu(GpuDevice& device, const void* array, const char* name);
/// Checks an array of the caller's, which may be null. promised: a NifMemory. `name`: of the array, for messages.
void check_array(Context& context, uint32_t promised, const void* array, const std::string& name);
/// Null is the default stream. `whose`: for the message.
void check_stream(Context& context, Stream stream, const char* whose);
/// See GpuModule::fetch_arrays() and wait_fetch().
void put_copies(GpuDevice& device, std::span<const runtime::FetchedArray> arrays, Stream stream,
                runtime::GpuFetch*& fetch);
const unsigned char* wait_for_copies(GpuDevice& device, runtime::GpuFetch& fetch);
/// For a query in host memory: answers it on the GPU once and then `rounds` times, without copies in between;
/// then copies the answers. seconds: [rounds], or [rounds][kMeasuredStages] for the pipeline's stages.
void time_query(GpuDevice& device, GpuScene& scene, const NifRays& rays, const NifAnswers& answers,
                runtime::GpuMeasure measure, uint32_t rounds, double* seconds);

}  // namespace nif::gpu
