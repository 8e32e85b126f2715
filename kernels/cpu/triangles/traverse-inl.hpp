// Traverses a `bvh` object with several rays in flight, one node of each in turn.
//
// The next step of a ray waits for its node: for the cache, and for a long chain of arithmetic. Rays that
// take turns fill that time with each other's work. How many leaves they meet, and when they finish, cannot
// be predicted: a branch on it must wait until it is known, or the speculative work is lost. So there are
// three groups of rays, and each goes through three phases: each ray tests the boxes of its node and moves to
// the next; the leaves that they met are tested; finished rays are replaced by others. Phases of the groups
// are interleaved. There are few branches within a phase.
//
// After Ylitie, Karras and Laine (HPG 2017) a stack entry holds all inner slots of a node that are still to
// be visited.
//
// Compiled once for each target.
#if defined(NIF_BVH_TRAVERSE_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef NIF_BVH_TRAVERSE_INL
#undef NIF_BVH_TRAVERSE_INL
#else
#define NIF_BVH_TRAVERSE_INL
#endif

#include <hwy/highway.h>

#include "kernels/cpu/holes/holes.hpp"
#include "kernels/cpu/triangles/boxes-inl.hpp"
#include "kernels/cpu/triangles/phases-inl.hpp"
#include "kernels/cpu/triangles/triangles-inl.hpp"
#include "kernels/reference/batch.hpp"
#ifdef NIF_DECODES
#include "kernels/cpu/triangles/decoded_traverse-inl.hpp"
#endif

HWY_BEFORE_NAMESPACE();
namespace nif::kernels::cpu::HWY_NAMESPACE {

/// Cache lines of a node's triangles and of their vertices that are fetched before its leaves are tested.
constexpr uint32_t kTriangleLines = 2, kVertexLines = 6;

/// Nodes still to be visited, all inner slots of one node: from bit 0 its first_node, from bit 32 the inner
/// slots, from bit 40 the slots to be visited.
using NodeGroup = uint64_t;
constexpr uint32_t kInnerShift = 32, kVisitShift = 40;

/// first ? a : b, written so that compilers do not branch.
HWY_INLINE uint64_t choose(bool first, uint64_t a, uint64_t b) {
  return b ^ ((a ^ b) & (0 - uint64_t(first)));
}

/// A ray in flight. Goal: what the traversal looks for; it keeps a state for each ray.
template <class Goal>
struct alignas(64) Flight {
  ReadyRay ray;
  const TrianglesField* field;        ///< that it asks
  NodeGroup group;                    ///< what comes after the next node
  uint32_t next;                      ///< node
  uint32_t size;                      ///< of the stack
  uint32_t number;                    ///< in the batch
  NodeGroup stack[kMaxBvhDepth + 2];  ///< the first is empty
  [[no_unique_address]] typename Goal::State state;
};

/// Rays that go through the phases together.
template <class Goal>
struct FlightGroup {
  Flight<Goal> flights[kFlights];
  OpenTriangles open[kFlights * kBvhWidth + 1];
  MetTriangles met[kFlights + 1];  ///< leaf slots until leaves are tested, then triangles
  uint32_t in_flight, done;        ///< one bit per flight
  uint32_t met_count, open_count;

  void clear() { in_flight = done = met_count = open_count = 0; }
};

/// Working memory of traverse().
template <class Goal>
struct TraversalScratch {
  ReadyRays ready;
  FlightGroup<Goal> groups[kFlightGroups];
};

/// Goal: does any triangle block a ray?
template <class Holes>
class AnyTriangle {
 public:
  static constexpr bool kNearestFirst = false;  ///< bakers put first what is likely to block
  struct State {};

  AnyTriangle(const Holes& holes, const SegmentBatch& batch, AnswerBatch& answers)
      : holes_(holes), batch_(batch), answers_(answers) {}

  AnswerBatch& answers() const { return answers_; }
  HWY_INLINE void begin(Flight<AnyTriangle>&) const {}
  /// Returns true if the ray is finished.
  HWY_INLINE bool look_at(const TrianglesField& field, Flight<AnyTriangle>& flight,
                          const OpenTriangles& found) const {
    if (!meets_open(field, holes_, batch_, flight.number, flight.ray, found)) return false;
    answers_.logit[flight.number] = -kCertainLogit;
    return true;
  }
  HWY_INLINE void end(const TrianglesField&, const Flight<AnyTriangle>&) const {}

