// Runs the device's threads. One lock guards which thread works on which job; it is taken a few times per
// job, not per batch.
#include "query/thread_pool.hpp"

#include <system_error>

#include "api/device.hpp"
#include "api/error.hpp"
#include "scene/scene.hpp"

namespace nif::runtime {
namespace {

/// Set on a thread that has destroyed its own pool: it must not touch the pool any more.
thread_local bool pool_is_gone = false;

}  // namespace

ThreadPool::ThreadPool(uint32_t threads, std::pmr::memory_resource* memory) : threads_(memory) {
  threads_.reserve(threads);
  try {
    for (uint32_t i = 0; i < threads; ++i) threads_.emplace_back([this] { work(); });
  } catch (const std::system_error& error) {
    stop();
    throw Failure(NIF_ERROR_OUT_OF_MEMORY, "configuration: only " + std::to_string(threads_.size()) +
                                               " threads of threads=" + std::to_string(threads + 1) +
                                               " could be started: " + error.what());
  } catch (...) {
    stop();
    throw;
  }
}

ThreadPool::~ThreadPool() { stop(); }

void ThreadPool::stop() {
  {
    const Lock lock(mutex_);
    stopping_ = true;
    offered_.notify_all();
  }
  for (std::thread& thread : threads_) {
    if (thread.get_id() == std::this_thread::get_id()) {
      pool_is_gone = true;
      thread.detach();
    } else {
      thread.join();
    }
  }
}

void ThreadPool::work() {
  for (;;) {
    NifJobObject* job;
    {
      Lock lock(mutex_);
      offered_.wait(lock, [&] { return first_ || stopping_; });
      if (stopping_) return;
      job = first_;
      job->retain();
      ++job->inside;
    }
    take_blocks(*job, nullptr);
    leave_and_drop(*job);
    if (pool_is_gone) return;
  }
}

void ThreadPool::offer(NifJobObject& job) {
  const Lock lock(mutex_);
  job.retain();
  job.queued = true;
  job.following = nullptr;
  NifJobObject** last = &first_;
  while (*last) last = &(*last)->following;
  *last = &job;
  offered_.notify_all();
}

/// Threads leave a job only when no batch is left to take, so it can leave the queue too.
void ThreadPool::leave(NifJobObject& job, const Lock&) {
  if (job.queued) {
    NifJobObject** at = &first_;
    while (*at != &job) at = &(*at)->following;
    *at = job.following;
    job.queued = false;
    job.drop();  // never the last reference: the leaving thread has one too
  }
  if (--job.inside == 0) left_.notify_all();
}

void ThreadPool::help(NifJobObject& job, void* scratch) {
  {
    const Lock lock(mutex_);
    ++job.inside;
  }
  take_blocks(job, scratch);
  const Lock lock(mutex_);
  leave(job, lock);
}

void ThreadPool::help_and_drop(NifJobObject& job) {
  {
    const Lock lock(mutex_);
    ++job.inside;
  }
  take_blocks(job, nullptr);
  leave_and_drop(job);
}

/// Does both under one lock: a thread that waited for this one to leave may rely on its being done with the
/// job.
void ThreadPool::leave_and_drop(NifJobObject& job) {
  NifSceneObject* scene = nullptr;
  bool last;
  {
    const Lock lock(mutex_);
    leave(job, lock);
    if (!job.has_handle) scene = job.take_scene();
    last = job.drop();
  }
  release(scene);
  if (last) dispose(job);
}

void ThreadPool::wait_until_left(NifJobObject& job, Lock& lock) {
  left_.wait(lock, [&] { return job.inside == 0 && job.is_done(); });
}

void ThreadPool::finish(NifJobObject& job, void* scratch) {
  help(job, scratch);
  NifSceneObject* scene;
  {
    Lock lock(mutex_);
    wait_until_left(job, lock);
    scene = job.take_scene();
  }
  release(scene);
}

void ThreadPool::cancel(NifJobObject& job) {
  const Lock lock(mutex_);  // threads that wait for the job check it under this lock too
  const uint64_t taken = job.next.exchange(job.batches);
  if (taken >= job.batches) return;
  job.cancelled = true;
  job.done.fetch_add(job.batches - taken);
  left_.notify_all();
}

void ThreadPool::drop_handle(NifJobObject& job) {
  NifSceneObject* scene = nullptr;
  bool last;
  {
    Lock lock(mutex_);
    job.has_handle = false;
    if (job.is_done()) wait_until_left(job, lock);
    scene = job.take_scene();
    last = job.drop();
  }
  release(scene);
  if (last) dispose(job);
}

}  // namespace nif::runtime
