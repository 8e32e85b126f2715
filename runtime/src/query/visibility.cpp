// Answers the visibility of a batch. A sole instance's kernel gets the whole batch. Otherwise the batch is
// answered in rounds, and occluded rays drop out.
#include "query/visibility.hpp"

#include <algorithm>
#include <limits>

#include "kernels/reference/batch.hpp"
#include "query/float_environment.hpp"
#include "query/streams.hpp"

namespace nif::runtime {
namespace {

using kernels::Segment;
using kernels::segment_of;
using kernels::SegmentBatch;

/// Runs an object's kernel on `rays`, with or without its network.
void ask_kernel(const kernels::ObjectKernel& kernel, const Wanted& wanted, const SegmentBatch& rays,
                kernels::AnswerBatch& answers, kernels::OpenBatch& open, WorkArea& area) {
  if (wanted.open)
    kernel.prove(rays, answers, open, area.kernel_scratch);
  else
    kernel.answer(rays, answers, area.kernel_scratch);
}

/// Withdraws the proof about a ray, number k of these answers: the whole ray is open.
void withdraw_proof(const Segment& ray, uint32_t k, kernels::AnswerBatch& answers, kernels::OpenBatch& open) {
  answers.certain[k] = 0;
  open.begin[k] = ray.tmin;
  open.end[k] = ray.tmax;
}

void answer_sole_instance(const NifSceneObject& scene, bool masked, const Wanted& wanted, WorkArea& area) {
  const Instance& instance = scene.instances[scene.sole];
  const PlacedObject& object = scene.objects[instance.object];
  const uint32_t count = area.rays.count;
  if (!instance.identity) transform_batch(instance, area.rays, area.object_rays);
  const SegmentBatch& rays = instance.identity ? area.rays : area.object_rays;
  ask_kernel(*object.kernel, wanted, rays, area.answers, area.open, area);
  const uint32_t unproven = wanted.details ? find_unproven(scene, rays, area) : 0;
  for (uint32_t k = 0; k < unproven; ++k) {
    const uint32_t i = area.entries[k];
    withdraw_proof(segment_of(area.rays, i), i, area.answers, area.open);
  }
  const uint32_t excluded = masked ? find_excluded(scene, area) : 0;
  for (uint32_t k = 0; k < excluded; ++k) {
    const uint32_t i = area.entries[k];
    area.answers.logit[i] = kernels::kCertainLogit;
    area.answers.certain[i] = area.misses[i];
  }
  if (wanted.open) std::fill_n(area.open_instance, count, scene.sole);
  if (wanted.probability)
    for (uint32_t i = 0; i < count; ++i)
      area.probability[i] = kernels::visible_probability(area.answers.logit[i], object.calibration);
}

/// Queries the objects of area.parts with area.object_rays.
void ask_parts(const Wanted& wanted, WorkArea& area) {
  const SegmentBatch& rays = area.object_rays;
  const kernels::ObjectKernel& kernel = *area.parts[0].kernel;
  if (area.parts[0].end == rays.count) {
    ask_kernel(kernel, wanted, rays, area.object_answers, area.object_open, area);
    return;
  }
  kernel.answer_parts(area.parts, rays, area.object_answers, area.kernel_scratch);
  if (wanted.open) kernels::open_whole(rays, area.object_open);
}

/// Withdraws the proofs about area.object_rays that the instances' transforms do not allow, or their files.
void keep_certain(const NifSceneObject& scene, const Pair* pairs, uint32_t count, WorkArea& area) {
  for (uint32_t k = 0; k < count; ++k) {
    const Segment ray = segment_of(area.rays, pairs[k].ray);
    if (!stays_certain(scene.instances[pairs[k].instance], scene.objects[pairs[k].object].reach_scale, ray,
                       segment_of(area.object_rays, k)))
      withdraw_proof(ray, k, area.object_answers, area.object_open);
  }
}

/// Merges the answers to area.object_rays into those of the batch. Sets area.decided for rays that are decided.
void merge_answers(const NifSceneObject& scene, const Wanted& wanted, const Pair* pairs, uint32_t count,
                   WorkArea& area) {
  for (uint32_t k = 0; k < count; ++k) {
    const uint32_t i = pairs[k].ray;
    const PlacedObject& object = scene.objects[pairs[k].object];
    const int32_t logit = area.object_answers.logit[k];
    bool decided = logit < 0;
    if (wanted.details) {
      const bool certain = area.object_answers.certain[k] != 0;
      if (certain && logit == kernels::kCertainLogit) continue;  // changes nothing
      area.combined[i].add(logit, certain, object.calibration, wanted.probability);
      if (wanted.open && !certain) {
        area.open_instance[i] =
            area.open.begin[i] <= area.open.end[i] ? kernels::kNoInstance : pairs[k].instance;
        // 0 is added because the sign of a zero would depend on the order.
        area.open.begin[i] = std::min(area.open.begin[i], area.object_open.begin[k]) + 0.0f;
        area.open.end[i] = std::max(area.open.end[i], area.object_open.end[k]) + 0.0f;
      }
      decided = area.combined[i].blocked_for_certain();
    } else if (decided) {
      area.answers.logit[i] = logit;
    }
    area.decided[i] |= decided;
  }
}

class VisibilityStreams final : public StreamTraversal {
 public:
  VisibilityStreams(const NifSceneObject& scene, const Wanted& wanted, WorkArea& area)
      : StreamTraversal(scene, area), wanted_(wanted) {}

