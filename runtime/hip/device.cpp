#include "device.hpp"

namespace nif::gpu {

Staging::Staging(Context& context) : context_(context), card_(context, kBytes) {
  host_ = static_cast<unsigned char*>(context.allocate_host(kBytes));
  try {
    stream_ = context.make_stream();
  } catch (...) {
    context.free_host(host_);
    throw;
  }
}

Staging::~Staging() {
  context_.free_stream(stream_);
  context_.free_host(host_);
}

}  // namespace nif::gpu

namespace nif::runtime {

using kernels::hip::kAnyKind;
using kernels::hip::kBvhObject;
using kernels::hip::kPairSegment;

GpuDevice::GpuDevice(std::unique_ptr<gpu::Context> opened) : context(std::move(opened)) {
  const gpu::Current current(*context);
  const auto find = [&](uint32_t kinds, const char* visible, const char* details) {
    return gpu::SceneKernels{kinds, context->find_kernel(visible), context->find_kernel(details)};
  };
  kernels[0] = find(kPairSegment, "nif_scene_segment", "nif_scene_segment_details");
  kernels[1] = find(kBvhObject, "nif_scene_bvh", "nif_scene_bvh_details");
  kernels[2] = find(kAnyKind, "nif_scene_any", "nif_scene_any_details");
  uploads = context->make_stream();
}

GpuDevice::~GpuDevice() {
  gpu::where_possible(*context, [&] {
    stagings.clear();
    context->free_stream(uploads);
  });
}

}  // namespace nif::runtime
