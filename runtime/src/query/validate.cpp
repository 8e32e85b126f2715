// Checks a query before any ray is read.
#include "query/validate.hpp"

#include <limits>

#include "api/error.hpp"
#include "query/outputs.hpp"
#include "query/work_area.hpp"

namespace nif::runtime {

uint64_t scratch_bytes(uint64_t count) { return count == 0 ? 0 : sizeof(WorkArea); }

bool answered_by_gpu(const NifSceneObject& scene, const NifRays& rays) {
  const std::optional<Gpu>& gpu = scene.device->gpu;
  return gpu && (rays.memory == NIF_MEMORY_DEVICE || (scene.ready_on_gpu && !gpu->lost()));
}

namespace {

/// Checks everything except the outputs.
void check_rays(const NifSceneObject& scene, const NifRays& rays) {
  if (!scene.committed)
    throw Failure(NIF_ERROR_INVALID_OPERATION,
                  "the scene has changed since it was committed, or was never committed");
  if (rays.memory != NIF_MEMORY_HOST && rays.memory != NIF_MEMORY_DEVICE)
    refuse_argument("rays: unknown memory kind " + std::to_string(rays.memory));
  if (rays.flags != 0)
    throw Failure(NIF_ERROR_NOT_AVAILABLE,
                  "rays: flags is " + std::to_string(rays.flags) + ", and this version has no flags");
  const bool has_gpu = scene.device->gpu.has_value();
  if (rays.memory == NIF_MEMORY_DEVICE && !has_gpu)
    throw Failure(NIF_ERROR_NOT_AVAILABLE, "rays: device memory needs a GPU backend; this device is a CPU");
  if (rays.memory == NIF_MEMORY_DEVICE && !scene.ready_on_gpu)
    throw Failure(NIF_ERROR_INVALID_OPERATION, "the scene is not on the GPU, because its commit failed");
  if (rays.stream && !has_gpu)
    throw Failure(NIF_ERROR_NOT_AVAILABLE, "rays: a stream needs a GPU backend; this device is a CPU");
  if (rays.count == 0) return;
  for (int a = 0; a < 3; ++a) {
    require_argument(rays.origin[a], "rays: origin");
    require_argument(rays.direction[a], "rays: direction");
  }
}

void refuse_stream_of_host(const NifRays& rays, const char* what) {
  if (rays.memory == NIF_MEMORY_HOST && rays.stream)
    throw Failure(NIF_ERROR_NOT_AVAILABLE,
                  std::string("rays: the CPU ") + what + " of host memory, and has no streams");
}

}  // namespace

void check_query(const NifSceneObject& scene, const NifRays& rays, const NifAnswers& answers) {
  check_rays(scene, rays);
  if (rays.count == 0) return;
  bool any = false;
  visit_outputs([&](const OutputArray&, const auto* array) { any = any || array; }, answers);
  if (!any) refuse_argument("answers: all outputs are null");
}

void check_open_query(const NifSceneObject& scene, const NifRays& rays, const NifOpenRays& open) {
  check_rays(scene, rays);
  refuse_stream_of_host(rays, "lists the open rays");
  if (rays.count > std::numeric_limits<uint32_t>::max())
    refuse_argument("rays: count is more than the 2^32 - 1 rays whose numbers fit into the lists");
  require_argument(open.count, "open: count");
  if (reinterpret_cast<uintptr_t>(open.count) % alignof(uint32_t) != 0)
    refuse_argument("open: count is not aligned to 4 bytes");
  if (open.capacity > 0) require_argument(open.rays, "open: rays");
}

void check_hit_query(const NifSceneObject& scene, const NifRays& rays, const NifHits& hits) {
  check_rays(scene, rays);
  refuse_stream_of_host(rays, "finds first hits");
  if (rays.count == 0) return;
  bool any = false;
  visit_hit_outputs([&](const OutputArray&, const auto* array) { any = any || array; }, hits);
  if (!any) refuse_argument("hits: all outputs are null");
}

void check_on_cpu(const NifSceneObject& scene, const Request& request) {
  const NifRays& rays = request.rays;
  if (rays.count == 0) return;
  if (rays.scratch && reinterpret_cast<uintptr_t>(rays.scratch) % alignof(WorkArea) != 0)
    refuse_argument("rays: scratch is not aligned to 64 bytes");
  if (rays.scratch && rays.scratch_bytes < sizeof(WorkArea))
    refuse_argument("rays: scratch has " + std::to_string(rays.scratch_bytes) + " bytes, but needs " +
                    std::to_string(sizeof(WorkArea)));
  if (scene.device->gpu) scene.device->gpu->check_host_query(*scene.device.get(), request);
}

}  // namespace nif::runtime