 private:
  void ask(uint32_t number, RayStream& stream) override {
    const Instance& instance = scene_.instances[number];
    const uint32_t count = area_.object_rays.count, *entries = area_.entries;
    ask_kernel(*scene_.objects[instance.object].kernel, wanted_, area_.object_rays, area_.object_answers,
               area_.object_open, area_);
    if (!wanted_.details) {
      for (uint32_t k = 0; k < count; ++k) {
        if (area_.object_answers.logit[k] >= 0) continue;
        const uint32_t i = stream.ray[entries[k]];
        area_.answers.logit[i] = area_.object_answers.logit[k];
        area_.decided[i] = 1;
        stream.drop(entries[k]);
      }
      return;
    }
    for (uint32_t k = 0; k < count; ++k)
      area_.pairs[0][k] = {instance.object, number, stream.ray[entries[k]]};
    withdraw_proofs(instance);
    merge_answers(scene_, wanted_, area_.pairs[0], count, area_);
    update(stream, entries, count);
  }
  /// As keep_certain(), of the instance that was asked.
  void withdraw_proofs([[maybe_unused]] const Instance& instance) {
#ifdef __wasm__  // where code size matters
    keep_certain(scene_, area_.pairs[0], area_.object_rays.count, area_);
#else
    if (instance.identity && !instance.unproven) return;
    const uint32_t count = area_.object_rays.count;
    uint32_t* const numbers = area_.numbers;
    for (uint32_t k = 0; k < count; ++k) numbers[k] = area_.pairs[0][k].ray;
    std::fill_n(numbers + count, kernels::kBatchRoom - kernels::kBatchRays, 0);
    const uint32_t found =
        scene_.device->streams->find_unproven(area_.rays, numbers, area_.object_rays, instance,
                                              scene_.objects[instance.object].reach_scale, numbers);
    for (uint32_t n = 0; n < found; ++n) {
      const Segment ray = segment_of(area_.rays, area_.pairs[0][numbers[n]].ray);
      withdraw_proof(ray, numbers[n], area_.object_answers, area_.object_open);
    }
#endif
  }
  void update(RayStream& stream, const uint32_t* entries, uint32_t count) override {
    for (uint32_t k = 0; k < count; ++k)
      if (area_.decided[stream.ray[entries[k]]]) stream.drop(entries[k]);
  }

  const Wanted& wanted_;
};

void finish_details(const Wanted& wanted, WorkArea& area) {
  for (uint32_t i = 0; i < area.rays.count; ++i) {
    const kernels::CombinedAnswer& combined = area.combined[i];
    area.answers.logit[i] = combined.logit();
    area.answers.certain[i] &= uint8_t(combined.certain());
    if (wanted.probability) area.probability[i] = combined.probability();
  }
}

void answer_instances(const NifSceneObject& scene, bool masked, const Wanted& wanted, WorkArea& area) {
  const bool in_streams = start_in_streams(scene, masked, area);
  const uint32_t active = in_streams ? 0 : start_rays(scene, Goal::any, area);
  const uint32_t count = area.rays.count;
  std::fill_n(area.answers.logit, count, kernels::kCertainLogit);
  std::fill_n(area.decided, count, uint8_t{0});
  for (uint32_t i = 0; i < count && wanted.details; ++i) {
    area.answers.certain[i] = area.misses[i] || scene.unproven;
    area.combined[i] = {};
    if (scene.unproven) area.combined[i].add(kernels::kCertainLogit, false, {}, false);
    if (!wanted.open) continue;
    area.open.begin[i] = scene.unproven ? area.rays.tmin[i] : std::numeric_limits<float>::infinity();
    area.open.end[i] = scene.unproven ? area.rays.tmax[i] : -std::numeric_limits<float>::infinity();
    area.open_instance[i] = kernels::kNoInstance;
  }
  if (in_streams) {
    VisibilityStreams(scene, wanted, area).run();
  } else {
    go_in_rounds(scene, masked, Goal::any, area, active, [&](const Pair* pairs, uint32_t asked) {
      bring_to_object(scene, pairs, asked, area);
      ask_parts(wanted, area);
      if (wanted.details) keep_certain(scene, pairs, asked, area);
      merge_answers(scene, wanted, pairs, asked, area);
      for (uint32_t k = 0; k < asked; ++k)
        if (area.decided[pairs[k].ray]) area.cursors[pairs[k].ray].trail = 0;  // the ray drops out
    });
  }
  if (wanted.details) finish_details(wanted, area);
}

}  // namespace

NIF_COMPUTES void answer_batch(const NifSceneObject& scene, bool masked, const Wanted& wanted,
                               WorkArea& area) {
  if (scene.sole != kernels::kNoInstance)
    answer_sole_instance(scene, masked, wanted, area);
  else
    answer_instances(scene, masked, wanted, area);
}

}  // namespace nif::runtime
