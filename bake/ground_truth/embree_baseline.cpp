// Lays out rays for each call of Embree. That is separate from asking, so that a measurement can time Embree
// alone. The asking threads flush denormals, as Embree recommends.
#include "bake/ground_truth/embree_baseline.hpp"

#include <embree3/rtcore.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cstddef>
#include <cstdlib>
#include <cstring>
#include <new>

#include "formats/base/vector.hpp"

#if defined(__SSE__)
#include <pmmintrin.h>
#include <xmmintrin.h>
#endif

namespace nif::bake {
namespace {

constexpr size_t kRayComponents = sizeof(RTCRay) / sizeof(float),
                 kRayHitComponents = sizeof(RTCRayHit) / sizeof(float);
static_assert(sizeof(RTCRayHit16) == 16 * sizeof(RTCRayHit), "packets have no gaps");

/// Floats of a ray, including room for its hit if the call finds one.
size_t components_of(EmbreeCall call) { return finds_first_hits(call) ? kRayHitComponents : kRayComponents; }

/// Rays whose components are stored side by side: a packet's width, or a whole chunk.
size_t width_of(EmbreeCall call) {
  switch (call) {
    case EmbreeCall::occluded1:
    case EmbreeCall::occluded1M:
    case EmbreeCall::intersect1:
    case EmbreeCall::intersect1M:
      return 1;
    case EmbreeCall::occluded4:
    case EmbreeCall::intersect4:
      return 4;
    case EmbreeCall::occluded8:
    case EmbreeCall::intersect8:
      return 8;
    case EmbreeCall::occluded16:
    case EmbreeCall::occludedNM:
    case EmbreeCall::intersect16:
      return 16;
    case EmbreeCall::occludedNp:
      return kRayChunk;
  }
  return 1;
}

/// Embree asks for this mode on every thread that traces: denormals would cost it time.
class FlushDenormals {
#if defined(__SSE__)
 public:
  FlushDenormals() {
    _MM_SET_FLUSH_ZERO_MODE(_MM_FLUSH_ZERO_ON);
    _MM_SET_DENORMALS_ZERO_MODE(_MM_DENORMALS_ZERO_ON);
  }
  ~FlushDenormals() { _mm_setcsr(before_); }

