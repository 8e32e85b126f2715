// The first hit of an object that has planes: found where a traversal proves it or leaves it open.
//
// The hit lies in an open cell. Planes prove that no other cell holds a triangle; and if the traversal ends
// at a wall, or by going from proven outside to proven inside, it proves that the last cell does. A network,
// if there is one, tells which of the open cells it is: it is asked about the segment up to the end of each.
#pragma once

#include <type_traits>

#include "kernels/reference/hit.hpp"
#include "kernels/reference/planes/open.hpp"

namespace nif::kernels {

/// The open cells of a traversal, in order. If there is no room for more, the last one replaces the one
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
NIF_HOST_DEVICE inline uint32_t kept_cells(const TraversalResult& traversal) {
  return traversal.interval_count < OpenCells::kRoom ? traversal.interval_count : OpenCells::kRoom;
}

/// What a traversal proves about the first hit, as t: everything but its position. `certain`: as of the
/// traversal, if it is not open. `first`: where the first open cell is entered, or the last cube if no
/// cell is open. `last`: where that cell or cube is left.
NIF_HOST_DEVICE inline Hit bounds_of(const PlanesField& field, const Segment& segment, Verdict verdict,
                                     bool certain, float first, float last) {
  if (verdict == Verdict::visible) return no_hit(certain);
  Hit hit;
  // From farther away the rounding of `first` may exceed the padding of cells.
  if (is_culled(field, segment))
    hit.low = first;
  else if (verdict == Verdict::occluded && certain)
    hit.low = segment.tmin;
  if (verdict == Verdict::occluded && certain) hit.high = last;
  return hit;
}

/// Puts the hit in the middle between the planes of a cell that is passed.
NIF_HOST_DEVICE inline void place_hit(const OpenCell& cell, Hit& hit) {
  const float middle = cell.begin + 0.5f * (cell.end - cell.begin);
  hit.t = max_of(min_of(middle, min_of(cell.end, kNever)), -kNever);  // finite, whatever the ends are
  if (cell.word == kBareCell) return;
  const CellNormal normal = cell_normal(cell.word);
  hit.normal[0] = static_cast<float>(normal.x);
  hit.normal[1] = static_cast<float>(normal.y);
  hit.normal[2] = static_cast<float>(normal.z);
}

/// Says nothing about an open segment: it counts as occluded, with the hit in the last open cell.
struct NoNetwork {};

/// The first hit of a segment, from its in-order traversal. `cells.first_enter()` is where the first open
/// cell is entered, `cells.last()` the last one kept, and `cells.at(i)` any other; they are called only if at
/// least one cell was kept. `network(segment)`: is a segment that is left open occluded? It is asked about
/// the whole segment, and about parts that begin at its start: the hit is in the first cell up to whose end
/// the segment is occluded, found by bisection; or in the last cell if no other has it.
template <class Cells, class Network>
NIF_HOST_DEVICE NIF_INLINE Hit hit_in_cells(const PlanesField& field, const Segment& segment,
                                            const TraversalResult& traversal, const Cells& cells, float limit,
                                            const Network& network) {
  const uint32_t count = kept_cells(traversal);
  Hit hit = bounds_of(field, segment, traversal.verdict, traversal.certain,
                      count != 0 ? cells.first_enter() : traversal.last_enter, traversal.last_leave);
  if (traversal.verdict == Verdict::visible) return hit;
  if (hit.low > limit) {
    hit.t = hit.low;
    return hit;
  }
  if (count == 0) {  // from one side to the other, between two cubes
    hit.t = traversal.last_enter;
    return hit;
  }
  OpenCell cell = cells.last();
  if constexpr (!std::is_same_v<Network, NoNetwork>) {
    // The network is called in one place, because GPUs inline all of its code there.
    bool whole = traversal.verdict == Verdict::open;
    uint32_t first = 0, last = count - 1;
    while (whole || first < last) {
      const uint32_t middle = (first + last) / 2;
      Segment part = segment;
      OpenCell asked = cell;
      if (!whole) {
        asked = cells.at(middle);
        part.tmax = asked.leave;
      }
      const bool occluded = network(part);
      if (whole && !occluded) return hit;
      if (whole)
        whole = false;
      else if (occluded)
        last = middle, cell = asked;
      else
        first = middle + 1;
    }
  }
  place_hit(cell, hit);
  return hit;
}

/// The open cells of a traversal, kept in an array.
struct ListedCells {
  const OpenCells& open;
  uint32_t count;
  NIF_HOST_DEVICE float first_enter() const { return open.cells[0].enter; }
  NIF_HOST_DEVICE OpenCell last() const { return open.cells[count - 1]; }
  NIF_HOST_DEVICE OpenCell at(uint32_t i) const { return open.cells[i]; }
};

/// Field: as for follow_segment(). `network`: as for hit_in_cells().
template <class Field, class Network>
Hit hit_by_planes(const Field& field, const Segment& segment, float limit, const Network& network) {
  TraversalResult traversal;
  OpenCells open;
  follow_segment<true>(field, segment, traversal, KeepCells{open}, NoVisit());
  return hit_in_cells(field, segment, traversal, ListedCells{open, kept_cells(traversal)}, limit, network);
}

inline Hit intersect(const PlanesField& field, const Segment& segment, float limit = kNoHit) {
  return hit_by_planes(field, segment, limit, NoNetwork());
}

}  // namespace nif::kernels
