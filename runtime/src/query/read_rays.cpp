// Reads rays column by column, so that the compiler vectorizes it: kernels take only about 80 cycles per ray,
// and reading must be cheap compared to that.
#include "query/read_rays.hpp"

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <limits>

#include "query/float4.hpp"
#include "query/nif_rays.hpp"

namespace nif::runtime {
namespace {

/// Computes in integers: a stride may be negative (in two's complement), and pointers must not overflow.
uintptr_t address(const void* array, uint64_t stride, uint64_t i) {
  return reinterpret_cast<uintptr_t>(array) + uintptr_t(i * stride);
}
const char* at(const void* array, uint64_t stride, uint64_t i) {
  return reinterpret_cast<const char*>(address(array, stride, i));
}

template <class T>
void read_column(const T* array, uint64_t stride, uint64_t first, uint32_t count, T* column) {
  if (stride == sizeof(T)) {
    std::memcpy(column, at(array, stride, first), count * sizeof(T));
  } else if (stride == 0) {
    T value;
    std::memcpy(&value, array, sizeof(value));
    std::fill_n(column, count, value);
  } else {
    uintptr_t from = address(array, stride, first);
    for (uint32_t i = 0; i < count; ++i, from += uintptr_t(stride))
      std::memcpy(column + i, reinterpret_cast<const char*>(from), sizeof(T));
  }
}

/// Transposes halves of four NifRay structures into four columns.
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

}  // namespace

void read_rays(const NifRays& query, uint64_t first, uint32_t count, WorkArea& area) {
  kernels::SegmentBatch& rays = area.rays;
  rays.count = count;
  if (query.mask) read_column(query.mask, query.mask_stride, first, count, area.mask);
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

}  // namespace nif::runtime
