// Writes answers column by column, so that the compiler vectorizes it. Colours are looked up only if wanted.
#include "query/write_answers.hpp"

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <cstring>

#include "kernels/reference/batch.hpp"
#include "kernels/reference/instance.hpp"
#include "kernels/reference/planes/open.hpp"
#include "query/float_environment.hpp"

namespace nif::runtime {
namespace {

using kernels::kNoHit;
using kernels::kNoInstance;
using kernels::Segment;
using kernels::segment_of;

/// Packs eight bytes of 0 or 1 into eight bits by one multiplication: byte k's bit lands at bit 56 + k, and
/// no two bits add up below that.
uint8_t pack(const uint8_t* bytes) {
  uint64_t word = 0;
  for (int k = 0; k < 8; ++k) word |= uint64_t(bytes[k]) << (8 * k);
  return uint8_t((word * 0x0102040810204080u) >> 56);
}

template <class T>
void copy_out(T* array, uint64_t first, const T* from, uint32_t count) {
  if (array) std::memcpy(reinterpret_cast<char*>(array) + first * sizeof(T), from, count * sizeof(T));
}

/// The colour of the surface that ray i hits; 0 if it hits none.
void find_color(const NifSceneObject& scene, const WorkArea& area, uint32_t i, float (&color)[3]) {
  color[0] = color[1] = color[2] = 0;
  if (area.hit_instance[i] == kNoInstance) return;
  const Instance& instance = scene.instances[area.hit_instance[i]];
  const Segment ray = segment_of(area.rays, i);
  color_at(scene.objects[instance.object].details.colors,
           instance.identity ? ray : kernels::to_object(instance.to_object, ray), area.hits.t[i], color);
}

/// Writes value(0), value(1), ...
template <class T, class Value>
void write_each(T* array, uint64_t first, uint32_t count, const Value& value) {
  if (!array) return;
  char* to = reinterpret_cast<char*>(array) + first * sizeof(T);
  for (uint32_t i = 0; i < count; ++i, to += sizeof(T)) {
    const T one = value(i);
    std::memcpy(to, &one, sizeof(T));
  }
}

}  // namespace

void list_open_rays(const NifOpenRays& lists, uint64_t first, WorkArea& area) {
  uint32_t open = 0;
  for (uint32_t i = 0; i < area.rays.count; ++i) {
    if (area.answers.certain[i]) continue;
    kernels::BoxRay prepared;
    // A sole instance is queried even for rays that are invalid in world space, and may leave them open.
    if (area.answers.logit[i] >= 0 && !kernels::prepare_box_ray(kernels::segment_of(area.rays, i), prepared))
      continue;
    area.answers.logit[i] = kernels::kOpenLogit;
    area.probability[i] = 0.5f;
    area.open.begin[open] = area.open.begin[i];
    area.open.end[open] = area.open.end[i];
    area.open_instance[open] = area.open_instance[i];
    area.open_rays[open++] = uint32_t(first) + i;
  }
  if (open == 0) return;
  const uint64_t at = std::atomic_ref<uint32_t>(*lists.count).fetch_add(open);
  if (at >= lists.capacity) return;
  const auto room = uint32_t(std::min<uint64_t>(open, lists.capacity - at));
  copy_out(lists.rays, at, area.open_rays, room);
  copy_out(lists.tmin, at, area.open.begin, room);
  copy_out(lists.tmax, at, area.open.end, room);
  copy_out(lists.instance, at, area.open_instance, room);
}

void write_answers(const NifAnswers& to, uint64_t first, uint32_t count, WorkArea& area) {
  if (to.visible || to.visible_bits) {
    uint8_t* visible = area.visible;
    for (uint32_t i = 0; i < count; ++i) visible[i] = uint8_t(~uint32_t(area.answers.logit[i]) >> 31);
    copy_out(to.visible, first, visible, count);
    if (to.visible_bits) {
      std::fill(visible + count, visible + (count + 7) / 8 * 8, uint8_t{0});
      uint8_t* bits = to.visible_bits + first / 8;
      for (uint32_t i = 0; i < count; i += 8) *bits++ = pack(visible + i);
    }
  }
  copy_out(to.probability, first, area.probability, count);
  copy_out(to.certain, first, area.answers.certain, count);
  copy_out(to.logit, first, area.answers.logit, count);
}

NIF_COMPUTES void write_hits(const NifSceneObject& scene, const NifHits& hits, uint64_t first,
                             WorkArea& area) {
  const uint32_t count = area.rays.count;
  const kernels::HitBatch& found = area.hits;
  copy_out(hits.t, first, found.t, count);
  copy_out(hits.t_low, first, found.low, count);
  copy_out(hits.t_high, first, found.high, count);
  copy_out(hits.u, first, found.u, count);
  copy_out(hits.v, first, found.v, count);
  copy_out(hits.instance, first, area.hit_instance, count);
  write_each(hits.hit, first, count, [&](uint32_t i) { return uint8_t(found.t[i] < kNoHit); });
  write_each(hits.certain, first, count,
             [&](uint32_t i) { return uint8_t(found.high[i] < kNoHit || found.low[i] == kNoHit); });
#ifndef __wasm__  // where code size matters
  if (scene.sole != kNoInstance) {
    // Read once: the compiler must assume that what is written changes them.
    const kernels::SourceTriangles numbers =
        scene.objects[scene.instances[scene.sole].object].details.source_triangles;
    write_each(hits.triangle, first, count, [&](uint32_t i) {
      return area.hit_instance[i] == kNoInstance ? kernels::kNoTriangle
                                                 : source_triangle(numbers, found.triangle[i]);
    });
  } else
#endif
    write_each(hits.triangle, first, count, [&](uint32_t i) {
      const uint32_t instance = area.hit_instance[i];
      return instance == kNoInstance
                 ? kernels::kNoTriangle
                 : source_triangle(scene.objects[scene.instances[instance].object].details.source_triangles,
                                   found.triangle[i]);
    });
  write_each(hits.object, first, count, [&](uint32_t i) {
    const uint32_t instance = area.hit_instance[i];
    return instance == kNoInstance ? kNoInstance : scene.objects[scene.instances[instance].object].number;
  });
  write_each(hits.user, first, count, [&](uint32_t i) {
    const uint32_t instance = area.hit_instance[i];
    return instance == kNoInstance ? 0 : scene.settings[instance].user;
  });
  for (uint32_t i = 0; hits.normal && i < count; ++i) {
    // One by one: three together would be gathered in memory first, and read back before they are there.
    char* to = reinterpret_cast<char*>(hits.normal) + (first + i) * sizeof(float[3]);
    for (const auto& column : found.normal) {
      std::memcpy(to, column + i, sizeof(float));
      to += sizeof(float);
    }
  }
  for (uint32_t i = 0; hits.color && i < count; ++i) {
    float color[3];
    find_color(scene, area, i, color);
    std::memcpy(reinterpret_cast<char*>(hits.color) + (first + i) * sizeof(color), color, sizeof(color));
  }
}

}  // namespace nif::runtime
