// Answering batches of rays on the calling thread, through the reference kernels.
#include "query.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "error.hpp"
#include "float_environment.hpp"

namespace nif::runtime {
namespace {

struct SceneAnswer {
  bool visible = true;
  bool certain = true;
  int32_t logit = kernels::kCertainLogit;
  float probability = 1;
};

float probability_of(const kernels::Answer& answer, float logit_scale) {
  if (answer.logit == kernels::kCertainLogit) return 1;
  if (answer.logit == -kernels::kCertainLogit) return 0;
  return 1.0f / (1.0f + std::exp(-static_cast<float>(answer.logit) * logit_scale));
}

/// Asks the instances in turn. `details`: whether more than the visible bit is wanted; then a learned
/// "occluded" does not end the search, because another instance may be occluding for certain.
SceneAnswer ask_scene(const NifSceneObject& scene, const kernels::Segment& ray, bool details) {
  SceneAnswer result;
  bool all_certain = true;
  kernels::Walk walk;
  for (const Instance& instance : scene.instances) {
    const kernels::SegmentField& field = instance.object->field;
    const kernels::Segment local = to_object(instance, ray);
    kernels::walk_segment(field, local, walk);
    const kernels::Answer answer = kernels::answer_walk(field, walk);
    result.visible = result.visible && answer.visible;
    if (!details) {
      if (!answer.visible) break;
      continue;
    }
    const bool certain = answer.certain && stays_certain(instance, ray, local);
    if (certain && !answer.visible) return {false, true, -kernels::kCertainLogit, 0};
    all_certain = all_certain && certain;
    result.logit = std::min(result.logit, answer.logit);
    result.probability *= probability_of(answer, field.network.logit_scale);
  }
  result.certain = result.visible && all_certain;
  return result;
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
  const bool details = query.probability || query.certain || query.logit;
  uint8_t bits = 0;
  for (uint64_t i = 0; i < query.count; ++i) {
    const SceneAnswer answer = ask_scene(scene, load_ray(query, i), details);
    store(query.visible, i, uint8_t(answer.visible));
    store(query.probability, i, answer.probability);
    store(query.certain, i, uint8_t(answer.certain));
    store(query.logit, i, answer.logit);
    bits = uint8_t(bits | unsigned(answer.visible) << (i % 8));
    if (i % 8 == 7 || i + 1 == query.count) {
      store(query.visible_bits, i / 8, bits);
      bits = 0;
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
