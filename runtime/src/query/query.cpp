// Checks what a query asks for, before any ray is read.
#include "query/query.hpp"

#include <limits>

#include "api/error.hpp"
#include "query/outputs.hpp"
#include "query/work_area.hpp"

namespace nif::runtime {

uint64_t scratch_bytes(uint64_t count) { return count == 0 ? 0 : sizeof(WorkArea); }

bool answered_by_gpu(const NifSceneObject& scene, const NifQuery& query) {
  const std::optional<Gpu>& gpu = scene.device->gpu;
  return gpu && (query.memory == NIF_DEVICE || (scene.ready_on_gpu && !gpu->lost()));
}

namespace {

/// All but the outputs.
void check_inputs(const NifSceneObject& scene, const NifQuery& query) {
  if (!scene.committed)
    throw Failure(NIF_ERROR_INVALID_OPERATION,
                  "the scene has changed since it was committed, or was never committed");
  if (query.memory != NIF_HOST && query.memory != NIF_DEVICE)
    refuse_argument("query: unknown memory kind " + std::to_string(int(query.memory)));
  const bool has_gpu = scene.device->gpu.has_value();
  if (query.memory == NIF_DEVICE && !has_gpu)
    throw Failure(NIF_ERROR_NOT_AVAILABLE, "query: device memory needs a GPU backend; this device is a CPU");
  if (query.memory == NIF_DEVICE && !scene.ready_on_gpu)
    throw Failure(NIF_ERROR_INVALID_OPERATION, "the scene is not on the GPU, because its commit failed");
  if (query.stream && !has_gpu)
    throw Failure(NIF_ERROR_NOT_AVAILABLE, "query: a stream needs a GPU backend; this device is a CPU");
  if (query.count == 0) return;
  for (int a = 0; a < 3; ++a) {
    require_argument(query.origin[a], "query: origin");
    require_argument(query.direction[a], "query: direction");
  }
}

}  // namespace

void check_query(const NifSceneObject& scene, const NifQuery& query) {
  check_inputs(scene, query);
  if (query.count == 0) return;
  bool any = false;
  visit_outputs([&](const OutputArray&, const auto* array) { any = any || array; }, query);
  if (!any) refuse_argument("query: all outputs are null");
}

void check_open_query(const NifSceneObject& scene, const NifQuery& query, const NifOpenRays& open) {
  check_inputs(scene, query);
  if (query.memory == NIF_HOST && query.stream)
    throw Failure(NIF_ERROR_NOT_AVAILABLE,
                  "query: the CPU lists the open rays of host memory, and has no streams");
  if (query.count > std::numeric_limits<uint32_t>::max())
    refuse_argument("query: count is more than the 2^32 - 1 rays whose numbers fit into the lists");
  require_argument(open.count, "open: count");
  if (reinterpret_cast<uintptr_t>(open.count) % alignof(uint32_t) != 0)
    refuse_argument("open: count is not aligned to 4 bytes");
  if (open.capacity > 0) require_argument(open.rays, "open: rays");
}

void check_hit_query(const NifSceneObject& scene, const NifQuery& query, const NifHits& hits) {
  check_inputs(scene, query);
  if (query.memory == NIF_HOST && query.stream)
    throw Failure(NIF_ERROR_NOT_AVAILABLE,
                  "query: the CPU finds first hits of host memory, and has no streams");
  visit_outputs(
      [&](const OutputArray& about, const auto* array) {
        if (array)
          refuse_argument(std::string("query: ") + about.name + " is set, but first hits go to `hits` alone");
      },
      query);
  if (query.count == 0) return;
  bool any = false;
  visit_hit_outputs([&](const OutputArray&, const auto* array) { any = any || array; }, hits);
  if (!any) refuse_argument("hits: all outputs are null");
}

void check_scratch(const NifQuery& query) {
  if (query.count == 0) return;
  if (query.scratch && reinterpret_cast<uintptr_t>(query.scratch) % alignof(WorkArea) != 0)
    refuse_argument("query: scratch is not aligned to 64 bytes");
  if (query.scratch && query.scratch_bytes < sizeof(WorkArea))
    refuse_argument("query: scratch has " + std::to_string(query.scratch_bytes) + " bytes, but needs " +
                    std::to_string(sizeof(WorkArea)));
}

}  // namespace nif::runtime
