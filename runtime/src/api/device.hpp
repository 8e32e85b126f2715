// A device: its configuration, and the caller's allocator, task runner and log.
#pragma once

#include <cstdint>
#include <memory_resource>
#include <new>
#include <optional>
#include <string>
#include <string_view>

#include "api/object.hpp"
#include "gpu/gpu.hpp"
#include "nif/nif.h"
#include "query/thread_pool.hpp"
#include "query/work_area.hpp"
#include "scene/kernel.hpp"

namespace nif::runtime {

/// Wraps the caller's allocator for the standard library.
class CallbackMemory : public std::pmr::memory_resource {
 public:
  explicit CallbackMemory(const NifDeviceCallbacks& callbacks) : callbacks_(callbacks) {}

 private:
  void* do_allocate(size_t bytes, size_t alignment) override;
  void do_deallocate(void* memory, size_t bytes, size_t alignment) override;
  bool do_is_equal(const memory_resource& other) const noexcept override { return this == &other; }

  NifDeviceCallbacks callbacks_;
};

struct Configuration {
  uint32_t threads = 1;
  KernelChoice kernels;
  bool shaders = false;                ///< assets keep what tables for shaders are made from
  uint32_t queries;                    ///< most queries that have work memory at the same time
  const char* backend = "cpu";         ///< cpu, gpu, cuda or hip
  std::optional<uint32_t> gpu_number;  ///< for a GPU backend
  GpuSettings gpu{};                   ///< likewise
  std::string_view module;             ///< its file, or ""; a view into the parsed text
};

/// Parses "key=value,key=value". Throws Failure.
Configuration parse_configuration(std::string_view text);

/// Opens the GPU if the backend is one. Throws Failure.
void open_gpu(const Configuration& configuration, std::optional<Gpu>& gpu);

}  // namespace nif::runtime

struct NifDeviceObject : nif::runtime::Object {
  NifDeviceObject(const nif::runtime::Configuration& settings, const NifDeviceCallbacks& callbacks)
      : configuration(settings),
        own_callbacks(callbacks),
        callback_memory(callbacks),
        streams(nif::runtime::stream_functions(settings.kernels.isa)),
        areas(settings.queries, memory()),
        jobs(settings.threads > 1 ? settings.queries : 0, memory()),
        free_jobs(uint32_t(jobs.size()), memory()),
        pool(callbacks.submit ? 0 : settings.threads - 1, memory()) {
    for (NifJobObject& job : jobs) job.drop();  // no references yet
    open_gpu(settings, gpu);
    configuration.module = {};
  }

  /// Writes to the caller's log, if there is one. Only then is `sentence()` called, to make the text. Without
  /// memory for it the log lacks a sentence: what was done stays done.
  template <class Sentence>
  void log(NifLogLevel level, const Sentence& sentence) const noexcept {
    if (own_callbacks.log == nullptr) return;
    try {
      own_callbacks.log(own_callbacks.user, level, std::string(sentence()).c_str());
    } catch (const std::bad_alloc&) {
    }
  }

  std::pmr::memory_resource* memory() {
    return own_callbacks.allocate ? &callback_memory : std::pmr::new_delete_resource();
  }

  nif::runtime::Configuration configuration;
  NifDeviceCallbacks own_callbacks;
  nif::runtime::CallbackMemory callback_memory;
  const nif::kernels::cpu::StreamFunctions* const streams;  ///< null for isa=scalar
  std::optional<nif::runtime::Gpu> gpu;                     ///< if the backend is one
  nif::runtime::WorkAreas areas;
  std::pmr::vector<NifJobObject> jobs;  ///< for synchronous queries
  nif::runtime::Claims free_jobs;
  nif::runtime::ThreadPool pool;
};

namespace nif::runtime {

NifDeviceObject* new_device(const char* configuration, const NifDeviceCallbacks* callbacks);
void release(NifDeviceObject* device);

}  // namespace nif::runtime
