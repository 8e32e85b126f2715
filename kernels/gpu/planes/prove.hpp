// What proofs alone say about a ray, by the traversal of kernels/gpu, with the bits of
// kernels/reference/planes/open.hpp.
#pragma once

#include "kernels/gpu/object.hpp"
#include "kernels/gpu/planes/leaping_walk.hpp"
#include "kernels/reference/planes/open.hpp"

namespace nif::kernels::gpu {

/// `open` is defined only if the answer is not certain.
NIF_HOST_DEVICE inline ObjectAnswer prove_ray(const PlanesField& field, const WalkWords& words,
                                              const Segment& segment, OpenInterval& open) {
  WalkResult walk;
  walk_object(field, words, segment, walk, KeepOpen{open});
  const Answer answer = answer_of(field, segment, walk, open);
  return {answer.logit, answer.certain};
}

}  // namespace nif::kernels::gpu
