// What kernels of all encodings share.
#pragma once

#include "kernels/reference/segment/query.hpp"

namespace nif::kernels::gpu {

/// Threads of the blocks of kernels that do not say otherwise.
inline constexpr uint32_t kBlockThreads = 128;

/// What blocks may have of shared memory on every target, without asking for more.
inline constexpr uint32_t kSharedLimit = 48 * 1024;

/// An object's answer for one ray: visible where the logit is not negative.
struct ObjectAnswer {
  int32_t logit;
  bool certain;
};

/// That of a walk that needs no network.
NIF_HOST_DEVICE inline ObjectAnswer answer_of(const WalkResult& walk) {
  return {walk.verdict == Verdict::visible ? kCertainLogit : -kCertainLogit, walk.certain};
}

/// A place in a list for each lane that wants one: the wave asks for all its lanes at once. What is returned
/// to the others has no meaning. For all lanes of a wave.
template <class Thread>
NIF_HOST_DEVICE uint32_t append(const Thread& thread, bool wanted, uint32_t* count) {
  const uint64_t all = thread.ballot(wanted);
  if (all == 0) return 0;
  uint32_t first = 0;
  if (thread.lane() == 0) first = thread.add(count, count_bits(all));
  return thread.shuffle(first, 0) + count_bits(all & ((uint64_t{1} << thread.lane()) - 1));
}

}  // namespace nif::kernels::gpu
