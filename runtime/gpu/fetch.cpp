// Copies arrays of the caller's from the GPU to host memory in the caller's stream, so that they are read after what
// writes them and before what the caller does to them next. The host waits only where it wants to read.
#include <algorithm>

#include "device.hpp"

namespace nif::runtime {

GpuFetch::~GpuFetch() {
  try {
    if (under_way) context.wait(arrived);
  } catch (const gpu::GpuError&) {  // lost: nothing writes any more
  }
  context.free_event(arrived);
  if (host) context.free_host(host);
}

}  // namespace nif::runtime

namespace nif::gpu {
namespace {

using runtime::FetchedArray;
using runtime::GpuFetch;

/// Keeps nothing of what it has.
void grow(Context& context, GpuFetch& fetch, uint64_t bytes) {
  auto* const larger = static_cast<unsigned char*>(context.allocate_host(bytes));
  try {
    if (fetch.under_way) context.wait(fetch.arrived);
  } catch (...) {
    context.free_host(larger);
    throw;
  }
  fetch.under_way = fetch.whole = false;
  if (fetch.host) context.free_host(fetch.host);
  fetch.host = larger;
  fetch.capacity = bytes;
}

}  // namespace

void put_copies(GpuDevice& device, std::span<const FetchedArray> arrays, Stream stream, GpuFetch*& fetch) {
  Context& context = *device.context;
  uint64_t bytes = 0;
  for (const FetchedArray& one : arrays) {
    check_array(context, NIF_MEMORY_DEVICE, one.array, one.name);
    bytes += one.bytes;
  }
  check_stream(context, stream, "pose");
  std::unique_ptr<GpuFetch> made;
  if (!fetch) made = std::make_unique<GpuFetch>(context);
  GpuFetch& to = made ? *made : *fetch;
  if (bytes > to.capacity) grow(context, to, bytes);
  // What another stream still copies must not come later.
  if (to.under_way) context.hold_back(stream, to.arrived);
  to.whole = false;
  to.under_way = true;
  try {
    uint64_t at = 0;
    for (const FetchedArray& one : arrays) {
      if (one.bytes > 0) context.copy_out(to.host + at, one.array, one.bytes, stream);
      at += one.bytes;
    }
    context.record(to.arrived, stream);
  } catch (...) {
    // Some copies may be under way, and the event does not come after them.
    try {
      context.wait_stream(stream);
      to.under_way = false;
    } catch (const GpuError&) {
    }
    throw;
  }
  to.whole = true;
  if (made) fetch = made.release();
}

const unsigned char* wait_for_copies(GpuDevice& device, GpuFetch& fetch) {
  if (!fetch.whole) throw GpuError(NIF_ERROR_UNKNOWN, "GPU: a later copy of the pose has failed");
  if (fetch.under_way) device.context->wait(fetch.arrived);
  fetch.under_way = false;
  return fetch.host;
}

}  // namespace nif::gpu
