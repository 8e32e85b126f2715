// Answering batches of rays on the calling thread, block by block, through the objects' kernels.
#include "query.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "error.hpp"
#include "float_environment.hpp"

namespace nif::runtime {
namespace {

float probability_of(int32_t logit, float logit_scale) {
  if (logit == kernels::kCertainLogit) return 1;
  if (logit == -kernels::kCertainLogit) return 0;
  return 1.0f / (1.0f + std::exp(-static_cast<float>(logit) * logit_scale));
}

/// What a thread needs to answer a block of rays.
struct Work {
  kernels::SegmentBatch batch;
  kernels::AnswerBatch answers;
  alignas(64) std::byte scratch[kernels::kKernelScratchBytes];
  kernels::Segment rays[kernels::kBatchRays];  ///< in world space
  uint32_t undecided[kernels::kBatchRays];     ///< rays that are still to be asked, as indices into the block
  // Results of the block.
  int32_t logit[kernels::kBatchRays];
  float probability[kernels::kBatchRays];
  uint8_t certain[kernels::kBatchRays];
};

/// Asks the instances in turn. `details`: whether more than the visible bit is wanted; then a learned
/// "occluded" does not end a ray's search, because another instance may be occluding for certain.
void ask_scene(const NifSceneObject& scene, uint32_t count, bool details, Work& work) {
  for (uint32_t i = 0; i < count; ++i) {
    work.logit[i] = kernels::kCertainLogit;
    work.probability[i] = 1;
    work.certain[i] = 1;
    work.undecided[i] = i;
  }
  uint32_t left = count;
  for (const Instance& instance : scene.instances) {
    if (left == 0) break;
    work.batch.count = left;
    for (uint32_t k = 0; k < left; ++k) {
      const kernels::Segment local = to_object(instance, work.rays[work.undecided[k]]);
      for (int a = 0; a < 3; ++a) {
        work.batch.origin[a][k] = local.origin[a];
        work.batch.direction[a][k] = local.direction[a];
      }
      work.batch.tmin[k] = local.tmin;
      work.batch.tmax[k] = local.tmax;
    }
    instance.kernel->answer(work.batch, work.answers, work.scratch);
    const float scale = instance.object->field.network.logit_scale;
    uint32_t still = 0;
    for (uint32_t k = 0; k < left; ++k) {
      const uint32_t i = work.undecided[k];
      const int32_t logit = work.answers.logit[k];
      work.logit[i] = std::min(work.logit[i], logit);
      if (!details) {
        if (logit >= 0) work.undecided[still++] = i;
        continue;
      }
      bool certain = work.answers.certain[k] != 0;
      if (certain && !instance.identity) {
        const kernels::Segment& ray = work.rays[i];
        certain = stays_certain(instance, ray, to_object(instance, ray));
      }
      if (certain && logit < 0) {
        work.certain[i] = 1;
        work.logit[i] = -kernels::kCertainLogit;
        work.probability[i] = 0;
        continue;
      }
      work.certain[i] = work.certain[i] && certain && logit >= 0;
      work.probability[i] *= probability_of(logit, scale);
      work.undecided[still++] = i;
    }
    left = still;
  }
}

/// One float of the caller's, at any alignment; `otherwise` where there is no array.
float load(const float* array, uint64_t stride, uint64_t i, float otherwise) {
  if (array == nullptr) return otherwise;
  float value;
  std::memcpy(&value, reinterpret_cast<const char*>(array) + i * stride, sizeof(value));
  return value;
}

template <class T>
void store(T* array, uint64_t i, T value) {
  if (array) std::memcpy(reinterpret_cast<char*>(array) + i * sizeof(T), &value, sizeof(T));
}

kernels::Segment load_ray(const NifQuery& query, uint64_t i) {
  kernels::Segment ray;
  for (int a = 0; a < 3; ++a) {
    ray.origin[a] = load(query.origin[a], query.origin_stride, i, 0);
    ray.direction[a] = load(query.direction[a], query.direction_stride, i, 0);
  }
  ray.tmin = load(query.tmin, query.tmin_stride, i, 0);
  ray.tmax = load(query.tmax, query.tmax_stride, i, std::numeric_limits<float>::infinity());
  return ray;
}

NIF_COMPUTES void answer_rays(const NifSceneObject& scene, const NifQuery& query) {
  static thread_local Work work;  // too large for the stacks of fibres
  const bool details = query.probability || query.certain || query.logit;
  for (uint64_t begin = 0; begin < query.count; begin += kernels::kBatchRays) {
    const auto count = uint32_t(std::min<uint64_t>(kernels::kBatchRays, query.count - begin));
    for (uint32_t i = 0; i < count; ++i) work.rays[i] = load_ray(query, begin + i);
    ask_scene(scene, count, details, work);
    uint8_t bits = 0;
    for (uint32_t i = 0; i < count; ++i) {
      const uint8_t visible = work.logit[i] >= 0;
      store(query.visible, begin + i, visible);
      store(query.probability, begin + i, work.probability[i]);
      store(query.certain, begin + i, work.certain[i]);
      store(query.logit, begin + i, work.logit[i]);
      bits = uint8_t(bits | unsigned(visible) << (i % 8));
      if (i % 8 == 7 || i + 1 == count) {
        store(query.visible_bits, (begin + i) / 8, bits);
        bits = 0;
      }
    }
  }
}

}  // namespace

void run_query(const NifSceneObject& scene, const NifQuery& query) {
  if (!scene.committed)
    throw Failure(NIF_ERROR_INVALID_OPERATION, "the scene has changed since it was committed, or never was");
  if (query.memory != NIF_HOST && query.memory != NIF_DEVICE)
    refuse_argument("query: there is no memory kind " + std::to_string(int(query.memory)));
  if (query.memory == NIF_DEVICE)
    throw Failure(NIF_ERROR_NOT_AVAILABLE, "query: device memory needs a GPU backend; this device is a CPU");
  if (query.stream)
    throw Failure(NIF_ERROR_NOT_AVAILABLE, "query: a stream needs a GPU backend; this device is a CPU");
  if (query.count == 0) return;
  for (int a = 0; a < 3; ++a) {
    require_argument(query.origin[a], "query: origin");
    require_argument(query.direction[a], "query: direction");
  }
  if (!query.visible && !query.visible_bits && !query.probability && !query.certain && !query.logit)
    refuse_argument("query: no output is asked for");
  answer_rays(scene, query);
}

}  // namespace nif::runtime