 private:
  unsigned before_ = _mm_getcsr();
#endif
};

/// Fills up the last packets: it contains no points, so it costs nothing.
constexpr Segment kNone{{0, 0, 0}, {1, 0, 0}, 0, -1};

/// A ray among `width` rays whose components are stored side by side.
void put(float* first, size_t width, const Segment& segment, float tmin, float tmax) {
  const auto component = [&](size_t c) -> float& { return first[c * width]; };
  for (size_t a = 0; a < 3; ++a) {
    component(a) = segment.origin[a];
    component(4 + a) = segment.direction[a];
  }
  component(3) = tmin;
  component(7) = 0;
  component(8) = tmax;
  const uint32_t integers[3] = {0xffffffffu, 0, 0};
  for (size_t k = 0; k < 3; ++k) std::memcpy(&component(9 + k), &integers[k], 4);
}

// Where a hit's numbers are among the components.
constexpr size_t kPrimitive = offsetof(RTCRayHit, hit.primID) / sizeof(float),
                 kGeometry = offsetof(RTCRayHit, hit.geomID) / sizeof(float);

/// Writes all of it, so that Embree finds it in the caches like the ray.
void put_no_hit(float* first, size_t width) {
  for (size_t c = kRayComponents; c < kRayHitComponents; ++c) {
    const uint32_t value = c >= kPrimitive ? RTC_INVALID_GEOMETRY_ID : 0;
    std::memcpy(&first[c * width], &value, 4);
  }
}

void ask_chunk(RTCScene scene, RTCIntersectContext& context, EmbreeCall call, float* chunk, size_t rays) {
  alignas(64) int valid[16];
  std::fill(std::begin(valid), std::end(valid), -1);
  const size_t width = width_of(call), packets = (rays + width - 1) / width;
  const auto packet = [&](size_t i) { return chunk + i * width * components_of(call); };
  const auto array = [&](size_t component) { return chunk + component * kRayChunk; };
  switch (call) {
    case EmbreeCall::occluded1:
      for (size_t i = 0; i < packets; ++i)
        rtcOccluded1(scene, &context, reinterpret_cast<RTCRay*>(packet(i)));
      break;
    case EmbreeCall::occluded4:
      for (size_t i = 0; i < packets; ++i)
        rtcOccluded4(valid, scene, &context, reinterpret_cast<RTCRay4*>(packet(i)));
      break;
    case EmbreeCall::occluded8:
      for (size_t i = 0; i < packets; ++i)
        rtcOccluded8(valid, scene, &context, reinterpret_cast<RTCRay8*>(packet(i)));
      break;
    case EmbreeCall::occluded16:
      for (size_t i = 0; i < packets; ++i)
        rtcOccluded16(valid, scene, &context, reinterpret_cast<RTCRay16*>(packet(i)));
      break;
    case EmbreeCall::occluded1M:
      rtcOccluded1M(scene, &context, reinterpret_cast<RTCRay*>(chunk), unsigned(rays), sizeof(RTCRay));
      break;
    case EmbreeCall::occludedNM:
      rtcOccludedNM(scene, &context, reinterpret_cast<RTCRayN*>(chunk), unsigned(width), unsigned(packets),
                    width * sizeof(RTCRay));
      break;
    case EmbreeCall::occludedNp: {
      const auto whole = [&](size_t component) { return reinterpret_cast<unsigned*>(array(component)); };
      const RTCRayNp arrays{array(0), array(1), array(2), array(3), array(4),  array(5),
                            array(6), array(7), array(8), whole(9), whole(10), whole(11)};
      rtcOccludedNp(scene, &context, &arrays, unsigned(rays));
      break;
    }
    case EmbreeCall::intersect1:
      for (size_t i = 0; i < packets; ++i)
        rtcIntersect1(scene, &context, reinterpret_cast<RTCRayHit*>(packet(i)));
      break;
    case EmbreeCall::intersect4:
      for (size_t i = 0; i < packets; ++i)
        rtcIntersect4(valid, scene, &context, reinterpret_cast<RTCRayHit4*>(packet(i)));
      break;
    case EmbreeCall::intersect8:
      for (size_t i = 0; i < packets; ++i)
        rtcIntersect8(valid, scene, &context, reinterpret_cast<RTCRayHit8*>(packet(i)));
      break;
    case EmbreeCall::intersect16:
      for (size_t i = 0; i < packets; ++i)
        rtcIntersect16(valid, scene, &context, reinterpret_cast<RTCRayHit16*>(packet(i)));
      break;
    case EmbreeCall::intersect1M:
      rtcIntersect1M(scene, &context, reinterpret_cast<RTCRayHit*>(chunk), unsigned(rays), sizeof(RTCRayHit));
      break;
  }
}

}  // namespace

std::string_view name_of(EmbreeCall call) {
  switch (call) {
    case EmbreeCall::occluded1:
      return "rtcOccluded1";
    case EmbreeCall::occluded4:
      return "rtcOccluded4";
    case EmbreeCall::occluded8:
      return "rtcOccluded8";
    case EmbreeCall::occluded16:
      return "rtcOccluded16";
    case EmbreeCall::occluded1M:
      return "rtcOccluded1M";
    case EmbreeCall::occludedNM:
      return "rtcOccludedNM";
    case EmbreeCall::occludedNp:
      return "rtcOccludedNp";
    case EmbreeCall::intersect1:
      return "rtcIntersect1";
    case EmbreeCall::intersect4:
      return "rtcIntersect4";
    case EmbreeCall::intersect8:
      return "rtcIntersect8";
    case EmbreeCall::intersect16:
      return "rtcIntersect16";
    case EmbreeCall::intersect1M:
      return "rtcIntersect1M";
  }
  return "";
}

void EmbreeRays::Free::operator()(float* memory) const { std::free(memory); }

EmbreeRays::EmbreeRays(size_t count) : capacity_((count + kRayChunk - 1) / kRayChunk) {
  memory_.reset(static_cast<float*>(std::aligned_alloc(
      64, std::max<size_t>(1, capacity_) * kRayChunk * kRayHitComponents * sizeof(float))));
  if (!memory_) throw std::bad_alloc();
}

float* EmbreeRays::place(size_t ray) const {
  const size_t width = width_of(call_);
  return memory_.get() + ray / width * width * components_of(call_) + ray % width;
}

void EmbreeRays::lay_out(std::span<const Segment> segments, EmbreeCall call) {
  call_ = call;
  count_ = segments.size();
  const size_t width = width_of(call), chunks = (count_ + kRayChunk - 1) / kRayChunk;
  tbb::parallel_for(size_t{0}, chunks, [&](size_t b) {
    for (size_t i = b * kRayChunk; i < (b + 1) * kRayChunk; ++i) {
      const Segment& segment = i < count_ ? segments[i] : kNone;
      put(place(i), width, segment, segment.tmin, segment.tmax);
      if (finds_first_hits(call)) put_no_hit(place(i), width);
    }
  });
}

void EmbreeRays::ask(const EmbreeScene& scene, bool coherent) {
  const size_t chunks = (count_ + kRayChunk - 1) / kRayChunk;
  tbb::parallel_for(size_t{0}, chunks, [&](size_t b) {
    const FlushDenormals mode;
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    context.flags = coherent ? RTC_INTERSECT_CONTEXT_FLAG_COHERENT : RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
    ask_chunk(scene.handle(), context, call_, memory_.get() + b * kRayChunk * components_of(call_),
              std::min(kRayChunk, count_ - b * kRayChunk));
  });
}

size_t EmbreeRays::wrong(std::span<const uint8_t> visible) const {
  const size_t width = width_of(call_);
  const bool hits = finds_first_hits(call_);
  size_t wrong = 0;
  for (size_t i = 0; i < count_; ++i) {
    const float* ray = place(i);
    uint32_t geometry = 0;
    if (hits) std::memcpy(&geometry, &ray[kGeometry * width], 4);
    const bool blocked = hits ? geometry != RTC_INVALID_GEOMETRY_ID : ray[8 * width] == -kInfinity;
    wrong += blocked == (visible[i] != 0);
  }
  return wrong;
}

void ask_parts(const EmbreeScene& scene, EmbreeCall call, std::span<const Segment> segments,
               std::span<const uint32_t> rays, const float* tmin, const float* tmax, uint8_t* visible) {
  tbb::parallel_for(size_t{0}, (rays.size() + kRayChunk - 1) / kRayChunk, [&](size_t b) {
    const FlushDenormals mode;
    alignas(64) static thread_local float chunk[kRayChunk * kRayComponents];
    const size_t first = b * kRayChunk, count = std::min(kRayChunk, rays.size() - first),
                 width = width_of(call), filled = (count + width - 1) / width * width;
    const auto place = [&](size_t i) { return chunk + (i / width * width * kRayComponents) + i % width; };
    for (size_t i = 0; i < filled; ++i) {
      const size_t k = first + i;
      if (i < count)
        put(place(i), width, segments[rays[k]], tmin[k], tmax[k]);
      else
        put(place(i), width, kNone, kNone.tmin, kNone.tmax);
    }
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    ask_chunk(scene.handle(), context, call, chunk, count);
    for (size_t i = 0; i < count; ++i) visible[rays[first + i]] = place(i)[8 * width] != -kInfinity;
  });
}

}  // namespace nif::bake
