// What tests say to, and learn from, the GPU module of an emulated machine (emulated_driver.cpp). The module
// is a shared library of its own, loaded by the runtime as the real one is; tests get its machine by
// emulated_machine().
#pragma once

#include <dlfcn.h>

#include <atomic>
#include <cstdint>
#include <stdexcept>
#include <string>

namespace nif::test {

/// A machine with emulated cards of two makes: card 0 has waves of 32 lanes, card 1 of 64. Streams are
/// queues: what is put into one is done when somebody waits for it or asks an event that was recorded there,
/// and not before, so that waiting behind the caller's back shows.
struct EmulatedMachine {
  // What the machine is like. To be set while no device is open.
  bool no_driver = false, driver_too_old = false;
  uint32_t cards = 2;
  bool no_image = false;  ///< for any card

  // Faults. Counted down with each such call; the call that finds 1 fails. 0: never.
  std::atomic<uint32_t> fail_allocation = 0;  ///< memory of a card
  std::atomic<uint32_t> fail_launch = 0;      ///< and with it the card is lost
  std::atomic<bool> lost = false;             ///< every call fails

  uint32_t most_rays = 1u << 20;  ///< of one launch; a multiple of 8
  uint64_t order = 0;             ///< of threads, see EmulatedGrid
  bool discard = false;           ///< launches do nothing

  // What was done.
  std::atomic<uint32_t> launches = 0;             ///< put into streams
  std::atomic<uint64_t> rays_launched = 0;        ///< their rays
  std::atomic<uint32_t> allocations = 0;          ///< of cards' memory that are not freed
  std::atomic<uint64_t> allocated = 0;            ///< their bytes
  std::atomic<uint32_t> uploads = 0;              ///< copies to a card
  std::atomic<uint32_t> waits = 0;                ///< for streams and events
  std::atomic<uint32_t> streams = 0, events = 0;  ///< that are not freed

  // What a program would get from the driver itself.
  void* (*allocate)(uint32_t card, uint64_t bytes) = nullptr;
  void (*free)(void* memory) = nullptr;
  void* (*make_stream)(uint32_t card) = nullptr;
  void (*free_stream)(void* stream) = nullptr;
  void (*wait_stream)(void* stream) = nullptr;
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
