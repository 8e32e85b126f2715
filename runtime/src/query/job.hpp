// A query that several threads work on: each takes batches until none is left.
//
// A job lives as long as anyone refers to it: the thread that waits for it, each thread that works on it, the
// pool's queue, and each task that the caller's runner was given. A task may run long after the last batch is
// done, and then finds nothing to do. So a job can outlive its query.
#pragma once

#include <atomic>
#include <memory_resource>

#include "api/object.hpp"
#include "gpu/module.hpp"
#include "query/claims.hpp"
#include "query/request.hpp"

struct NifJobObject : nif::runtime::Object {
  NifDeviceObject* device = nullptr;  ///< referred to while the job is in use
  NifSceneObject* scene = nullptr;
  nif::runtime::Request request;

  uint64_t batches = 0;
  // Each in a cache line of its own: threads write them while others read the request.
  alignas(64) std::atomic<uint64_t> next = 0;  ///< batch that nobody has taken
  alignas(64) std::atomic<uint64_t> done = 0;  ///< batches that are answered, or left out
  bool is_done() const { return done.load() == batches; }

  std::atomic<bool> cancelled = false;  ///< some batch was left out

  // The rest is guarded by the pool.
  alignas(64) uint32_t inside = 0;    ///< threads that work on it
  bool has_handle = false;            ///< the caller knows it: an asynchronous job
  bool holds_scene = false;           ///< a reference, while the job is not done
  bool queued = false;                ///< in the pool's queue
  NifJobObject* following = nullptr;  ///< in the queue

  /// The reference to the scene, to be released by the caller, once the job is done; else null.
  NifSceneObject* take_scene() {
    if (!holds_scene || !is_done()) return nullptr;
    holds_scene = false;
    return scene;
  }

  nif::runtime::GpuJob* on_gpu = nullptr;         ///< done when that is
  uint32_t number = nif::runtime::Claims::kNone;  ///< among the device's jobs; kNone: allocated on its own
};

namespace nif::runtime {

/// Answers batches until none is left to be taken. `scratch`: null, or a work area.
void take_blocks(NifJobObject& job, void* scratch);

/// Gives back an unreferenced job's memory, and its reference to the device.
void dispose(NifJobObject& job);

/// Answers a request on the calling thread and those that help it; returns when it is answered.
void answer(NifSceneObject& scene, Request request);

/// Lets others answer a request. Where there is nobody, it is answered before this returns. Returns the job's
/// handle.
uintptr_t start_job(NifSceneObject& scene, Request request);

}  // namespace nif::runtime
