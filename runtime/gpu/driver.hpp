// What the GPU module asks of a driver. There are three of them: CUDA's and HIP's, both loaded on demand
// (library_driver.hpp), and, for tests, one that emulates a card (tests/gpu/emulator/driver.cpp).
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

/// A call that failed: what the caller of nifkit gets to see.
class GpuError : public std::runtime_error {
 public:
  GpuError(NifError code, const std::string& sentence) : std::runtime_error(sentence), code_(code) {}
  NifError code() const { return code_; }

 private:
  NifError code_;
};

/// Handles of the driver. A null stream is the driver's default stream.
using Stream = void*;
using Event = void*;
using Kernel = void*;

struct CardDescription {
  std::string name, target, driver;
  uint64_t memory = 0;
  runtime::GpuCardPlace place{};
};

enum class PointerKind {
  host,          ///< the card cannot read it
  device,        ///< of this card
  both,          ///< managed, or host memory that the card can read
  other_device,  ///< of another card
};

struct LaunchShape {
  uint32_t blocks, threads, shared_bytes;
};

/// One card. All calls but those of Current are for the thread that has entered it; they throw GpuError.
class Context {
 public:
  virtual ~Context() = default;

  virtual void enter() = 0;
  virtual void leave() noexcept = 0;

  virtual Kernel find_kernel(const char* name) = 0;
  /// `arguments` are copied at once. The grid may have 2^31 - 1 blocks.
  virtual void launch(Kernel kernel, const LaunchShape& shape, Stream stream, void** arguments) = 0;
  /// Rays of one launch at most, a multiple of 8.
  virtual uint32_t most_rays() const { return 1u << 30; }
  /// Multiprocessors, compute units.
  virtual uint32_t processors() const = 0;

  /// At a multiple of 256.
  virtual void* allocate(size_t bytes) = 0;
  virtual void free(void* memory) noexcept = 0;
  /// Host memory that copies need no second copy for.
  virtual void* allocate_host(size_t bytes) = 0;
  virtual void free_host(void* memory) noexcept = 0;
  /// In the stream's order. The host's memory stays as it is until the stream has come so far.
  virtual void copy_in(void* to, const void* from, size_t bytes, Stream stream) = 0;
  virtual void copy_out(void* to, const void* from, size_t bytes, Stream stream) = 0;
  /// Sets memory of the card to zeros, in the stream's order.
  virtual void clear(void* memory, size_t bytes, Stream stream) = 0;

  /// A stream that does not wait for the default stream.
  virtual Stream make_stream() = 0;
  virtual void free_stream(Stream stream) noexcept = 0;
  virtual void wait_stream(Stream stream) = 0;
  /// What is put into the stream from now on comes after the event; the host does not wait.
  virtual void hold_back(Stream stream, Event event) = 0;
  /// Whether the stream is of this card. Not asked of null.
  virtual bool owns(Stream stream) = 0;

  /// Timed: for seconds_between().
  virtual Event make_event(bool timed) = 0;
  virtual void free_event(Event event) noexcept = 0;
  virtual void record(Event event, Stream stream) = 0;
  virtual bool is_done(Event event) = 0;
  virtual void wait(Event event) = 0;
  /// Both are recorded and done.
  virtual double seconds_between(Event from, Event to) = 0;

  virtual PointerKind kind_of(const void* pointer) = 0;
};

/// For its lifetime, the calling thread works on the card; afterwards on whatever it did before.
class Current {
 public:
  explicit Current(Context& context) : context_(context) { context.enter(); }
  ~Current() { context_.leave(); }
  Current(const Current&) = delete;
  Current& operator=(const Current&) = delete;

 private:
  Context& context_;
};

/// Does work on the card, where the driver still turns to it: for what is given back, also after a card is
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
  virtual CardDescription describe(uint32_t card) = 0;
  /// Why the card cannot be used, as a sentence; empty where it can.
  virtual std::string trouble(uint32_t card) = 0;
  /// With the kernels loaded. Only of a card without trouble.
  virtual std::unique_ptr<Context> open(uint32_t card) = 0;
};

struct Drivers {
  std::vector<std::unique_ptr<Driver>> found;  ///< those that have cards
  std::string why_none;                        ///< a sentence; empty where there are cards
};

/// Looks for drivers and cards anew.
Drivers find_drivers();

}  // namespace nif::gpu
