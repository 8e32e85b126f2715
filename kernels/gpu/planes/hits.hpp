// The first hit of an object that has a grid with planes, by the walk of kernels/gpu, to the bits of
// kernels/reference/planes/hit.hpp.
//
// A list of the open cells, as the reference has it, would be 1.5 kB of memory for each thread. Most rays
// have one open cell or two, so a walk keeps the last one, and where the first is entered. Whoever wants to
// see another one walks again, which takes few registers and no memory.
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

/// The open cells of a segment's walk, as hit_in_cells() wants them. No cell that the reference has put
/// another in the place of is asked for.
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

/// As hit_by_planes().
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