 private:
  [[no_unique_address]] Holes holes_;
  const SegmentBatch& batch_;
  AnswerBatch& answers_;
};

/// Goal: the nearest triangle that blocks a ray.
template <class Holes>
class FirstTriangle {
 public:
  static constexpr bool kNearestFirst = true;
  struct State {
    NearestTriangle nearest;
    TriangleRay exact;
    float start;  ///< start_of() the ray, from which boxes count t
    bool prepared;
  };

  /// `answers` receives which rays are certain; `hits` only the hits that exist.
  FirstTriangle(const Holes& holes, const SegmentBatch& batch, AnswerBatch& answers, HitBatch& hits)
      : holes_(holes), batch_(batch), answers_(answers), hits_(hits) {}

  AnswerBatch& answers() const { return answers_; }
  HWY_INLINE void begin(Flight<FirstTriangle>& flight) const {
    flight.state.nearest.triangle = kNoTriangle;
    flight.state.prepared = false;
  }
  HWY_INLINE bool look_at(const TrianglesField& field, Flight<FirstTriangle>& flight,
                          const OpenTriangles& found) const {
    State& state = flight.state;
    if (!state.prepared) {
      const Segment segment = segment_of(batch_, flight.number);
      prepare_for_triangles(field, segment, state.exact);
      state.start = start_of(field, segment);
      state.prepared = true;
    }
    const BvhNode& node = field.nodes[found.visit.node()];
    uint32_t ranks = found.ranks, open = found.open;
    for (; open != 0; open >>= 1, ranks &= ranks - 1) {
      if ((open & 1) == 0) continue;
      const uint32_t triangle = node.first_triangle + lowest_bit(ranks);
      if (!look_at_triangle(field, state.exact, node.first_vertex, triangle, state.nearest, holes_)) continue;
      // Boxes use t times the power of two in the direction's longest component.
      float power = 0;
      for (uint32_t a = 0; a < 3; ++a) power = max_of(magnitude(batch_.direction[a][flight.number]), power);
      power = bits_as<float>(bits_as<uint32_t>(power) & 0x7f800000);
      const float reached = next_above(static_cast<float>(state.nearest.crossing.t - double{state.start}));
      flight.ray.limits[1] = min_of(reached * power, flight.ray.limits[1]);
    }
    return false;
  }
  HWY_INLINE void end(const TrianglesField& field, const Flight<FirstTriangle>& flight) const {
    const uint32_t i = flight.number;
    if (flight.state.nearest.triangle != kNoTriangle)
      set_hit(hits_, i, hit_of(field, flight.state.nearest, answers_.certain[i] != 0));
  }

 private:
  [[no_unique_address]] Holes holes_;
  const SegmentBatch& batch_;
  AnswerBatch& answers_;
  HitBatch& hits_;
};

template <class Goal>
class Traversal {
 public:
  using Flight = cpu::HWY_NAMESPACE::Flight<Goal>;
  using FlightGroup = cpu::HWY_NAMESPACE::FlightGroup<Goal>;

  HWY_INLINE Traversal(const TreePart* parts, const SegmentBatch& batch, const float* enter,
                       const float* leave, const Goal& goal, ReadyRays& ready)
      : parts_(parts), batch_(batch), enter_(enter), leave_(leave), goal_(goal), ready_(ready) {
    ready_.traversed = 0;
  }

  /// Every ray tests the boxes of its node and moves to the next.
  HWY_INLINE void test_nodes(FlightGroup& group) const {
    group.done = group.met_count = 0;
    uint32_t done = 0, count = 0;
    for (uint32_t bits = group.in_flight; bits != 0; bits &= bits - 1) {
      const uint32_t at = lowest_bit(bits);
      done |= uint32_t(!step(*group.flights[at].field, group.flights[at], at, group.met, count)) << at;
    }
    group.done = done;
    group.met_count = count;
  }

