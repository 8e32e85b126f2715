// The rest of the runtime's view of the GPU backend: the module, and one GPU that it has opened. Everything
// else is inside the module (runtime/gpu), behind module.hpp.
#pragma once

#include <atomic>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "gpu/module.hpp"
#include "nif/nif.h"

struct NifAssetObject;
struct NifDeviceObject;
struct NifJobObject;
struct NifSceneObject;

namespace nif::runtime {

struct Request;
class BentObject;

/// A GPU that a device uses.
class Gpu {
 public:
  /// `module`: its file, or "" for the usual places. `backend`: "gpu" for any, or "cuda" or "hip". No `GPU`:
  /// the backend's first. Throws Failure that says what is missing.
  Gpu(std::string_view module, std::string_view backend, std::optional<uint32_t> gpu,
      const GpuSettings& settings);
  Gpu(const Gpu&) = delete;
  Gpu& operator=(const Gpu&) = delete;
  /// Everything on the GPU must have been freed.
  ~Gpu() { module_.close_device(device_); }

  const GpuDescription& description() const { return description_; }
  /// Has a call found that the GPU is lost? The CPU then answers what it can.
  bool lost() const { return lost_; }

  // These work on the GPU. They throw Failure; freeing what is not on the GPU does nothing.
  void upload(NifAssetObject& asset);
  void upload(NifSceneObject& scene);
  void free(NifAssetObject& asset) noexcept;
  void free(NifSceneObject& scene) noexcept;
  void free(BentObject& bent) noexcept;
  void query(NifSceneObject& scene, const NifRays& rays, const NifAnswers& answers);
  void query_open(NifSceneObject& scene, const NifRays& rays, const NifAnswers& answers,
                  const NifOpenRays& open);
  void intersect(NifSceneObject& scene, const NifRays& rays, const NifHits& hits);
  /// Checks the arrays of a query in host memory that the CPU answers; if the GPU is lost, nothing.
  void check_host_query(const NifDeviceObject& device, const Request& request);
  /// Checks an array that the CPU reads and that may be null, likewise. `name`: of the array, for the message.
  void check_host_array(const NifDeviceObject& device, const void* array, const char* name);
  /// Copies arrays to the host, as fetch_arrays() of the module.
  void fetch(const NifDeviceObject& device, std::span<const FetchedArray> arrays, void* stream,
             GpuFetch*& fetch);
  /// Returns where the copies are, as wait_fetch().
  const unsigned char* wait(const NifDeviceObject& device, GpuFetch& fetch);
  void measure(NifSceneObject& scene, const NifRays& rays, const NifAnswers& answers, GpuMeasure measure,
               uint32_t rounds, double* seconds);

  /// Starts a query in device memory. The job is done only once wait() or is_done() says so.
  void start(NifSceneObject& scene, const Request& request, NifJobObject& job);
  void wait(NifJobObject& job);
  void poll(NifJobObject& job);
  /// Afterwards the job counts as done for the runtime, although the GPU may still work on it.
  void let_go(NifJobObject& job) noexcept;

 private:
  void check(const NifDeviceObject& device, NifError code, const GpuMessage& message);
  void lose(const NifDeviceObject& device, const GpuMessage& message);

  const GpuModule& module_;
  GpuDevice* device_ = nullptr;
  GpuDescription description_{};
  std::atomic<bool> lost_ = false;
  std::mutex uploads_;  ///< one asset at a time
};

/// Says in one sentence why no GPU of a backend ("cuda" or "hip") can be used; "" if one can. Each call
/// looks again. The text is valid until the next call on this thread.
const char* why_no_gpu(std::string_view backend);

/// Throws Failure if there is no such GPU.
NifGpuInfo describe_gpu(uint32_t gpu);

}  // namespace nif::runtime
