// What tests say to, and learn from, the GPU module of an emulated machine (driver.cpp). The module
// is a shared library of its own, loaded by the runtime as the real one is; tests get its machine by
// emulated_machine().
#pragma once

#include <dlfcn.h>

#include <atomic>
#include <cstdint>
#include <functional>
#include <stdexcept>
#include <string>

namespace nif::test {

/// Matrix instructions that a GPU has, and the lanes of its waves: those of gfx1100, NVIDIA, gfx90a and
/// gfx942, or only dot products.
enum class MatrixKind : uint32_t { wmma, imma, mfma16, mfma32, dot32, dot64 };
inline constexpr MatrixKind kMatrixKinds[] = {MatrixKind::wmma,   MatrixKind::imma,  MatrixKind::mfma16,
                                              MatrixKind::mfma32, MatrixKind::dot32, MatrixKind::dot64};
constexpr const char* name_of(MatrixKind kind) {
  constexpr const char* kNames[] = {"wmma", "imma", "mfma16", "mfma32", "dot32", "dot64"};
  return kNames[uint32_t(kind)];
}
constexpr uint32_t wave_of(MatrixKind kind) {
  return kind == MatrixKind::mfma16 || kind == MatrixKind::mfma32 || kind == MatrixKind::dot64 ? 64 : 32;
}

/// A machine with emulated GPUs, one for each of kMatrixKinds where nobody asks for fewer. Streams are
/// queues: what is put into one is done when somebody waits for it or asks an event that was recorded there,
/// and not before, so that waiting behind the caller's back shows.
struct EmulatedMachine {
  // What the machine is like. To be set while no device is open.
  bool no_driver = false, driver_too_old = false;
  uint32_t gpus = 6;
  bool no_image = false;  ///< for any GPU
  bool no_place = false;  ///< drivers do not say where a GPU is, nor its UUID

  // Faults. Counted down with each such call; the call that finds 1 fails. 0: never.
  std::atomic<uint32_t> fail_allocation = 0;  ///< memory of a GPU
  std::atomic<uint32_t> fail_pinning = 0;     ///< host memory
  std::atomic<uint32_t> fail_copy_out = 0;    ///< from a GPU
  std::atomic<uint32_t> fail_launch = 0;      ///< and with it the GPU is lost
  std::atomic<uint32_t> fail_asking = 0;      ///< whether an event is done
  std::atomic<uint32_t> fail_record = 0;      ///< of an event
  std::atomic<bool> lost = false;             ///< every call fails

  uint32_t most_rays = 1u << 20;       ///< of one launch; a multiple of 8
  uint64_t order = 0;                  ///< of threads, see EmulatedGrid
  bool discard = false;                ///< launches do nothing
  const char* defective = "";          ///< a kernel's name: it is run without some barriers
  bool without_odd_syncs = false;      ///< which ones, see LeftOut
  uint32_t processors = 3;             ///< few, so that threads go round
  uint32_t seconds_of_one_kernel = 0;  ///< for all of a query's rays, by the GPU's clock

  // What was done.
  std::atomic<uint32_t> launches = 0;             ///< put into streams
  std::atomic<uint64_t> rays_launched = 0;        ///< of those that take a query's rays
  std::atomic<uint32_t> pipelined = 0;            ///< launches of the pipeline
  std::atomic<uint32_t> allocations = 0;          ///< of GPUs' memory that are not freed
  std::atomic<uint64_t> allocated = 0;            ///< their bytes
  std::atomic<uint32_t> uploads = 0;              ///< copies to a GPU
  std::atomic<uint32_t> pinnings = 0;             ///< of host memory, ever
  std::atomic<uint32_t> pinned = 0;               ///< those that are not freed
  std::atomic<uint32_t> waits = 0;                ///< of the host for streams and events
  std::atomic<uint32_t> held_back = 0;            ///< streams that were made to wait for events
  std::atomic<uint32_t> streams = 0, events = 0;  ///< that are not freed

  // What a program would get from the driver itself.
  void* (*allocate)(uint32_t gpu, uint64_t bytes) = nullptr;
  void* (*allocate_managed)(uint32_t gpu, uint64_t bytes) = nullptr;
  void (*free)(void* memory) = nullptr;
  void* (*make_stream)(uint32_t gpu) = nullptr;
  void (*free_stream)(void* stream) = nullptr;
  void (*wait_stream)(void* stream) = nullptr;
  /// A kernel of the program's own.
  void (*launch)(void* stream, std::function<void()> kernel) = nullptr;
};

/// Of the module in this file.
inline EmulatedMachine& emulated_machine(const std::string& module) {
  void* library = dlopen(module.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (!library) throw std::runtime_error(dlerror());
  using Entry = EmulatedMachine* (*)();
  const auto entry = reinterpret_cast<Entry>(dlsym(library, "nif_emulated_machine"));
  if (!entry) throw std::runtime_error(module + " is no emulated machine");
  return *entry();
}

}  // namespace nif::test