  /// Tests the leaves that rays have met.
  HWY_INLINE void test_leaves(FlightGroup& group) const {
    const uint32_t count = group.met_count;
    for (uint32_t i = 0; i < count; ++i) {
      MetTriangles& met = group.met[i];
      met.ranks = ranks_in(group.flights[met.visit.flight()].field->nodes[met.visit.node()], met.ranks);
      met.last = 0x80000000u >> hwy::Num0BitsAboveMS1Bit_Nonzero32(met.ranks);
    }
    uint32_t open = 0, ranks = group.met[0].ranks;
    for (uint32_t i = 0; i < count;) {
      const MetTriangles& met = group.met[i];
      const Flight& flight = group.flights[met.visit.flight()];
      open += uint32_t(test_four(*flight.field, flight.ray, met, ranks, group.open[open]) != 0);
      i += ranks == 0;
      ranks = uint32_t(choose(ranks == 0, group.met[i].ranks, ranks));
    }
    group.open_count = open;
  }

  /// Processes the triangles that rays have met, and replaces finished rays.
  HWY_INLINE void exchange(FlightGroup& group) {
    uint32_t done = group.done;
    for (uint32_t i = 0; i < group.open_count; ++i) {
      const OpenTriangles& found = group.open[i];
      const uint32_t at = found.visit.flight();
      Flight& flight = group.flights[at];
      done |= uint32_t(goal_.look_at(*flight.field, flight, found)) << at;
    }
    for (uint32_t ended = group.in_flight & done; ended != 0; ended &= ended - 1) {
      const Flight& flight = group.flights[lowest_bit(ended)];
      goal_.end(*flight.field, flight);
    }
    group.in_flight &= ~done;
    for (uint32_t free = ~group.in_flight & ((1u << kFlights) - 1); free != 0; free &= free - 1) {
      if (ready_.traversed == 0 && !make_some_ready()) return;
      const uint32_t at = lowest_bit(free);
      start(group.flights[at]);
      group.in_flight |= 1u << at;
    }
  }

 private:
  /// Returns false if no ray is left.
  HWY_INLINE bool make_some_ready() {
    while (ready_.traversed == 0) {
      if (!take_vector(parts_, batch_.count, first_, taken_)) return false;
      make_ready<BvhNode>(*parts_->tree, batch_, enter_, leave_, first_, taken_, goal_.answers(), ready_,
                          NothingFirst());
    }
    return true;
  }

  /// Starts the next ray at the root.
  HWY_INLINE void start(Flight& flight) {
    const uint32_t lane = lowest_bit(ready_.traversed);
    ready_.traversed &= ready_.traversed - 1;
    ready_.take(lane, flight.ray);
    const BvhTree& tree = *parts_->tree;
    flight.field = &tree.field;
    flight.stack[0] = 0;
    flight.size = 1;
    // Usually the root has no leaves, and is skipped.
    const auto met = uint32_t(ready_.met[lane]);
    if (HWY_LIKELY((met & tree.leaves) == 0)) {
      go_on(tree.field, flight, group_of(tree.field.nodes[0], tree.inner, met));
    } else {
      flight.group = 0;
      flight.next = 0;
    }
    flight.number = first_ + lane;
    goal_.begin(flight);
  }

  static HWY_INLINE NodeGroup group_of(const BvhNode& node, uint32_t inner, uint32_t to_visit) {
    return node.first_node | NodeGroup(inner) << kInnerShift | NodeGroup(to_visit) << kVisitShift;
  }

