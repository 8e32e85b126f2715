// Reading and writing batches. A kernel takes some 80 cycles a ray: these loops must not show beside it, so
// they go column by column and the compiler turns them into vectors.
#include "query/batch.hpp"

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <cstring>
#include <limits>

#include "kernels/reference/batch.hpp"
#include "kernels/reference/instance.hpp"
#include "kernels/reference/planes/open.hpp"
#include "query/float4.hpp"
#include "query/float_environment.hpp"
#include "query/nif_rays.hpp"

namespace nif::runtime {
namespace {

/// A stride may be negative, as its two's complement: pointers must not overflow, integers may.
uintptr_t address(const float* array, uint64_t stride, uint64_t i) {
  return reinterpret_cast<uintptr_t>(array) + uintptr_t(i * stride);
}
const char* at(const float* array, uint64_t stride, uint64_t i) {
  return reinterpret_cast<const char*>(address(array, stride, i));
}

void read_column(const float* array, uint64_t stride, uint64_t first, uint32_t count, float* column) {
  if (stride == sizeof(float)) {
    std::memcpy(column, at(array, stride, first), count * sizeof(float));
  } else if (stride == 0) {
    float value;
    std::memcpy(&value, array, sizeof(value));
    std::fill_n(column, count, value);
  } else {
    uintptr_t from = address(array, stride, first);
    for (uint32_t i = 0; i < count; ++i, from += uintptr_t(stride))
      std::memcpy(column + i, reinterpret_cast<const char*>(from), sizeof(float));
  }
}

/// Four structures' halves to four columns.
void transpose(const char* from, float* x, float* y, float* z, float* w) {
  float row[4][4];
  for (size_t i = 0; i < 4; ++i) std::memcpy(row[i], from + i * sizeof(NifRay), sizeof(row[i]));
#if defined(__SSE__)
  __m128 r0 = _mm_loadu_ps(row[0]), r1 = _mm_loadu_ps(row[1]), r2 = _mm_loadu_ps(row[2]),
         r3 = _mm_loadu_ps(row[3]);
  _MM_TRANSPOSE4_PS(r0, r1, r2, r3);
  _mm_storeu_ps(x, r0);
  _mm_storeu_ps(y, r1);
  _mm_storeu_ps(z, r2);
  _mm_storeu_ps(w, r3);
#else
  for (size_t i = 0; i < 4; ++i) x[i] = row[i][0], y[i] = row[i][1], z[i] = row[i][2], w[i] = row[i][3];
#endif
}

void read_nif_rays(const char* from, uint32_t count, kernels::SegmentBatch& rays) {
  static_assert(sizeof(NifRay) == 32 && offsetof(NifRay, tmin) == 12 && offsetof(NifRay, direction) == 16);
  uint32_t i = 0;
  for (; i + 4 <= count; i += 4, from += 4 * sizeof(NifRay)) {
    transpose(from, rays.origin[0] + i, rays.origin[1] + i, rays.origin[2] + i, rays.tmin + i);
    transpose(from + 16, rays.direction[0] + i, rays.direction[1] + i, rays.direction[2] + i, rays.tmax + i);
  }
  for (; i < count; ++i, from += sizeof(NifRay)) {
    NifRay ray;
    std::memcpy(&ray, from, sizeof(ray));
    for (int a = 0; a < 3; ++a) {
      rays.origin[a][i] = ray.origin[a];
      rays.direction[a][i] = ray.direction[a];
    }
    rays.tmin[i] = ray.tmin;
    rays.tmax[i] = ray.tmax;
  }
}

/// Eight bytes of 0 or 1 to eight bits, by one multiplication: byte k's bit lands at bit 56 + k, and no two
/// meet below.
uint8_t pack(const uint8_t* bytes) {
  uint64_t word = 0;
  for (int k = 0; k < 8; ++k) word |= uint64_t(bytes[k]) << (8 * k);
  return uint8_t((word * 0x0102040810204080u) >> 56);
}

template <class T>
void copy_out(T* array, uint64_t first, const T* from, uint32_t count) {
  if (array) std::memcpy(reinterpret_cast<char*>(array) + first * sizeof(T), from, count * sizeof(T));
}

}  // namespace

void read_rays(const NifQuery& query, uint64_t first, uint32_t count, kernels::SegmentBatch& rays) {
  rays.count = count;
  if (are_nif_rays(query)) {
    read_nif_rays(at(query.origin[0], sizeof(NifRay), first), count, rays);
    return;
  }
  for (int a = 0; a < 3; ++a) {
    read_column(query.origin[a], query.origin_stride, first, count, rays.origin[a]);
    read_column(query.direction[a], query.direction_stride, first, count, rays.direction[a]);
  }
  if (query.tmin)
    read_column(query.tmin, query.tmin_stride, first, count, rays.tmin);
  else
    std::fill_n(rays.tmin, count, 0.0f);
  if (query.tmax)
    read_column(query.tmax, query.tmax_stride, first, count, rays.tmax);
  else
    std::fill_n(rays.tmax, count, std::numeric_limits<float>::infinity());
}

void list_open_rays(const NifOpenRays& lists, uint64_t first, WorkArea& area) {
  uint32_t open = 0;
  for (uint32_t i = 0; i < area.rays.count; ++i) {
    if (area.answers.certain[i]) continue;
    kernels::BoxRay prepared;
    // An only instance is asked of rays that are none in the world, too, and may leave them open.
    if (area.answers.logit[i] >= 0 && !kernels::prepare_box_ray(kernels::segment_of(area.rays, i), prepared))
      continue;
    area.answers.logit[i] = kernels::kOpenLogit;
    area.probability[i] = 0.5f;
    area.open.begin[open] = area.open.begin[i];
    area.open.end[open] = area.open.end[i];
    area.open_rays[open++] = uint32_t(first) + i;
  }
  if (open == 0) return;
  const uint64_t at = std::atomic_ref<uint32_t>(*lists.count).fetch_add(open);
  if (at >= lists.capacity) return;
  const auto room = uint32_t(std::min<uint64_t>(open, lists.capacity - at));
  copy_out(lists.rays, at, area.open_rays, room);
  copy_out(lists.tmin, at, area.open.begin, room);
  copy_out(lists.tmax, at, area.open.end, room);
}

void write_answers(const NifQuery& query, uint64_t first, uint32_t count, WorkArea& area) {
  if (query.visible || query.visible_bits) {
    uint8_t* visible = area.visible;
    for (uint32_t i = 0; i < count; ++i) visible[i] = uint8_t(~uint32_t(area.answers.logit[i]) >> 31);
    copy_out(query.visible, first, visible, count);
    if (query.visible_bits) {
      std::fill(visible + count, visible + (count + 7) / 8 * 8, uint8_t{0});
      uint8_t* bits = query.visible_bits + first / 8;
      for (uint32_t i = 0; i < count; i += 8) *bits++ = pack(visible + i);
    }
  }
  copy_out(query.probability, first, area.probability, count);
  copy_out(query.certain, first, area.answers.certain, count);
  copy_out(query.logit, first, area.answers.logit, count);
}

}  // namespace nif::runtime
