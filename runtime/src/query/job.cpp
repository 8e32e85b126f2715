// Decides which threads help with a query, or with a commit, and how rays or instances are divided among them.
#include "query/job.hpp"

#include <algorithm>

#include "api/device.hpp"
#include "api/handles.hpp"
#include "query/batch.hpp"
#include "query/float_environment.hpp"
#include "query/validate.hpp"
#include "scene/scene.hpp"

namespace nif::runtime {
namespace {

/// Waking a thread takes about as long as answering a batch: smaller queries stay on the calling thread.
constexpr uint64_t kWorthSharing = 2 * kBatchRays;
/// With several threads, batches may be smaller, so that all threads finish at about the same time; but not
/// so small that the kernels' overhead at the end of a batch matters.
constexpr uint64_t kSmallestBlock = 256, kBlocksOfAThread = 8;

uint32_t batch_size(uint64_t rays, uint32_t threads) {
  const uint64_t share = rays / (threads * kBlocksOfAThread) / 64 * 64;
  return uint32_t(std::clamp<uint64_t>(share, kSmallestBlock, kBatchRays));
}

/// The task that the caller's task runner calls, once for each thread that may help.
void run_task(void* argument, uint64_t) {
  auto* job = static_cast<NifJobObject*>(argument);
  job->device->pool.help_and_drop(*job);
}

#ifndef NIF_WITHOUT_BENDING
/// As kWorthSharing, for triangles of at least two instances that bend: some 5 ns each.
constexpr uint64_t kTrianglesWorthSharing = 8192;

void refit(const BentInstance& bent) {
  if (bent.own != nullptr && bent.instance != kernels::kNoInstance) bent.own->refit();
}
#endif

void set_up(NifJobObject& job, NifSceneObject& scene, const Request& request) {
  job.device = scene.device.get();
  job.device->retain();
  job.scene = &scene;
  job.request = request;
  job.refits = false;
  job.batches = request.batches();
  job.next = 0;
  job.done = 0;
  job.cancelled = false;
}

/// Offers a job to at most `helpers` other threads.
void share(NifJobObject& job, uint64_t helpers) {
  NifDeviceObject& device = *job.device;
  if (helpers == 0) return;
  if (device.own_callbacks.submit == nullptr) {
    device.pool.offer(job);
    return;
  }
  for (uint64_t i = 0; i < helpers; ++i) job.retain();
  device.own_callbacks.submit(device.own_callbacks.user, run_task, &job, helpers);
}

/// Answers a request on the calling thread alone.
void answer_alone(const NifSceneObject& scene, const Request& request) {
  const FloatEnvironment environment;
  const ClaimedArea area(scene.device->areas, request.rays.scratch);
  for (uint64_t batch = 0; batch < request.batches(); ++batch) answer_batch_of(scene, request, batch, *area);
}

}  // namespace

void take_blocks(NifJobObject& job, void* scratch) {
  uint64_t batch = job.next.fetch_add(1);
  if (batch >= job.batches) return;
  const FloatEnvironment environment;
  uint64_t answered = 0;
#ifndef NIF_WITHOUT_BENDING
  if (job.refits) {
    for (; batch < job.batches; batch = job.next.fetch_add(1), ++answered)
      refit(job.scene->bent[size_t(batch)]);
    job.done.fetch_add(answered);
    return;
  }
#endif
  const ClaimedArea area(job.device->areas, scratch);
  for (; batch < job.batches; batch = job.next.fetch_add(1), ++answered)
    answer_batch_of(*job.scene, job.request, batch, *area);
  job.done.fetch_add(answered);
}

void dispose(NifJobObject& job) {
  NifDeviceObject* device = job.device;
  if (job.number == Claims::kNone)
    destroy(device->memory(), &job);
  else
    device->free_jobs.give_back(job.number);
  release(device);
}

void answer(NifSceneObject& scene, Request request) {
  NifDeviceObject& device = *scene.device.get();
  const uint32_t threads = device.configuration.threads;
  uint32_t number = Claims::kNone;
  if (threads > 1 && request.rays.count >= kWorthSharing) number = device.free_jobs.try_claim();
  if (number == Claims::kNone) return answer_alone(scene, request);

  request.batch_rays = batch_size(request.rays.count, threads);
  NifJobObject& job = device.jobs[number];
  job.number = number;
  job.retain();
  set_up(job, scene, request);
  share(job, std::min<uint64_t>(threads, job.batches) - 1);
  device.pool.finish(job, request.rays.scratch);
  if (job.drop()) dispose(job);
}

#ifndef NIF_WITHOUT_BENDING
void refit_together(NifSceneObject& scene) {
  NifDeviceObject& device = *scene.device.get();
  const uint32_t threads = device.configuration.threads;
  uint64_t triangles = 0, changed = 0;
  for (const BentInstance& bent : scene.bent)
    if (bent.own != nullptr && bent.instance != kernels::kNoInstance && bent.own->changed()) {
      triangles += bent.own->field().triangle_count;
      ++changed;
    }
  uint32_t number = Claims::kNone;
  if (threads > 1 && changed > 1 && triangles >= kTrianglesWorthSharing)
    number = device.free_jobs.try_claim();
  if (number == Claims::kNone) {
    for (const BentInstance& bent : scene.bent) refit(bent);
    return;
  }
  NifJobObject& job = device.jobs[number];
  job.number = number;
  job.retain();
  set_up(job, scene, {});
  job.refits = true;
  job.batches = scene.bent.size();
  share(job, std::min<uint64_t>(threads, changed) - 1);
  device.pool.finish(job, nullptr);
  if (job.drop()) dispose(job);
}
#endif

uintptr_t start_job(NifSceneObject& scene, Request request) {
  NifDeviceObject& device = *scene.device.get();
  request.rays.scratch = nullptr;
  const bool on_gpu =
      request.hits ? request.rays.memory == NIF_MEMORY_DEVICE : answered_by_gpu(scene, request.rays);
  if (on_gpu && request.rays.memory == NIF_MEMORY_HOST) {
    device.gpu->query(scene, request.rays, request.answers);
    request.rays.count = 0;  // nothing is left to do
  }
  if (!on_gpu) check_on_cpu(scene, request);
  const uint32_t threads = device.configuration.threads;
  if (threads > 1) request.batch_rays = batch_size(request.rays.count, threads);
  auto* job = create<NifJobObject>(device.memory());
  uintptr_t handle;
  try {
    handle = make_handle(Kind::job, job);
  } catch (...) {
    destroy(device.memory(), job);
    throw;
  }
  set_up(*job, scene, request);
  if (on_gpu && request.rays.memory == NIF_MEMORY_DEVICE && request.rays.count != 0) {
    try {
      device.gpu->start(scene, request, *job);
    } catch (...) {
      release_handle(Kind::job, handle);
      dispose(*job);
      throw;
    }
    job->next = job->batches;
  }
  scene.retain();
  job->holds_scene = true;
  job->has_handle = true;
  if (job->on_gpu) return handle;
  if (job->batches == 0 || (device.pool.empty() && device.own_callbacks.submit == nullptr))
    device.pool.finish(*job, request.rays.scratch);
  else
    share(*job, std::min<uint64_t>(threads, job->batches));
  return handle;
}

}  // namespace nif::runtime
