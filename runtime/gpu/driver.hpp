// The interface between the GPU module and a driver. There are three implementations: CUDA and HIP, both
// loaded on demand (library_driver.hpp), and an emulated GPU for tests (tests/gpu/emulator/driver.cpp).
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "gpu/module.hpp"
#include "nif/nif.h"

namespace nif::gpu {

/// Thrown when a call fails, with the code and the sentence that nifkit's caller gets.
class GpuError : public std::runtime_error {
 public:
  GpuError(NifError code, const std::string& sentence) : std::runtime_error(sentence), code_(code) {}
  NifError code() const { return code_; }

 private:
  NifError code_;
};

/// The driver's handles. A null stream is the driver's default stream.
using Stream = void*;
using Event = void*;
using Kernel = void*;

struct GpuProperties {
  std::string name, target, driver;
  uint64_t memory = 0;
  runtime::GpuLocation place{};
};

enum class PointerKind {
  host,          ///< the GPU cannot read it
  device,        ///< on this GPU
  both,          ///< managed memory, or host memory that the GPU can read
  other_device,  ///< on another GPU
};

struct LaunchShape {
  uint32_t blocks, threads, shared_bytes;
};

/// One open GPU. Only a thread that has entered it (see Current) may make the other calls. They throw
/// GpuError.
class Context {
 public:
  virtual ~Context() = default;

  virtual void enter() = 0;
  virtual void leave() noexcept = 0;

  virtual Kernel find_kernel(const char* name) = 0;
  /// Copies `arguments` before it returns. The grid may have up to 2^31 - 1 blocks.
  virtual void launch(Kernel kernel, const LaunchShape& shape, Stream stream, void** arguments) = 0;
  /// Most rays of one launch, a multiple of 8.
  virtual uint32_t most_rays() const { return 1u << 30; }
  /// The number of multiprocessors or compute units.
  virtual uint32_t processors() const = 0;

  /// Returns memory aligned to 256 bytes.
  virtual void* allocate(size_t bytes) = 0;
  virtual void free(void* memory) noexcept = 0;
  /// Returns pinned host memory: copies to and from it need no second copy.
  virtual void* allocate_host(size_t bytes) = 0;
  virtual void free_host(void* memory) noexcept = 0;
  /// Copies in the stream's order. The host memory must not change until the stream has done the copy.
  virtual void copy_in(void* to, const void* from, size_t bytes, Stream stream) = 0;
  virtual void copy_out(void* to, const void* from, size_t bytes, Stream stream) = 0;
  /// Sets GPU memory to zeros, in the stream's order.
  virtual void clear(void* memory, size_t bytes, Stream stream) = 0;

  /// A stream that does not wait for the default stream.
  virtual Stream make_stream() = 0;
  virtual void free_stream(Stream stream) noexcept = 0;
  virtual void wait_stream(Stream stream) = 0;
  /// Makes all later work in the stream wait for the event; the host does not wait.
  virtual void hold_back(Stream stream, Event event) = 0;
  /// Does the stream belong to this GPU? The stream must not be null.
  virtual bool owns(Stream stream) = 0;

  /// seconds_between() needs timed events.
  virtual Event make_event(bool timed) = 0;
  virtual void free_event(Event event) noexcept = 0;
  virtual void record(Event event, Stream stream) = 0;
  virtual bool is_done(Event event) = 0;
  virtual void wait(Event event) = 0;
  /// Both events must be recorded and done.
  virtual double seconds_between(Event from, Event to) = 0;

  virtual PointerKind kind_of(const void* pointer) = 0;
};

/// Makes the GPU current for the calling thread, and restores what was current before at the end.
class Current {
 public:
  explicit Current(Context& context) : context_(context) { context.enter(); }
  ~Current() { context_.leave(); }
  Current(const Current&) = delete;
  Current& operator=(const Current&) = delete;

 private:
  Context& context_;
};

/// Does work on the GPU if the driver can still make it current: for freeing things, even after a GPU is
/// lost.
template <class Work>
void where_possible(Context& context, const Work& work) noexcept {
  try {
    const Current current(context);
    work();
  } catch (const GpuError&) {
  }
}

class Driver {
 public:
  virtual ~Driver() = default;
  virtual const char* backend() const = 0;  ///< "cuda" or "hip"
  virtual uint32_t count() = 0;
  virtual GpuProperties describe(uint32_t gpu) = 0;
  /// Says in one sentence why the GPU cannot be used; empty if it can.
  virtual std::string trouble(uint32_t gpu) = 0;
  /// Opens a GPU and loads the kernels. Requires a GPU without trouble.
  virtual std::unique_ptr<Context> open(uint32_t gpu) = 0;
};

struct Drivers {
  std::vector<std::unique_ptr<Driver>> found;  ///< drivers with at least one GPU
  std::string why_none;                        ///< one sentence; empty if there are GPUs
};

/// Looks for drivers and GPUs; every call looks again.
Drivers find_drivers();

}  // namespace nif::gpu
