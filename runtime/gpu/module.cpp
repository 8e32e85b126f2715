// Implements the table of functions for the runtime, and turns exceptions into codes and sentences.
#include <cstdio>
#include <new>

#include "device.hpp"
#include "gpu/crossing.hpp"

namespace nif::gpu {
namespace {

using runtime::FetchedArray;
using runtime::GpuDescription;
using runtime::GpuFetch;
using runtime::GpuJob;
using runtime::GpuMeasure;
using runtime::GpuMessage;
using runtime::GpuModule;
using runtime::GpuSettings;

NifError say(GpuMessage* message, NifError code, const char* sentence) {
  std::snprintf(message->text, sizeof(message->text), "%s", sentence);
  return code;
}

template <class Call>
NifError guarded(GpuMessage* message, const Call& call) noexcept {
  try {
    call();
    return NIF_OK;
  } catch (const GpuError& error) {
    return say(message, error.code(), error.what());
  } catch (const std::bad_alloc&) {
    return say(message, NIF_ERROR_OUT_OF_MEMORY, "out of memory");
  } catch (const std::exception& error) {
    return say(message, NIF_ERROR_UNKNOWN, error.what());
  }
}

/// The same on a GPU, which fails if the GPU is lost.
template <class Call>
NifError on_gpu(GpuDevice* device, GpuMessage* message, const Call& call) noexcept {
  if (device->lost) return say(message, NIF_ERROR_DEVICE_LOST, "GPU: it was lost before; make a new device");
  const NifError code = guarded(message, [&] {
    const Current current(*device->context);
    call();
  });
  if (code == NIF_ERROR_DEVICE_LOST) device->lost = true;
  return code;
}

/// A GPU's driver, and the GPU's number in it.
struct FoundGpu {
  Driver* driver;
  uint32_t number;
};
FoundGpu find_gpu(const Drivers& drivers, uint32_t gpu) {
  uint32_t first = 0;
  for (const auto& driver : drivers.found) {
    const uint32_t count = driver->count();
    if (gpu - first < count) return {driver.get(), gpu - first};
    first += count;
  }
  if (drivers.found.empty()) throw GpuError(NIF_ERROR_NOT_AVAILABLE, drivers.why_none);
  throw GpuError(NIF_ERROR_NOT_AVAILABLE,
                 "there is no GPU " + std::to_string(gpu) + "; the drivers find " + std::to_string(first));
}

uint32_t count_gpus(GpuMessage* why_none) {
  uint32_t count = 0;
  guarded(why_none, [&] {
    const Drivers drivers = find_drivers();
    for (const auto& driver : drivers.found) count += driver->count();
    say(why_none, NIF_OK, drivers.why_none.c_str());
  });
  return count;
}

NifError describe_gpu(uint32_t gpu, GpuDescription* about, GpuMessage* message) {
  return guarded(message, [&] {
    const Drivers drivers = find_drivers();
    const FoundGpu found = find_gpu(drivers, gpu);
    const GpuProperties description = found.driver->describe(found.number);
    const auto copy = [](auto& to, const std::string& from) {
      std::snprintf(to, sizeof(to), "%s", from.c_str());
    };
    copy(about->backend, found.driver->backend());
    copy(about->name, description.name);
    copy(about->target, description.target);
    copy(about->driver, description.driver);
    about->memory = description.memory;
    about->place = description.place;
    copy(about->trouble.text, found.driver->trouble(found.number));
  });
}

NifError open_device(uint32_t gpu, const GpuSettings* settings, GpuDevice** device, GpuMessage* message) {
  return guarded(message, [&] {
    const Drivers drivers = find_drivers();
    const FoundGpu found = find_gpu(drivers, gpu);
    const std::string trouble = found.driver->trouble(found.number);
    if (!trouble.empty()) throw GpuError(NIF_ERROR_NOT_AVAILABLE, trouble);
    *device = new GpuDevice(found.driver->open(found.number), *settings);
  });
}

void close_device(GpuDevice* device) { delete device; }

NifError upload_asset(GpuDevice* device, const kernels::AnyField* objects, const kernels::HitDetails* details,
                      uint32_t count, GpuAsset** asset, uint64_t* bytes, GpuMessage* message) {
  return on_gpu(device, message, [&] {
    *asset = copy_asset(*device, objects, details, count).release();
    *bytes = (*asset)->memory.bytes();
  });
}

void free_asset(GpuDevice* device, GpuAsset* asset) {
  where_possible(*device->context, [&] { delete asset; });
}

NifError upload_scene(GpuDevice* device, const GpuSceneView* view, GpuScene** scene, GpuMessage* message) {
  return on_gpu(device, message, [&] {
    std::unique_ptr<GpuScene> made;
    if (!*scene) made = std::make_unique<GpuScene>();
    copy_scene(*device, *view, made ? *made : **scene);
    if (made) *scene = made.release();
  });
}

void free_scene(GpuDevice* device, GpuScene* scene) {
  if (!scene) return;
  where_possible(*device->context, [&] {
    const std::unique_ptr<GpuScene> owned(scene);
    wait_for_queries(*device, *owned);
    owned->choice.clear();
  });
}

NifError query(GpuDevice* device, GpuScene* scene, const NifRays* rays, const NifAnswers* answers,
               GpuMessage* message) {
  return on_gpu(device, message, [&] { answer_query(*device, *scene, *rays, *answers); });
}

NifError query_open(GpuDevice* device, GpuScene* scene, const NifRays* rays, const NifAnswers* answers,
                    const NifOpenRays* open, GpuMessage* message) {
  return on_gpu(device, message, [&] { list_open_rays(*device, *scene, *rays, *answers, *open); });
}

NifError intersect(GpuDevice* device, GpuScene* scene, const NifRays* rays, const NifHits* hits,
                   GpuMessage* message) {
  return on_gpu(device, message, [&] { find_hits(*device, *scene, *rays, *hits); });
}

NifError check_host_query(GpuDevice* device, const NifRays* rays, const NifAnswers* answers,
                          const NifOpenRays* open, const NifHits* hits, GpuMessage* message) {
  return on_gpu(device, message, [&] { check_for_cpu(*device, *rays, *answers, open, hits); });
}

NifError check_host_array(GpuDevice* device, const void* array, const char* name, GpuMessage* message) {
  return on_gpu(device, message, [&] { check_for_cpu(*device, array, name); });
}

NifError fetch_arrays(GpuDevice* device, const FetchedArray* arrays, uint32_t count, void* stream,
                      GpuFetch** fetch, GpuMessage* message) {
  return on_gpu(device, message, [&] { put_copies(*device, std::span(arrays, count), stream, *fetch); });
}

NifError wait_fetch(GpuDevice* device, GpuFetch* fetch, const unsigned char** bytes, GpuMessage* message) {
  return on_gpu(device, message, [&] { *bytes = wait_for_copies(*device, *fetch); });
}

void free_fetch(GpuDevice* device, GpuFetch* fetch) {
  if (!fetch) return;
  where_possible(*device->context, [&] { delete fetch; });
}

NifError measure_query(GpuDevice* device, GpuScene* scene, const NifRays* rays, const NifAnswers* answers,
                       GpuMeasure measure, uint32_t rounds, double* seconds, GpuMessage* message) {
  return on_gpu(device, message,
                [&] { time_query(*device, *scene, *rays, *answers, measure, rounds, seconds); });
}

NifError start_query(GpuDevice* device, GpuScene* scene, const NifRays* rays, const NifAnswers* answers,
                     const NifHits* hits, GpuJob** job, GpuMessage* message) {
  return on_gpu(device, message, [&] {
    auto made = std::make_unique<GpuJob>();
    made->event = device->context->make_event(false);
    try {
      if (hits)
        find_hits(*device, *scene, *rays, *hits);
      else
        answer_query(*device, *scene, *rays, *answers);
      device->context->record(made->event, rays->stream);
    } catch (...) {
      device->context->free_event(made->event);
      throw;
    }
    *job = made.release();
  });
}

NifError wait_job(GpuDevice* device, GpuJob* job, GpuMessage* message) {
  return on_gpu(device, message, [&] { device->context->wait(job->event); });
}

NifError is_job_done(GpuDevice* device, GpuJob* job, uint32_t* done, GpuMessage* message) {
  return on_gpu(device, message, [&] { *done = device->context->is_done(job->event); });
}

void free_job(GpuDevice* device, GpuJob* job) {
  if (!job) return;
  where_possible(*device->context, [&] {
    const std::unique_ptr<GpuJob> owned(job);
    device->context->free_event(job->event);
  });
}

}  // namespace
}  // namespace nif::gpu

extern "C" NIF_API const nif::runtime::GpuModule* nif_gpu_module(void) {
  using namespace nif;
  static const runtime::GpuModule module{runtime::kGpuModuleVersion,
                                         runtime::kGpuLayout,
                                         gpu::count_gpus,
                                         gpu::describe_gpu,
                                         gpu::open_device,
                                         gpu::close_device,
                                         gpu::upload_asset,
                                         gpu::free_asset,
                                         gpu::upload_scene,
                                         gpu::free_scene,
                                         gpu::query,
                                         gpu::query_open,
                                         gpu::intersect,
                                         gpu::check_host_query,
                                         gpu::check_host_array,
                                         gpu::fetch_arrays,
                                         gpu::wait_fetch,
                                         gpu::free_fetch,
                                         gpu::measure_query,
                                         gpu::start_query,
                                         gpu::wait_job,
                                         gpu::is_job_done,
                                         gpu::free_job};
  return &module;
}
