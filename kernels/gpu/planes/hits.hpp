// The first hit of an object that has planes, by the traversal of kernels/gpu, with the bits of
// kernels/reference/planes/hit.hpp.
//
// A list of the open cells, as in the reference, would take 1.5 kB of memory per thread. Most rays have one
// or two open cells, so a traversal keeps only the last one, and where the first is entered. To get another
// one, it traverses again, which takes few registers and no memory.
#pragma once

#include "kernels/gpu/planes/leaping_walk.hpp"
#include "kernels/reference/planes/hit.hpp"

namespace nif::kernels::gpu {

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
struct WalkedCells {
  const PlanesField& field;
  const WalkWords& words;
  const Segment& segment;
  const float& entered;
  const OpenCell& ending;
  NIF_HOST_DEVICE float first_enter() const { return entered; }
  NIF_HOST_DEVICE const OpenCell& last() const { return ending; }
  NIF_HOST_DEVICE OpenCell at(uint32_t i) const {
    WalkResult walk;
    OpenCell cell{};
    walk_object<true>(field, words, segment, walk, KeepCell{i, cell});
    return cell;
  }
};

/// Like hit_by_planes().
template <class Network>
NIF_HOST_DEVICE NIF_INLINE Hit find_hit_by_planes(const PlanesField& field, const WalkWords& words,
                                                  const Segment& segment, float limit,
                                                  const Network& network) {
  WalkResult walk;
  float first_enter = 0;
  OpenCell last{};
  walk_object<true>(field, words, segment, walk, KeepEnds{first_enter, last});
  return hit_in_cells(field, segment, walk, WalkedCells{field, words, segment, first_enter, last}, limit,
                      network);
}

}  // namespace nif::kernels::gpu
