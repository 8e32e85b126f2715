// The device's thread pool: its own threads, and which of them work on which job.
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
  /// Starts the threads, which sleep until there is work.
  ThreadPool(uint32_t threads, std::pmr::memory_resource* memory);
  ThreadPool(const ThreadPool&) = delete;
  ThreadPool& operator=(const ThreadPool&) = delete;
  /// No job may be left. May run on one of the pool's own threads, if that released the last reference to the
  /// device.
  ~ThreadPool();

  bool empty() const { return threads_.empty(); }

  /// Lets the threads work on a job. Nobody needs to wait for it.
  void offer(NifJobObject& job);

  /// Works on a job until no batch is left to take. `scratch`: null, or a work area.
  void help(NifJobObject& job, void* scratch);

  /// Helps, then waits until the job is done and no other thread works on it.
  void finish(NifJobObject& job, void* scratch);

  /// Like help(), then releases the caller's reference to the job.
  void help_and_drop(NifJobObject& job);

  /// Skips the batches that no thread has taken. Not for jobs on a GPU.
  void cancel(NifJobObject& job);

  /// Releases the reference of the caller's last handle. If the job is done, first waits until all threads
  /// have left it, so that nothing happens behind the caller's back.
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
  NifJobObject* first_ = nullptr;  ///< the queue: jobs that may have batches left to take
  bool stopping_ = false;
  std::pmr::vector<std::thread> threads_;
};

}  // namespace nif::runtime
