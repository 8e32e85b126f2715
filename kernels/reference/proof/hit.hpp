// The first hit of an object that has a grid with planes: where a walk proves one, or leaves it open.
//
// What is met lies in an open cell: planes prove that nothing else holds a triangle, and a wall, or a way
// from what is proven outside to what is proven inside, that the last cell does where the walk ends there.
// Which of the cells it is, a network may say: of the segment up to the end of each.
#pragma once

#include <type_traits>

#include "kernels/reference/hit.hpp"
#include "kernels/reference/proof/open.hpp"

namespace nif::kernels {

/// The open cells of a walk, in order. Of more than there is room for, the last takes the place of those
/// before it.
struct OpenCells {
  static constexpr uint32_t kRoom = 64;
  OpenCell cells[kRoom];
};
struct KeepCells {
  OpenCells& open;
  NIF_HOST_DEVICE void operator()(uint32_t number, const OpenCell& cell) const {
    open.cells[number < OpenCells::kRoom ? number : OpenCells::kRoom - 1] = cell;
  }
};
NIF_HOST_DEVICE inline uint32_t kept_cells(const WalkResult& walk) {
  return walk.run_count < OpenCells::kRoom ? walk.run_count : OpenCells::kRoom;
}

/// What a walk proves of the first hit, as t: everything but its place. `certain`: as of the walk, where it
/// is not ambiguous; `first`: where the first open cell is entered, or where there is none the last piece;
/// `last`: where that is left.
NIF_HOST_DEVICE inline Hit bounds_of(const ProofField& field, const Segment& segment, Verdict verdict,
                                     bool certain, float first, float last) {
  if (verdict == Verdict::visible) return no_hit(certain);
  Hit hit;
  // From farther away the rounding of `first` may be more than what cells are padded by.
  if (is_culled(field, segment))
    hit.low = first;
  else if (verdict == Verdict::occluded && certain)
    hit.low = segment.tmin;
  if (verdict == Verdict::occluded && certain) hit.high = last;
  return hit;
}

/// In the middle between the planes of a cell that is passed.
NIF_HOST_DEVICE inline void place_hit(const OpenCell& cell, Hit& hit) {
  const float middle = cell.begin + 0.5f * (cell.end - cell.begin);
  hit.t = max_of(min_of(middle, min_of(cell.end, kNever)), -kNever);  // finite, whatever the ends are
  if (cell.word == kBareCell) return;
  const CellNormal normal = cell_normal(cell.word);
  hit.normal[0] = static_cast<float>(normal.x);
  hit.normal[1] = static_cast<float>(normal.y);
  hit.normal[2] = static_cast<float>(normal.z);
}

/// Says nothing of what is left open: that counts as occluded, and as met in the last open cell.
struct NoNetwork {};

/// The first of the open cells up to whose end the segment is occluded, by halves; the last one where no
/// other is.
template <class Network>
NIF_HOST_DEVICE uint32_t first_cell(const Segment& segment, const OpenCells& open, uint32_t count,
                                    const Network& network) {
  uint32_t first = 0, last = count - 1;
  if constexpr (std::is_same_v<Network, NoNetwork>) {
    first = last;
  } else {
    while (first < last) {
      const uint32_t middle = (first + last) / 2;
      Segment part = segment;
      part.tmax = open.cells[middle].leave;
      if (network(part))
        last = middle;
      else
        first = middle + 1;
    }
  }
  return first;
}

/// Field: as follow_segment() has it. `network(segment)`: is a segment that is left open occluded? It is
/// asked about the whole one, and about parts from its begin on.
template <class Field, class Network>
NIF_HOST_DEVICE Hit hit_by_planes(const Field& field, const Segment& segment, float limit,
                                  const Network& network) {
  WalkResult walk;
  OpenCells open;
  follow_segment<true>(field, segment, walk, KeepCells{open}, NoVisit());
  Hit hit = bounds_of(field, segment, walk.verdict, walk.certain,
                      walk.run_count != 0 ? open.cells[0].enter : walk.last_enter, walk.last_leave);
  if (walk.verdict == Verdict::visible) return hit;
  if (hit.low > limit) {
    hit.t = hit.low;
    return hit;
  }
  if constexpr (!std::is_same_v<Network, NoNetwork>)
    if (walk.verdict == Verdict::ambiguous && !network(segment)) return hit;
  if (walk.run_count == 0)  // from one side to the other, between two pieces
    hit.t = walk.last_enter;
  else
    place_hit(open.cells[first_cell(segment, open, kept_cells(walk), network)], hit);
  return hit;
}

inline Hit intersect(const ProofField& field, const Segment& segment, float limit = kNoHit) {
  return hit_by_planes(field, segment, limit, NoNetwork());
}

}  // namespace nif::kernels
