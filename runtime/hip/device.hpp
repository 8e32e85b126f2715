// One card as the module uses it: what the opaque types of runtime/src/gpu_module.hpp stand for.
#pragma once

#include <atomic>
#include <mutex>
#include <vector>

#include "driver.hpp"
#include "gpu_module.hpp"
#include "kernels/hip/scene_kernels.hpp"

namespace nif::gpu {

/// Memory of the card. The thread that destroys it has entered the card.
class Memory {
 public:
  Memory() = default;
  Memory(Context& context, size_t bytes)
      : context_(&context), data_(static_cast<unsigned char*>(context.allocate(bytes))), bytes_(bytes) {}
  Memory(Memory&& other) noexcept { swap(other); }
  Memory& operator=(Memory&& other) noexcept {
    Memory(std::move(other)).swap(*this);
    return *this;
  }
  ~Memory() {
    if (data_) context_->free(data_);
  }
  unsigned char* data() const { return data_; }
  size_t bytes() const { return bytes_; }

 private:
  void swap(Memory& other) {
    std::swap(context_, other.context_);
    std::swap(data_, other.data_);
    std::swap(bytes_, other.bytes_);
  }
  Context* context_ = nullptr;
  unsigned char* data_ = nullptr;
  size_t bytes_ = 0;
};

/// What a query of host memory goes through, part by part: memory of the host that is copied from and to, and
/// of the card. Laid out alike: rays, then the outputs one after the other.
class Staging {
 public:
  static constexpr uint64_t kRays = 1 << 18;
  static constexpr size_t kVisible = kRays * sizeof(NifRay), kBits = kVisible + kRays,
                          kCertain = kBits + kRays / 8, kProbability = kCertain + kRays,
                          kLogit = kProbability + kRays * sizeof(float), kBytes = kLogit + kRays * 4;

  explicit Staging(Context& context);
  ~Staging();
  Staging(const Staging&) = delete;
  Staging& operator=(const Staging&) = delete;

  unsigned char* host() const { return host_; }
  unsigned char* card() const { return card_.data(); }
  Stream stream() const { return stream_; }

 private:
  Context& context_;
  Memory card_;
  unsigned char* host_ = nullptr;
  Stream stream_ = nullptr;
};

/// The kernels for a scene of some kinds of objects: without details, and with them.
struct SceneKernels {
  uint32_t kinds;
  Kernel visible, details;
};

}  // namespace nif::gpu

namespace nif::runtime {

struct GpuDevice {
  std::unique_ptr<gpu::Context> context;
  gpu::SceneKernels kernels[3];  ///< those for fewer kinds first
  gpu::Stream uploads = nullptr;
  std::atomic<bool> lost = false;                       ///< nothing on the card works any more
  std::mutex mutex;                                     ///< of the rest
  std::vector<std::unique_ptr<gpu::Staging>> stagings;  ///< that nobody uses

  explicit GpuDevice(std::unique_ptr<gpu::Context> opened);
  ~GpuDevice();
};

struct GpuAsset {
  gpu::Memory memory;
  std::vector<kernels::hip::SceneObject> objects;
  std::vector<uint32_t> row_words;  ///< [object]: of shared memory that a thread needs for it
};

struct GpuScene {
  gpu::Memory memory;
  kernels::hip::SceneArrays arrays{};
  uint32_t kinds = 0;
  bool ready = false;

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
using runtime::GpuObjectView;
using runtime::GpuScene;
using runtime::GpuSceneView;

// The thread has entered the card. They throw GpuError.

std::unique_ptr<GpuAsset> copy_asset(GpuDevice& device, const GpuObjectView* objects, uint32_t count);
/// Waits for the scene's queries, then copies.
void copy_scene(GpuDevice& device, const GpuSceneView& view, GpuScene& scene);
/// And forgets them; of a lost card they are only forgotten.
void wait_for_queries(GpuDevice& device, GpuScene& scene);
void answer_query(GpuDevice& device, GpuScene& scene, const NifQuery& query);
/// Of host memory: on the card alone, as often as seconds[rounds] has room; then the answers are copied.
void time_query(GpuDevice& device, GpuScene& scene, const NifQuery& query, uint32_t rounds, double* seconds);

}  // namespace nif::gpu
