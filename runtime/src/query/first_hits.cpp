// Finds the first hits of a batch. A sole instance's kernel gets the whole batch. With several instances the
// batch goes in rounds; each proven hit shortens its ray, so that boxes behind it are skipped.
#include "query/first_hits.hpp"

#include <algorithm>
#include <cstring>

#include "query/float_environment.hpp"
#include "query/streams.hpp"

namespace nif::runtime {
namespace {

using kernels::Hit;
using kernels::kNoHit;
using kernels::kNoInstance;
using kernels::SceneHit;
using kernels::Segment;
using kernels::segment_of;

SceneHit scene_hit(const WorkArea& area, uint32_t i) {
  SceneHit hit;
  static_cast<Hit&>(hit) = kernels::hit_of(area.hits, i);
  hit.instance = area.hit_instance[i];
  return hit;
}

void set_scene_hit(WorkArea& area, uint32_t i, const SceneHit& hit) {
  kernels::set_hit(area.hits, i, hit);
  area.hit_instance[i] = hit.instance;
}

/// Intersects area.object_rays with the objects of area.parts, and merges their hits into those of the batch.
void intersect_objects(const NifSceneObject& scene, const Pair* pairs, uint32_t count, WorkArea& area) {
  for (uint32_t k = 0; k < count; ++k) area.hit_limit[k] = area.hits.high[pairs[k].ray];
  const kernels::ObjectKernel& kernel = *area.parts[0].kernel;
  if (area.parts[0].end == count)
    kernel.intersect(area.object_rays, area.hit_limit, area.object_hits, area.kernel_scratch);
  else
    kernel.intersect_parts(area.parts, area.object_rays, area.hit_limit, area.object_hits,
                           area.kernel_scratch);
  for (uint32_t k = 0; k < count; ++k) {
    if (k + kFetchedAhead < count)
      fetch(scene.hierarchy.nodes()[scene.instances[pairs[k + kFetchedAhead].instance].place / kWidth]);
    const uint32_t i = pairs[k].ray;
    const float reach_scale = scene.objects[pairs[k].object].reach_scale;
    Hit hit = kernels::hit_of(area.object_hits, k);
    if (!stays_certain(scene.instances[pairs[k].instance], reach_scale, segment_of(area.rays, i),
                       segment_of(area.object_rays, k)))
      kernels::forget_proof(hit);
    const kernels::BoxRay prepared{{area.inverse[0][i], area.inverse[1][i], area.inverse[2][i]}};
    const kernels::WorldBox box = scene.hierarchy.box(scene.instances[pairs[k].instance].place);
    kernels::begin_in_box(hit, kernels::pass_box(box, segment_of(area.rays, i), prepared).enter);
    SceneHit nearest = scene_hit(area, i);
    nearest.add(hit, pairs[k].instance);
    set_scene_hit(area, i, nearest);
  }
}

void intersect_sole_instance(const NifSceneObject& scene, bool masked, WorkArea& area) {
  const Instance& instance = scene.instances[scene.sole];
  const PlacedObject& object = scene.objects[instance.object];
  const uint32_t count = area.rays.count;
  std::fill_n(area.hit_limit, count, kNoHit);
  if (!instance.identity) transform_batch(instance, area.rays, area.object_rays);
  const kernels::SegmentBatch& rays = instance.identity ? area.rays : area.object_rays;
  object.kernel->intersect(rays, area.hit_limit, area.hits, area.kernel_scratch);
  const uint32_t unproven = find_unproven(scene, rays, area);
  for (uint32_t k = 0; k < unproven; ++k) {
    area.hits.low[area.entries[k]] = -kNoHit;
    area.hits.high[area.entries[k]] = kNoHit;
  }
  for (uint32_t i = 0; i < count; ++i)
    area.hit_instance[i] = area.hits.t[i] < kNoHit ? scene.sole : kNoInstance;
  const uint32_t excluded = masked ? find_excluded(scene, area) : 0;
  for (uint32_t k = 0; k < excluded; ++k) {
    const uint32_t i = area.entries[k];
    SceneHit none;
    if (!area.misses[i]) kernels::forget_proof(none);
    set_scene_hit(area, i, none);
  }
}

class HitStreams final : public StreamTraversal {
 public:
  using StreamTraversal::StreamTraversal;

