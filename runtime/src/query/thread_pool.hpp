// The device's own threads, and which of them work on which job.
#pragma once

#include <condition_variable>
#include <memory_resource>
#include <mutex>
#include <thread>
#include <vector>

#include "query/job.hpp"

namespace nif::runtime {

class ThreadPool {
 public:
  /// Starts the threads. They sleep while there is nothing to do.
  ThreadPool(uint32_t threads, std::pmr::memory_resource* memory);
  ThreadPool(const ThreadPool&) = delete;
  ThreadPool& operator=(const ThreadPool&) = delete;
  /// No job may be left. May be called on one of the pool's own threads, where that gave back the last
  /// reference to the device.
  ~ThreadPool();

  bool empty() const { return threads_.empty(); }

  /// Lets the threads work on a job, which needs no waiting for.
  void offer(NifJobObject& job);

  /// Works on a job until no batch is left to be taken. `scratch`: null, or a work area.
  void help(NifJobObject& job, void* scratch);

  /// Helps, then waits until the job is done and nobody else works on it any more.
  void finish(NifJobObject& job, void* scratch);

  /// help(), after which the caller's reference to the job is given back.
  void help_and_drop(NifJobObject& job);

  /// Leaves out the batches that nobody has taken. Not for jobs on a GPU.
  void cancel(NifJobObject& job);

  /// The caller's handle is gone: its reference is given back; of a job that is done, after everyone has left
  /// it, so that nothing happens behind the caller's back.
  void drop_handle(NifJobObject& job);

 private:
  using Lock = std::unique_lock<std::mutex>;
  void stop();
  void work();
  void leave(NifJobObject& job, const Lock&);
  void leave_and_drop(NifJobObject& job);
  void wait_until_left(NifJobObject& job, Lock& lock);

  std::mutex mutex_;
  std::condition_variable offered_, left_;
  NifJobObject* first_ = nullptr;  ///< the queue: jobs that may have batches to be taken
  bool stopping_ = false;
  std::pmr::vector<std::thread> threads_;
};

}  // namespace nif::runtime
