// Transforms rays to object space, and sorts pairs of ray and instance by object: by a radix sort, byte by
// byte, which allocates nothing. The rounds themselves are templates, in the header.
#include "query/rounds.hpp"

namespace nif::runtime {

using kernels::Segment;
using kernels::segment_of;
using kernels::SegmentBatch;
using kernels::set_segment;

void transform_batch(const Instance& instance, const SegmentBatch& __restrict from,
                     SegmentBatch& __restrict to) {
  const kernels::WorldToObject transform = instance.to_object;
  const uint32_t count = to.count = from.count;
  for (uint32_t i = 0; i < count; ++i) set_segment(to, i, to_object(transform, segment_of(from, i)));
}

void bring_to_object(const NifSceneObject& scene, const Pair* pairs, uint32_t count, WorkArea& area) {
  area.object_rays.count = count;
  for (uint32_t k = 0; k < count; ++k) {
    if (k + kFetchedAhead < count) fetch(scene.instances[pairs[k + kFetchedAhead].instance]);
    const Instance& instance = scene.instances[pairs[k].instance];
    const Segment ray = segment_of(area.rays, pairs[k].ray);
    set_segment(area.object_rays, k, instance.identity ? ray : to_object(instance.to_object, ray));
  }
}

uint32_t parts_of_call(const NifSceneObject& scene, const Pair* pairs, uint32_t begin, uint32_t count,
                       WorkArea& area) {
  const uint32_t kind = scene.objects[pairs[begin].object].kernel->kind();
  uint32_t end = begin;
  for (uint32_t part = 0; end < count; ++part) {
    const uint32_t object = pairs[end].object;
    const kernels::ObjectKernel* const kernel = scene.objects[object].kernel;
    if (part > 0 && (kind == 0 || kernel->kind() != kind)) break;
    while (end < count && pairs[end].object == object) ++end;
    area.parts[part] = {kernel, end - begin};
  }
  return end;
}

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

}  // namespace nif::runtime