  /// Chooses the next node from a group. Returns false if there is none.
  static HWY_INLINE bool go_on(const TrianglesField& field, Flight& flight, NodeGroup group) {
    const auto to_visit = uint32_t(group >> kVisitShift);
    set_next(field, flight, group, to_visit ^ (to_visit - 1));
    flight.group = group & (group - (NodeGroup(1) << kVisitShift));
    return to_visit != 0;
  }
  /// Goes to the node of one of the group's slots, given as a bit.
  static HWY_INLINE void go_to(const TrianglesField& field, Flight& flight, NodeGroup group, uint32_t slot) {
    set_next(field, flight, group, slot ^ (slot - 1));
    flight.group = group & ~(NodeGroup(slot) << kVisitShift);
  }
  /// The next node is that of the last inner slot up to the given slot.
  static HWY_INLINE void set_next(const TrianglesField& field, Flight& flight, NodeGroup group,
                                  uint32_t up_to) {
    const auto inner = uint32_t(group >> kInnerShift) & 255;
    flight.next = uint32_t(group) + uint32_t(__builtin_popcount(up_to & inner)) - 1;
    const char* const next = reinterpret_cast<const char*>(field.nodes + flight.next);
    __builtin_prefetch(next);
    __builtin_prefetch(next + sizeof(BvhNode) - 1);
  }

  /// Tests the boxes of a ray's node and chooses its next one. Returns false if there is none.
  static HWY_INLINE bool step(const TrianglesField& field, Flight& flight, uint32_t at,
                              MetTriangles* met_triangles, uint32_t& count) {
    const BvhNode& node = field.nodes[flight.next];
    const SlotSets sets = slot_sets(node);
    alignas(32) float entries[kBvhWidth];
    const uint32_t met = meets_boxes(node, flight.ray, Goal::kNearestFirst ? entries : nullptr);
    const uint32_t leaves = met & sets.leaves, inner = met & sets.inner;
    met_triangles[count] = {{flight.next | uint64_t(at) << 32}, leaves, 0};
    count += leaves != 0;
    // Even if no leaf is met: a branch costs more.
    for (uint32_t line = 0; line < kTriangleLines; ++line)
      __builtin_prefetch(reinterpret_cast<const char*>(field.triangles + node.first_triangle) + 64 * line);
    for (uint32_t line = 0; line < kVertexLines; ++line)
      __builtin_prefetch(reinterpret_cast<const char*>(field.vertices[node.first_vertex]) + 64 * line);

    uint32_t size = flight.size;
    flight.stack[size] = flight.group;
    size += flight.group >> kVisitShift != 0;
    const NodeGroup group = choose(inner == 0, flight.stack[size - 1], group_of(node, sets.inner, inner));
    flight.size = size - (inner == 0);
    if constexpr (Goal::kNearestFirst) {
      if (inner != 0) {
        go_to(field, flight, group, nearest_slot(entries, inner));
        return true;
      }
    }
    return go_on(field, flight, group);
  }