 private:
  void ask(uint32_t number, RayStream& stream) override {
    const Instance& instance = scene_.instances[number];
    const PlacedObject& object = scene_.objects[instance.object];
    for (uint32_t k = 0; k < area_.object_rays.count; ++k) {
      const uint32_t i = stream.ray[area_.entries[k]];
      area_.object_rays.tmax[k] = area_.rays.tmax[i];
      area_.hit_limit[k] = area_.hits.high[i];
    }
    object.kernel->intersect(area_.object_rays, area_.hit_limit, area_.object_hits, area_.kernel_scratch);
    scene_.device->streams->join(stream, scene_.hierarchy.box(instance.place),
                                 {.entries = area_.entries,
                                  .local = area_.object_rays,
                                  .met = area_.object_hits,
                                  .instance = instance,
                                  .number = number,
                                  .reach_scale = object.reach_scale},
                                 area_.hits, area_.hit_instance);
  }
  /// A box that begins beyond a proven hit cannot hold the first one.
  void update(RayStream& stream, const uint32_t* entries, uint32_t count) override {
    for (uint32_t k = 0; k < count; ++k) {
      const uint32_t entry = entries[k], i = stream.ray[entry];
      stream.tmax[entry] = kernels::min_of(area_.hits.high[i], area_.rays.tmax[i]);
      stream.dropped += uint32_t(!(stream.tmin[entry] <= stream.tmax[entry]));
    }
  }
};

void intersect_instances(const NifSceneObject& scene, bool masked, WorkArea& area) {
  const bool in_streams = start_in_streams(scene, masked, area);
  const uint32_t active = in_streams ? 0 : start_rays(scene, Goal::nearest, area);
  fill_hits(area.hits, area.rays.count, SceneHit());
  std::fill_n(area.hit_instance, area.rays.count, kNoInstance);
  for (uint32_t i = 0; i < area.rays.count; ++i)
    if (!area.misses[i]) area.hits.low[i] = -kNoHit;
  if (in_streams) {
    HitStreams(scene, area).run();
  } else {
    go_in_rounds(scene, masked, Goal::nearest, area, active, [&](const Pair* pairs, uint32_t count) {
      bring_to_object(scene, pairs, count, area);
      intersect_objects(scene, pairs, count, area);
    });
  }
}

void turn_normals(const NifSceneObject& scene, WorkArea& area) {
#ifndef __wasm__
  if (const kernels::cpu::StreamFunctions* const streams = scene.device->streams) {
    streams->turn(area.rays, scene.instances.data(), area.hit_instance, area.hits);
    return;
  }
#endif
  for (uint32_t i = 0; i < area.rays.count; ++i) {
    if (area.hit_instance[i] == kNoInstance) continue;
    const Instance& instance = scene.instances[area.hit_instance[i]];
    const float normal[3] = {area.hits.normal[0][i], area.hits.normal[1][i], area.hits.normal[2][i]};
    const float direction[3] = {area.rays.direction[0][i], area.rays.direction[1][i],
                                area.rays.direction[2][i]};
    float turned[3];
    kernels::world_normal(instance.identity ? nullptr : &instance.to_object, normal, direction, turned);
    for (int a = 0; a < 3; ++a) area.hits.normal[a][i] = turned[a];
  }
}

}  // namespace

NIF_COMPUTES void intersect_batch(const NifSceneObject& scene, bool masked, bool normals, WorkArea& area) {
  if (scene.sole != kNoInstance)
    intersect_sole_instance(scene, masked, area);
  else
    intersect_instances(scene, masked, area);
  if (normals) turn_normals(scene, area);
}

}  // namespace nif::runtime
