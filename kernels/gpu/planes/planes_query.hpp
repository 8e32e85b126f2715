// The first hit of an object that has planes, by the traversal of kernels/gpu, with the bits of
// kernels/reference/planes/planes_hit.hpp.
//
// A list of the open cells, as in the reference, would take 1.5 kB of memory per thread. Most rays have one
// or two open cells, so a traversal keeps only the last one, and where the first is entered. To get another
// one, it traverses again, which takes few registers and no memory.
#pragma once

#include "kernels/gpu/object.hpp"
#include "kernels/gpu/planes/skipping_traversal.hpp"
#include "kernels/reference/planes/open.hpp"
#include "kernels/reference/planes/planes_hit.hpp"

namespace nif::kernels::gpu {

// What proofs alone say about a ray, by the traversal of kernels/gpu, with the bits of
// kernels/reference/planes/open.hpp.

/// `open` is defined only if the answer is not certain.
NIF_HOST_DEVICE inline ObjectAnswer prove_ray(const PlanesField& field, const TraversalWords& words,
                                              const Segment& segment, OpenInterval& open) {
  TraversalResult traversal;
  traverse_object(field, words, segment, traversal, KeepOpen{open});
  const Answer answer = answer_of(field, segment, traversal, open);
  return {answer.logit, answer.certain};
}

struct KeepEnds {
  float& first_enter;
  OpenCell& last;
  NIF_HOST_DEVICE void operator()(uint32_t number, const OpenCell& cell) const {
    if (number == 0) first_enter = cell.enter;
    last = cell;
  }
};
struct KeepCell {
  uint32_t wanted;
  OpenCell& kept;
  NIF_HOST_DEVICE void operator()(uint32_t number, const OpenCell& cell) const {
    if (number == wanted) kept = cell;
  }
};

/// The open cells of a segment's traversal, as hit_in_cells() needs them. It never asks for a cell that the
/// reference has replaced by another.
struct TraversedCells {
  const PlanesField& field;
  const TraversalWords& words;
  const Segment& segment;
  const float& entered;
  const OpenCell& ending;
  NIF_HOST_DEVICE float first_enter() const { return entered; }
  NIF_HOST_DEVICE const OpenCell& last() const { return ending; }
  NIF_HOST_DEVICE OpenCell at(uint32_t i) const {
    TraversalResult traversal;
    OpenCell cell{};
    traverse_object<true>(field, words, segment, traversal, KeepCell{i, cell});
    return cell;
  }
};

/// Like hit_by_planes().
template <class Network>
NIF_HOST_DEVICE NIF_INLINE Hit find_hit_by_planes(const PlanesField& field, const TraversalWords& words,
                                                  const Segment& segment, float limit,
                                                  const Network& network) {
  TraversalResult traversal;
  float first_enter = 0;
  OpenCell last{};
  traverse_object<true>(field, words, segment, traversal, KeepEnds{first_enter, last});
  return hit_in_cells(field, segment, traversal, TraversedCells{field, words, segment, first_enter, last},
                      limit, network);
}

}  // namespace nif::kernels::gpu
