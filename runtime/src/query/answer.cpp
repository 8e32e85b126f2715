// A scene of one instance hands the batch to its kernel. Otherwise the batch is answered in rounds: each ray
// that is not yet decided goes on to the next instance whose box it may meet, the rays are sorted by object,
// and each object's kernel is asked once. A ray that is occluded drops out.
#include "query/answer.hpp"

#include <algorithm>
#include <limits>

#include "kernels/reference/batch.hpp"
#include "query/float_environment.hpp"
#include "scene/traversal.hpp"

namespace nif::runtime {
namespace {

using kernels::Segment;
using kernels::segment_of;
using kernels::SegmentBatch;
using kernels::set_segment;

/// The whole batch in one instance's space.
void transform_batch(const Instance& instance, const SegmentBatch& __restrict from,
                     SegmentBatch& __restrict to) {
  const kernels::WorldToObject transform = instance.to_object;
  const uint32_t count = to.count = from.count;
  for (uint32_t i = 0; i < count; ++i) set_segment(to, i, to_object(transform, segment_of(from, i)));
}

/// Asks an object's kernel about `rays`, with or without its network.
void ask_kernel(const PlacedObject& object, const Wanted& wanted, const SegmentBatch& rays,
                kernels::AnswerBatch& answers, kernels::OpenBatch& open, WorkArea& area) {
  if (wanted.open)
    object.kernel->prove(rays, answers, open, area.kernel_scratch);
  else
    object.kernel->answer(rays, answers, area.kernel_scratch);
}

/// Takes back what an instance's transform leaves no proof of: then all of the ray is open.
void keep_certain(const Instance& instance, const PlacedObject& object, const Wanted& wanted,
                  const Segment& world, const Segment& local, uint32_t i, kernels::AnswerBatch& answers,
                  kernels::OpenBatch& open) {
  if (!answers.certain[i] && !wanted.open) return;
  if (stays_certain(instance, object.reach_scale, world, local)) return;
  answers.certain[i] = 0;
  open.begin[i] = world.tmin;
  open.end[i] = world.tmax;
}

void answer_one_instance(const NifSceneObject& scene, const Wanted& wanted, WorkArea& area) {
  const Instance& instance = scene.instances[0];
  const PlacedObject& object = scene.objects[instance.object];
  const uint32_t count = area.rays.count;
  if (instance.identity) {
    ask_kernel(object, wanted, area.rays, area.answers, area.open, area);
  } else {
    transform_batch(instance, area.rays, area.object_rays);
    ask_kernel(object, wanted, area.object_rays, area.answers, area.open, area);
    if (wanted.details)
      for (uint32_t i = 0; i < count; ++i)
        keep_certain(instance, object, wanted, segment_of(area.rays, i), segment_of(area.object_rays, i), i,
                     area.answers, area.open);
  }
  if (wanted.probability)
    for (uint32_t i = 0; i < count; ++i)
      area.probability[i] = kernels::visible_probability(area.answers.logit[i], object.calibration);
}

/// Sets out each ray at the root. Those that are none, or miss everything, are not active.
uint32_t start_rays(const NifSceneObject& scene, const Wanted& wanted, WorkArea& area) {
  const std::span<const Node> nodes = scene.hierarchy.nodes();
  uint32_t active = 0;
  for (uint32_t i = 0; i < area.rays.count; ++i) {
    const Segment ray = segment_of(area.rays, i);
    kernels::BoxRay prepared;
    const bool askable = kernels::prepare_box_ray(ray, prepared);
    area.answers.logit[i] = kernels::kCertainLogit;
    area.answers.certain[i] = askable || ray.tmin > ray.tmax;
    if (wanted.details) area.combined[i] = {};
    if (wanted.open) {
      area.open.begin[i] = std::numeric_limits<float>::infinity();
      area.open.end[i] = -std::numeric_limits<float>::infinity();
    }
    if (!askable || nodes.empty()) continue;
    for (int a = 0; a < 3; ++a) area.inverse[a][i] = prepared.inverse[a];
    area.cursors[i] = start(nodes.data(), TraversalRay(area, i));
    if (area.cursors[i].trail != 0) area.active[active++] = uint16_t(i);
  }
  return active;
}

/// Takes each active ray to its next instance; rays that have no other are no longer active. Returns how many
/// are.
uint32_t advance(const NifSceneObject& scene, WorkArea& area, uint32_t active) {
  const Node* nodes = scene.hierarchy.nodes().data();
  uint32_t pairs = 0;
  for (uint32_t k = 0; k < active; ++k) {
    const uint32_t i = area.active[k];
    const uint32_t instance = next_instance(nodes, TraversalRay(area, i), area.cursors[i]);
    if (instance == kNoPlace) continue;
    area.active[pairs] = uint16_t(i);
    area.pairs[0][pairs++] = {scene.instances[instance].object, instance, i};
  }
  return pairs;
}

/// Sorts pairs by object, as many bytes of its index as the scene needs, and returns them.
const Pair* sort_by_object(const NifSceneObject& scene, WorkArea& area, uint32_t count) {
  uint32_t now = 0;
  for (uint32_t shift = 0; shift < 32 && (scene.objects.size() - 1) >> shift != 0; shift += 8, now ^= 1) {
    uint32_t begins[257] = {};
    const Pair* from = area.pairs[now];
    for (uint32_t k = 0; k < count; ++k) ++begins[(from[k].object >> shift & 255) + 1];
    for (uint32_t b = 1; b < 257; ++b) begins[b] += begins[b - 1];
    Pair* to = area.pairs[now ^ 1];
    for (uint32_t k = 0; k < count; ++k) to[begins[from[k].object >> shift & 255]++] = from[k];
  }
  return area.pairs[now];
}

/// Asks one object about some rays and adds its answers to theirs.
void ask_object(const NifSceneObject& scene, const Wanted& wanted, const Pair* pairs, uint32_t count,
                WorkArea& area) {
  const PlacedObject& object = scene.objects[pairs[0].object];
  area.object_rays.count = count;
  for (uint32_t k = 0; k < count; ++k) {
    const Instance& instance = scene.instances[pairs[k].instance];
    const Segment ray = segment_of(area.rays, pairs[k].ray);
    set_segment(area.object_rays, k, instance.identity ? ray : to_object(instance.to_object, ray));
  }
  ask_kernel(object, wanted, area.object_rays, area.object_answers, area.object_open, area);
  for (uint32_t k = 0; k < count; ++k) {
    const uint32_t i = pairs[k].ray;
    const int32_t logit = area.object_answers.logit[k];
    bool decided = logit < 0;
    if (wanted.details) {
      keep_certain(scene.instances[pairs[k].instance], object, wanted, segment_of(area.rays, i),
                   segment_of(area.object_rays, k), k, area.object_answers, area.object_open);
      const bool certain = area.object_answers.certain[k] != 0;
      area.combined[i].add(logit, certain, object.calibration, wanted.probability);
      if (wanted.open && !certain) {
        area.open.begin[i] = std::min(area.open.begin[i], area.object_open.begin[k]);
        area.open.end[i] = std::max(area.open.end[i], area.object_open.end[k]);
      }
      decided = area.combined[i].blocked_for_certain();
    } else if (decided) {
      area.answers.logit[i] = logit;
    }
    if (decided) area.cursors[i].trail = 0;  // never asked again
  }
}

void finish_details(const Wanted& wanted, WorkArea& area) {
  for (uint32_t i = 0; i < area.rays.count; ++i) {
    const kernels::CombinedAnswer& combined = area.combined[i];
    area.answers.logit[i] = combined.logit();
    area.answers.certain[i] &= uint8_t(combined.certain());
    if (wanted.probability) area.probability[i] = combined.probability();
  }
}

void answer_in_rounds(const NifSceneObject& scene, const Wanted& wanted, WorkArea& area) {
  uint32_t active = start_rays(scene, wanted, area);
  while ((active = advance(scene, area, active)) != 0) {
    const Pair* pairs = sort_by_object(scene, area, active);
    for (uint32_t begin = 0, end; begin < active; begin = end) {
      for (end = begin + 1; end < active && pairs[end].object == pairs[begin].object; ++end) continue;
      ask_object(scene, wanted, pairs + begin, end - begin, area);
    }
  }
  if (wanted.details) finish_details(wanted, area);
}

}  // namespace

NIF_COMPUTES void answer_batch(const NifSceneObject& scene, const Wanted& wanted, WorkArea& area) {
  if (scene.instances.size() == 1)
    answer_one_instance(scene, wanted, area);
  else
    answer_in_rounds(scene, wanted, area);
}

}  // namespace nif::runtime
