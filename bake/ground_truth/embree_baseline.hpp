// The baseline to beat: Embree's calls for occlusion and for first hits, on rays in the layout that each call
// needs.
#pragma once

#include <array>
#include <memory>
#include <span>
#include <string_view>

#include "bake/ground_truth/embree_truth.hpp"

namespace nif::bake {

/// rtcOccluded1 in a loop; packets of 4, 8 and 16; streams of single rays (1M), of packets of 16 (NM), of
/// arrays by component (Np). Likewise rtcIntersect.
enum class EmbreeCall : uint32_t {
  occluded1,
  occluded4,
  occluded8,
  occluded16,
  occluded1M,
  occludedNM,
  occludedNp,
  intersect1,
  intersect4,
  intersect8,
  intersect16,
  intersect1M
};
inline constexpr std::array kEmbreeCalls{
    EmbreeCall::occluded1,  EmbreeCall::occluded4,  EmbreeCall::occluded8,   EmbreeCall::occluded16,
    EmbreeCall::occluded1M, EmbreeCall::occludedNM, EmbreeCall::occludedNp,  EmbreeCall::intersect1,
    EmbreeCall::intersect4, EmbreeCall::intersect8, EmbreeCall::intersect16, EmbreeCall::intersect1M};

/// False: it only says whether there is a hit.
constexpr bool finds_first_hits(EmbreeCall call) { return call >= EmbreeCall::intersect1; }
/// Takes rays one by one, so that their coherence does not matter to it.
constexpr bool takes_single_rays(EmbreeCall call) {
  return call == EmbreeCall::occluded1 || call == EmbreeCall::intersect1;
}

/// As in Embree's header: "rtcOccluded16".
std::string_view name_of(EmbreeCall call);

/// Rays that a thread takes at a time, and the length of a stream.
inline constexpr size_t kRayChunk = 1024;

/// Rays for one of Embree's calls, which overwrites them with its answers.
class EmbreeRays {
 public:
  /// Room for `count` rays for any call.
  explicit EmbreeRays(size_t count);

  /// Lays out the rays, at most `count`, for a call, in parallel.
  void lay_out(std::span<const Segment> segments, EmbreeCall call);
  /// Asks about all of them, on the threads of the calling task arena. `coherent`: the hint of that name.
  void ask(const EmbreeScene& scene, bool coherent);
  /// After ask(): how many rays are blocked, or hit something, although the ground truth says otherwise.
  size_t wrong(std::span<const uint8_t> visible) const;

 private:
  /// The first component of a ray; the others follow, the call's width apart.
  float* place(size_t ray) const;

  struct Free {
    void operator()(float* memory) const;
  };
  std::unique_ptr<float[], Free> memory_;
  size_t capacity_, count_ = 0;
  EmbreeCall call_ = EmbreeCall::occluded1;
};

/// Asks with a call for occlusion about parts of some rays, on the threads of the calling task arena: segment
/// rays[k] from tmin[k] to tmax[k]. visible[rays[k]] becomes 1 or 0.
void ask_parts(const EmbreeScene& scene, EmbreeCall call, std::span<const Segment> segments,
               std::span<const uint32_t> rays, const float* tmin, const float* tmax, uint8_t* visible);

}  // namespace nif::bake
