// Loads a driver's library with dlopen, makes the calls that CUDA and HIP share, and turns their results into
// errors. It knows the results after which a GPU is lost.
#include "library_driver.hpp"

#include <dlfcn.h>

#include <algorithm>
#include <cstdio>

namespace nif::gpu {
namespace {

/// Results after which nothing on the GPU works any more, until the process ends.
bool means_lost(int result) {
  switch (result) {
    case 4:    // deinitialised: the process is ending
    case 46:   // the device is not available
    case 214:  // an uncorrectable memory error
    case 700:  // illegal address, and other faults of kernels
    case 702:
    case 709:
    case 710:
    case 714:
    case 715:
    case 716:
    case 717:
    case 718:
    case 719:
    case 999:   // unknown
    case 1053:  // HSA
      return true;
    default:
      return false;
  }
}

}  // namespace

Library::Library(std::initializer_list<const char*> names) {
  for (const char* name : names) {
    handle_ = dlopen(name, RTLD_NOW | RTLD_LOCAL);
    name_ = name;
    if (handle_) return;
  }
}

void* Library::find(const char* name) const { return handle_ ? dlsym(handle_, name) : nullptr; }

runtime::GpuLocation PlaceCalls::ask(int device) const {
  runtime::GpuLocation place{};
  char text[32] = "";
  if (pci_bus_id && pci_bus_id(text, sizeof(text), device) == kSuccess)  // domain:bus:device.function
    std::sscanf(text, "%x:%x:%x", &place.pci_domain, &place.pci_bus, &place.pci_device);
  if (uuid && uuid(place.uuid, device) != kSuccess) std::fill(place.uuid, place.uuid + 16, uint8_t{0});
  unsigned mask = 0;
  place.has_luid = luid && luid(place.luid, &mask, device) == kSuccess;
  if (!place.has_luid) std::fill(place.luid, place.luid + 8, uint8_t{0});
  return place;
}

void LibraryContext::check(int result, const char* doing) const {
  if (result == kSuccess) return;
  const std::string sentence = std::string("GPU: ") + doing + ": " + text_of(result);
  if (result == kOutOfMemory || result == 1052) throw GpuError(NIF_ERROR_OUT_OF_DEVICE_MEMORY, sentence);
  if (means_lost(result)) throw GpuError(NIF_ERROR_DEVICE_LOST, sentence);
  throw GpuError(NIF_ERROR_UNKNOWN, sentence);
}

int LibraryContext::load_image(const void* image) { return calls_.load_module(&module_, image); }

void LibraryContext::unload_image() noexcept {
  if (module_) calls_.unload_module(module_);
}

Kernel LibraryContext::find_kernel(const char* name) {
  void* kernel = nullptr;
  check(calls_.get_function(&kernel, module_, name), "finding a kernel");
  return kernel;
}

void LibraryContext::launch(Kernel kernel, const LaunchShape& shape, Stream stream, void** arguments) {
  check(calls_.launch(kernel, shape.blocks, 1, 1, shape.threads, 1, 1, shape.shared_bytes, stream, arguments,
                      nullptr),
        "starting a kernel");
}

void* LibraryContext::allocate(size_t bytes) {
  void* memory = nullptr;
  check(calls_.allocate(&memory, bytes), "taking memory");
  return memory;
}

void* LibraryContext::allocate_host(size_t bytes) {
  void* memory = nullptr;
  check(calls_.allocate_host(&memory, bytes, 0), "taking host memory");
  return memory;
}

void LibraryContext::copy_in(void* to, const void* from, size_t bytes, Stream stream) {
  check(calls_.copy_in(to, from, bytes, stream), "copying to the GPU");
}

void LibraryContext::copy_out(void* to, const void* from, size_t bytes, Stream stream) {
  check(calls_.copy_out(to, from, bytes, stream), "copying from the GPU");
}

Stream LibraryContext::make_stream() {
  void* stream = nullptr;
  check(calls_.make_stream(&stream, kNonBlocking), "making a stream");
  return stream;
}

void LibraryContext::clear(void* memory, size_t bytes, Stream stream) {
  check(calls_.clear(reinterpret_cast<uint64_t>(memory), 0, bytes, stream), "clearing memory of the GPU");
}

void LibraryContext::hold_back(Stream stream, Event event) {
  check(calls_.hold_back(stream, event, 0), "holding back a stream");
}

void LibraryContext::wait_stream(Stream stream) { check(calls_.wait_stream(stream), "waiting for a stream"); }

Event LibraryContext::make_event(bool timed) {
  void* event = nullptr;
  check(calls_.make_event(&event, timed ? 0 : kNoTiming), "making an event");
  return event;
}

void LibraryContext::record(Event event, Stream stream) {
  check(calls_.record(event, stream), "recording an event");
}

bool LibraryContext::is_done(Event event) {
  const int result = calls_.query_event(event);
  if (result == kNotReady) return false;
  check(result, "asking for an event");
  return true;
}

void LibraryContext::wait(Event event) { check(calls_.wait_event(event), "waiting for an event"); }

double LibraryContext::seconds_between(Event from, Event to) {
  float milliseconds = 0;
  check(calls_.elapsed(&milliseconds, from, to), "reading events");
  return double(milliseconds) * 1e-3;
}

}  // namespace nif::gpu
