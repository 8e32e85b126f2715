// Rays and answers as kernels take them: component by component, so that neighbouring threads read
// neighbouring words.
#pragma once

#include "kernels/reference/segment.hpp"

namespace nif::kernels::hip {

/// Threads of the blocks of kernels that do not say otherwise.
inline constexpr uint32_t kBlockThreads = 128;

/// What blocks may have of shared memory on every target, without asking for more.
inline constexpr uint32_t kSharedLimit = 48 * 1024;

/// Device memory, [count] each, in object space.
struct RayArrays {
  const float* origin[3];
  const float* direction[3];
  const float* tmin;
  const float* tmax;
  uint32_t count;
};

/// Device memory, [RayArrays::count] each, as an AnswerBatch (kernels/object_kernel.hpp): visible where the
/// logit is not negative.
struct AnswerArrays {
  int32_t* logit;
  uint8_t* certain;
};

/// Some of the rays: `rays` has *count numbers of rays; or all of them, where it is null.
struct RayList {
  const uint32_t* rays;
  const uint32_t* count;
};

NIF_HOST_DEVICE inline Segment load_ray(const RayArrays& rays, uint32_t i) {
  Segment segment;
  for (int a = 0; a < 3; ++a) {
    segment.origin[a] = rays.origin[a][i];
    segment.direction[a] = rays.direction[a][i];
  }
  segment.tmin = rays.tmin[i];
  segment.tmax = rays.tmax[i];
  return segment;
}

/// An object's answer for one ray, as in AnswerArrays.
struct ObjectAnswer {
  int32_t logit;
  bool certain;
};

/// That of a walk that needs no network.
NIF_HOST_DEVICE inline ObjectAnswer answer_of(const WalkResult& walk) {
  return {walk.verdict == Verdict::visible ? kCertainLogit : -kCertainLogit, walk.certain};
}

NIF_HOST_DEVICE inline void store_answer(const AnswerArrays& answers, uint32_t i,
                                         const ObjectAnswer& answer) {
  answers.logit[i] = answer.logit;
  answers.certain[i] = answer.certain;
}

/// Calls answer(ray) for each ray of the list, or for each of all, spread over the threads of the grid, in
/// blocks of kThreads.
template <uint32_t kThreads, class Thread, class Answer>
NIF_HOST_DEVICE void for_each_ray(const Thread& thread, const RayArrays& rays, const RayList& list,
                                  const Answer& answer) {
  const uint32_t count = list.rays ? *list.count : rays.count, step = thread.blocks() * kThreads;
  uint32_t i = thread.block() * kThreads + thread.index();
  while (i < count) {
    answer(list.rays ? list.rays[i] : i);
    if (count - i <= step) return;  // i + step may be more than 32 bits
    i += step;
  }
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

}  // namespace nif::kernels::hip
