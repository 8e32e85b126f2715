// Lets several threads work on one query: each takes batches until none is left. Also on the instances of a scene that have
// bent.
//
// References keep a job alive: the thread that waits for it, each thread that works on it, the pool's queue,
// and each task given to the caller's task runner hold one. A task may run long after the last batch is done,
// and then finds nothing to do. So a job can outlive its query.
#pragma once

#include <atomic>
#include <memory_resource>

#include "api/object.hpp"
#include "gpu/module.hpp"
#include "query/claims.hpp"
#include "query/request.hpp"

struct NifJobObject : nif::runtime::Object {
  NifDeviceObject* device = nullptr;  ///< holds a reference while the job is in use
  NifSceneObject* scene = nullptr;
  nif::runtime::Request request;
  bool refits = false;  ///< instead of a query: batch i refits the scene's bent instance i

  uint64_t batches = 0;
  // One cache line each: threads write them while others read the request.
  alignas(64) std::atomic<uint64_t> next = 0;  ///< the next batch to take
  alignas(64) std::atomic<uint64_t> done = 0;  ///< batches that are answered or skipped
  bool is_done() const { return done.load() == batches; }

  std::atomic<bool> cancelled = false;  ///< some batch was skipped

  // The members below are guarded by the pool's lock.
  alignas(64) uint32_t inside = 0;    ///< threads that work on it
  bool has_handle = false;            ///< the caller has a handle to it: an asynchronous job
  bool holds_scene = false;           ///< holds a reference to the scene, until the job is done
  bool queued = false;                ///< it is in the pool's queue
  NifJobObject* following = nullptr;  ///< the next job in the queue

  /// Once the job is done: its reference to the scene, for the caller to release. Before that: null.
  NifSceneObject* take_scene() {
    if (!holds_scene || !is_done()) return nullptr;
    holds_scene = false;
    return scene;
  }

  nif::runtime::GpuJob* on_gpu = nullptr;         ///< if set, the job is done when this is
  uint32_t number = nif::runtime::Claims::kNone;  ///< index in the device's jobs; kNone: allocated separately
};

namespace nif::runtime {

/// Answers batches until none is left to take. `scratch`: null, or a work area.
void take_blocks(NifJobObject& job, void* scratch);

/// Frees an unreferenced job's memory, and releases its reference to the device.
void dispose(NifJobObject& job);

/// Answers a request on the calling thread and its helpers; returns when it is answered.
void answer(NifSceneObject& scene, Request request);

/// Refits the scene's instances that have bent, on the calling thread and its helpers. Allocates nothing.
void refit_together(NifSceneObject& scene);

/// Lets other threads answer a request; if there are none, answers it before returning. Returns the job's
/// handle.
uintptr_t start_job(NifSceneObject& scene, Request request);

}  // namespace nif::runtime