  const TreePart* parts_;  ///< the first is that of the rays that were prepared last
  const SegmentBatch& batch_;
  const float *enter_, *leave_;
  const Goal goal_;
  ReadyRays& ready_;
  uint32_t first_ = 0, taken_ = 0;  ///< rays of the batch that were prepared last, and that are prepared
};

/// Traverses every ray of a batch. Boxes count only from `enter[i]` to `leave[i]`, so hits elsewhere may be
/// missed; triangles count from the ray's own tmin to its tmax. Both arrays have kBatchRays entries and count
/// t from start_of() the ray. The last of `parts` ends with the batch, and trees are decoded, or none is.
template <class Goal>
HWY_INLINE void traverse_for(const Goal& goal, const TreePart* parts, const SegmentBatch& batch,
                             const float* enter, const float* leave, TraversalScratch<Goal>& scratch) {
  Traversal<Goal> traversal(parts, batch, enter, leave, goal, scratch.ready);
  run_phases(traversal, scratch.groups);
}

/// Whether any ray of a batch is moved.
HWY_INLINE bool any_far(const TreePart* parts, const SegmentBatch& batch) {
  for (uint32_t first = 0; first < batch.count; first = parts++->end)
    if (any_far(parts->tree->field, batch, first, parts->end)) return true;
  return false;
}
template <class Holes = NoHoles>
union BvhScratch {
  TraversalScratch<AnyTriangle<Holes>> packed;
#ifdef NIF_DECODES
  decoded::TraversalScratch<decoded::AnyTriangle<Holes>> decoded;
#endif
};
/// Answers the rays of a batch. Not inlined, so that all kernels share this code.
template <class Holes = NoHoles>
HWY_NOINLINE void traverse(const TreePart* parts, const SegmentBatch& batch, const float* enter,
                           const float* leave, AnswerBatch& answers, BvhScratch<Holes>& scratch,
                           const Holes& holes = {}) {
#ifdef NIF_DECODES
  if (!parts->tree->decoded.nodes.empty()) {
    decoded::traverse_for(decoded::AnyTriangle<Holes>(holes, batch, answers), parts, batch, enter, leave,
                          scratch.decoded);
    return;
  }
#endif
  traverse_for(AnyTriangle<Holes>(holes, batch, answers), parts, batch, enter, leave, scratch.packed);
}

/// Where boxes count.
struct BoxEnds {
  float enter[kBatchRoom], leave[kBatchRoom];
};
/// Sets them for rays that are moved, some of them, and go up to `leave`.
HWY_NOINLINE inline void begin_at_start(const TreePart* parts, const SegmentBatch& batch, const float* leave,
                                        BoxEnds& ends) {
  for (uint32_t i = 0; i < batch.count; ++i) {
    parts += uint32_t(i == parts->end);
    const float start = start_of(parts->tree->field, segment_of(batch, i));
    ends.enter[i] = from_start_down(batch.tmin[i], start);
    ends.leave[i] = from_start_up(leave[i], start);
  }
}
/// The same without an interval.
template <class Holes = NoHoles>
HWY_NOINLINE void traverse_whole(const TreePart* parts, const SegmentBatch& batch, AnswerBatch& answers,
                                 BoxEnds& ends, BvhScratch<Holes>& scratch, const Holes& holes = {}) {
  if (HWY_LIKELY(!any_far(parts, batch))) {
    traverse(parts, batch, batch.tmin, batch.tmax, answers, scratch, holes);
    return;
  }
  begin_at_start(parts, batch, batch.tmax, ends);
  traverse(parts, batch, ends.enter, ends.leave, answers, scratch, holes);
}

/// Finds their first hits.
template <class Holes = NoHoles>
struct BvhHitScratch {
  AnswerBatch answers;
#ifdef NIF_DECODES
  HitCandidates candidates;
#endif
  union {
    TraversalScratch<FirstTriangle<Holes>> packed;
#ifdef NIF_DECODES
    decoded::TraversalScratch<decoded::FirstTriangle<Holes>> decoded;
#endif
  };
};
template <class Holes = NoHoles>
HWY_NOINLINE void traverse_to_hits(const TreePart* parts, const SegmentBatch& batch, const float* enter,
                                   const float* leave, HitBatch& hits, BvhHitScratch<Holes>& scratch,
                                   const Holes& holes = {}) {
  fill_hits(hits, batch.count, Hit());
#ifdef NIF_DECODES
  if (!parts->tree->decoded.nodes.empty()) {
    const decoded::FirstTriangle<Holes> goal(holes, batch, scratch.answers, hits, scratch.candidates);
    decoded::traverse_for(goal, parts, batch, enter, leave, scratch.decoded);
    goal.finish();
  } else
#endif
    traverse_for(FirstTriangle<Holes>(holes, batch, scratch.answers, hits), parts, batch, enter, leave,
                 scratch.packed);
  for (uint32_t i = 0; i < batch.count; ++i)
    if (!(hits.t[i] < kNoHit) && scratch.answers.certain[i] != 0) hits.low[i] = kNoHit;
}

/// The same without an interval, up to `limit`, which is described at intersect().
template <class Holes = NoHoles>
HWY_NOINLINE void traverse_whole_to_hits(const TreePart* parts, const SegmentBatch& batch, const float* limit,
                                         HitBatch& hits, BoxEnds& ends, BvhHitScratch<Holes>& scratch,
                                         const Holes& holes = {}) {
  const float* enter = batch.tmin;
  for (uint32_t i = 0; i < batch.count; ++i) ends.leave[i] = min_of(next_above(limit[i]), batch.tmax[i]);
  if (HWY_UNLIKELY(any_far(parts, batch))) {
    begin_at_start(parts, batch, ends.leave, ends);
    enter = ends.enter;
  }
  traverse_to_hits(parts, batch, enter, ends.leave, hits, scratch, holes);
}

}  // namespace nif::kernels::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
