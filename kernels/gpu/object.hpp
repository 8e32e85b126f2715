// What objects of all encodings share: their data in a scene, their answer, and the item of work for their
// network.
#pragma once

#include "kernels/gpu/shim.hpp"
#include "kernels/reference/arithmetic.hpp"
#include "kernels/reference/hit_details.hpp"
#include "kernels/reference/ray.hpp"

namespace nif::kernels::gpu {

/// Block size of kernels that do not say otherwise.
inline constexpr uint32_t kBlockThreads = 128;

/// Shared memory that a block can have on every target without requesting more.
inline constexpr uint32_t kSharedLimit = 48 * 1024;

/// An object's answer for one ray: visible if the logit is not negative.
struct ObjectAnswer {
  int32_t logit;
  bool certain;
};

/// An object of a scene. In device memory, like everything that it points to.
struct SceneObject {
  const void* field;  ///< its encoding's Field
  uint32_t kind;      ///< one bit: the kind of object (gpu_encodings.hpp)
  uint32_t widest;    ///< encoding-specific: neurons of the widest layer that rows have room for
  uint32_t lists[2];  ///< of the pipeline: for items of the encoding's first sort, and of its second
  Calibration calibration;
  float reach_scale;
  uint32_t number;  ///< in its asset
  HitDetails details;
};

/// An item of the pipeline in the making: a ray that waits for a network. Its words are in the thread's
/// column of shared memory, kBlockThreads apart.
struct OpenItem {
  uint32_t instance;
  uint32_t list;
  uint32_t about;  ///< the encoding defines it
  uint32_t words;  ///< number of its words, up to kItemWords
};
inline constexpr uint32_t kItemWords = 15;

/// A place in a list for each lane that wants one: the wave reserves them for all its lanes at once.
/// Undefined for the other lanes. All lanes of a wave must call this.
template <class Thread>
NIF_HOST_DEVICE uint32_t append(const Thread& thread, bool wanted, uint32_t* count) {
  const uint64_t all = thread.ballot(wanted);
  if (all == 0) return 0;
  uint32_t first = 0;
  if (thread.lane() == 0) first = thread.add(count, count_bits(all));
  return thread.shuffle(first, 0) + count_bits(all & ((uint64_t{1} << thread.lane()) - 1));
}

}  // namespace nif::kernels::gpu
