// Acquires and frees what an open GPU keeps: kernels found by name, a stream, staging memory. If acquiring
// fails halfway, everything acquired before is freed.
#include "device.hpp"

#include "query/outputs.hpp"

namespace nif::gpu {
namespace {

constexpr size_t kStagingBytes = Staging::kInputBytes + runtime::output_bytes(Staging::kRays);

}  // namespace

Staging::Staging(Context& context) : context_(context), gpu_(context, kStagingBytes) {
  try {
    host_ = static_cast<unsigned char*>(context.allocate_host(kStagingBytes));
    stream_ = context.make_stream();
    answered_ = context.make_event(false);
  } catch (...) {
    release();
    throw;
  }
}

Staging::~Staging() { release(); }

void Staging::release() noexcept {
  if (answered_) context_.free_event(answered_);
  if (stream_) context_.free_stream(stream_);
  if (host_) context_.free_host(host_);
}

}  // namespace nif::gpu

namespace nif::runtime {

namespace {
gpu::PipelineKernels find_pipeline(gpu::Context& context) {
  const gpu::Current current(context);
  return gpu::PipelineKernels(context);
}
}  // namespace

GpuDevice::GpuDevice(std::unique_ptr<gpu::Context> opened, const GpuSettings& wanted)
    : context(std::move(opened)), settings(wanted), pipeline(find_pipeline(*context)), scratch(*context) {
  const gpu::Current current(*context);
#define NIF_SCENE(name, kinds, blocks) \
  kernels.emplace_back(*context, kernels::gpu::kinds, "nif_scene_" #name);
  NIF_SCENE_KERNELS(NIF_SCENE)
#undef NIF_SCENE
  single_bvh = context->find_kernel("nif_scene_bvh_single");
  open[0] = context->find_kernel("nif_scene_open");
  open[1] = context->find_kernel("nif_scene_open_holes");
  hits[0] = context->find_kernel("nif_scene_hits");
  hits[1] = context->find_kernel("nif_scene_hits_holes");
  uploads = context->make_stream();
}

GpuDevice::~GpuDevice() {
  gpu::where_possible(*context, [&] {
    stagings.clear();
    scratch.clear();
    context->free_stream(uploads);
  });
}

}  // namespace nif::runtime
