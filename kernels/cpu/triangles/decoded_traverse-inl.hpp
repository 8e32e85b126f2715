// Traverses a decoded `bvh` object with several rays in flight, as traverse-inl.hpp does.
//
// What differs: a step reads planes instead of decoding them, and moves what the ray meets to stacks with one
// compressing store, without a branch. First hits keep candidates, whose depths are known in single precision;
// what is certainly behind another is dropped, and only what is left at the end is tested in double precision.
//
// Compiled once for each target.
#if defined(NIF_BVH_DECODED_TRAVERSE_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef NIF_BVH_DECODED_TRAVERSE_INL
#undef NIF_BVH_DECODED_TRAVERSE_INL
#else
#define NIF_BVH_DECODED_TRAVERSE_INL
#endif

#include <hwy/highway.h>

#include <type_traits>
#include <utility>

#include "kernels/cpu/holes/holes.hpp"
#include "kernels/cpu/holes/leaf_holes-inl.hpp"
#include "kernels/cpu/triangles/boxes-inl.hpp"
#include "kernels/cpu/triangles/exact_hits-inl.hpp"
#include "kernels/cpu/triangles/large-inl.hpp"
#include "kernels/cpu/triangles/leaves-inl.hpp"
#include "kernels/cpu/triangles/packets-inl.hpp"
#include "kernels/cpu/triangles/phases-inl.hpp"
#include "kernels/cpu/triangles/tree.hpp"
#include "kernels/reference/batch.hpp"

HWY_BEFORE_NAMESPACE();
namespace nif::kernels::cpu::HWY_NAMESPACE {
namespace decoded {

constexpr uint32_t kAllFlights = (1u << kFlights) - 1;

using SlotWords = hn::RebindToUnsigned<Slots>;

/// The slots whose boxes the ray may meet something in, as bits.
HWY_INLINE uint32_t meets_boxes(const DecodedNode& node, const ReadyRay& ray) {
  const Slots d;
  uint32_t met = 0;
  for (uint32_t first = 0; first < kBvhWidth; first += uint32_t(hn::Lanes(d))) {
    auto enter = hn::Set(d, ray.limits[0]), leave = hn::Set(d, ray.limits[1]);
    for (uint32_t a = 0; a < 3; ++a) {
      const auto* const planes = reinterpret_cast<const char*>(&node) + first * sizeof(float);
      const auto from = hn::Load(d, reinterpret_cast<const float*>(planes + ray.entry[a]));
      const auto to = hn::Load(d, reinterpret_cast<const float*>(planes + ray.exit[a]));
      const auto inverse = hn::Set(d, ray.inverse[a]);
      enter = hn::Max(hn::MulAdd(from, inverse, hn::Set(d, ray.near[a])), enter);
      leave = hn::Min(hn::MulAdd(to, inverse, hn::Set(d, ray.far[a])), leave);
    }
    met |= bits_of_mask(Slots(), hn::Le(enter, leave)) << first;
  }
  return met;
}

/// Appends the children in some slots. A whole node must have room. Returns how many there are.
HWY_INLINE uint32_t append(const DecodedNode& node, uint32_t slots, Child* to) {
  [[maybe_unused]] const SlotWords d;
#if HWY_TARGET == HWY_AVX3
  _mm256_storeu_si256(reinterpret_cast<__m256i*>(to),
                      _mm256_maskz_compress_epi32(__mmask8(slots), hn::Load(d, node.children).raw));
  return uint32_t(__builtin_popcount(slots));
#elif HWY_TARGET == HWY_AVX2
  const __m256i order =
      _mm256_cvtepu8_epi32(_mm_loadl_epi64(reinterpret_cast<const __m128i*>(kTogether8[slots])));
  hn::StoreU(hn::Vec<SlotWords>{_mm256_permutevar8x32_epi32(hn::Load(d, node.children).raw, order)}, d, to);
  return uint32_t(__builtin_popcount(slots));
#else
  uint32_t count = 0;
  for (uint32_t s = 0; s < kBvhWidth; ++s) {
    to[count] = node.children[s];
    count += slots >> s & 1;
  }
  return count;
#endif
}

/// A ray in flight. Goal: what the traversal looks for; it keeps a state for each ray.
template <class Goal>
struct alignas(64) Flight {
  ReadyRay ray;
  const BvhTree* tree;  ///< that it asks
  uint32_t number;      ///< in the batch
  DecodedRay leaf_ray;
  [[no_unique_address]] typename Goal::State state;
  Child stack[kBvhStack + kBvhWidth];  ///< nodes still to be visited
};

/// Rays that go through the phases together.
template <class Goal>
struct FlightGroup {
  Flight<Goal> flights[kFlights];
  alignas(32) int32_t tops[kFlights];        ///< of the flights' stacks: the next node
  Child leaves[(kFlights + 1) * kBvhWidth];  ///< that the rays have met; then those with open triangles
  uint32_t rays[(kFlights + 1) * kBvhWidth];
  uint32_t in_flight, done, blocked;  ///< one bit per flight
  uint32_t count;                     ///< of leaves

  void clear() { in_flight = done = blocked = count = 0; }
};

/// Large triangles that the rays of a vector may meet first.
struct LargeHits {
  alignas(64) int32_t open[kLanes];  ///< as bits
  float bound[kLanes];               ///< the first hit is at this depth or before
  float low[kMostLarge][kLanes];     ///< depths, at least
};

template <class Goal>
struct TraversalScratch {
  ReadyRays ready;
  LargeHits large;
  FlightGroup<Goal> groups[kFlightGroups];
  PacketTrials trials;
  PacketStack packet;
  typename Goal::PacketState packet_state;
};

/// Triangles of a leaf as bits.
constexpr uint32_t kLeafBits = (1u << kBvhLeafTriangles) - 1;
inline constexpr uint32_t triangles_in(Child leaf) {
  return kLeafBits >> (kBvhLeafTriangles - 1 - leaf % kBvhLeafTriangles);
}

/// Goal: does any triangle block a ray?
template <class Holes>
class AnyTriangle {
 public:
  static constexpr bool kNearestFirst = false, kPackets = !Holes::kAny;
  using State = ExactRayFor<Holes>;
  struct PacketState {};

  AnyTriangle(const Holes& holes, const SegmentBatch& batch, AnswerBatch& answers)
      : holes_(holes), batch_(batch), answers_(answers) {}

  /// Triangles of a leaf that block wherever they are met, as bits.
  HWY_INLINE uint32_t without_holes(Child leaf) const { return ~holes_.in_leaf(leaf / kBvhLeafTriangles); }

  AnswerBatch& answers() const { return answers_; }
  HWY_INLINE void begin(Flight<AnyTriangle>& flight) const {
    flight.state.prepare(flight.tree->field, batch_, flight.number, flight.ray.exit[3]);
  }
  HWY_INLINE void look_at_none(LargeHits&) const {}
  /// Looks at the large triangles `met`, as bits. Rays that meet one are finished.
  HWY_NOINLINE FirstLook look_at_large(const BvhTree& tree, uint32_t met, const SeenRays& rays) const {
    uint32_t blocked = 0;
    const LargeOrder order(rays.axis);
    for (; met != 0 && blocked != rays.asked; met &= met - 1) {
      const uint32_t i = lowest_bit(met);
      LargeDepths depths;
      const LargeTest test = test_large(tree.decoded.large[i], rays, order, depths);
      blocked |= bits_of(test.met) & rays.asked;
      for (uint32_t open = bits_of(test.open) & rays.asked & ~blocked; open != 0; open &= open - 1) {
        const uint32_t lane = lowest_bit(open);
        if (blocks_exactly(tree, tree.decoded.leaves[i / kBvhLeafTriangles], 1u << i % kBvhLeafTriangles,
                           rays.first + lane))
          blocked |= 1u << lane;
      }
    }
    for (uint32_t lanes = blocked; lanes != 0; lanes &= lanes - 1)
      answers_.logit[rays.first + lowest_bit(lanes)] = -kCertainLogit;
    return {.finished = blocked};
  }
  /// Looks at some triangles of a leaf. Returns true if the ray is finished.
  HWY_INLINE bool look_at(Child at, uint32_t lanes, Flight<AnyTriangle>& flight) const {
    const DecodedLeaf& leaf = flight.tree->decoded.leaves[at / kBvhLeafTriangles];
    if constexpr (Holes::kAny) {
      return blocking(holes_, leaf, at / kBvhLeafTriangles, flight.leaf_ray, flight.state.ray, lanes) != 0;
    } else {
      const LeafDepths depths = depths_of(leaf, flight.leaf_ray);
      if ((depths.met & lanes) != 0) return true;
      lanes &= depths.open;
      return lanes != 0 && blocks_exactly(*flight.tree, leaf, lanes, flight.number);
    }
  }
  HWY_INLINE void end(const Flight<AnyTriangle>& flight, bool blocked) const {
    answers_.logit[flight.number] = blocked ? -kCertainLogit : kCertainLogit;
  }

  /// Looks at a leaf with the rays `lanes` of a packet. Returns those that are blocked.
  HWY_INLINE uint32_t look_at(const BvhTree& tree, Packet& packet, Child at, uint32_t lanes) const {
    const Floats d;
    const DecodedLeaf& leaf = tree.decoded.leaves[at / kBvhLeafTriangles];
    const uint32_t count = at % kBvhLeafTriangles + 1;
    const auto slack = hn::Mul(packet.padding, hn::Set(d, 4.0f));
    uint32_t blocked = 0;
    for (uint32_t i = 0; i < count && blocked != lanes; ++i) {
      const PacketTriangle seen = see(leaf, i, packet);
      const auto least = hn::Min(hn::Min(seen.z[0], seen.z[1]), seen.z[2]);
      const auto most = hn::Max(hn::Max(seen.z[0], seen.z[1]), seen.z[2]);
      const auto outside =
          hn::Or(hn::Lt(most, hn::Sub(packet.begin, slack)), hn::Gt(least, hn::Add(packet.end, slack)));
      const auto within = hn::And(hn::Ge(least, packet.begin), hn::Le(most, packet.end));
      blocked |= bits_of(hn::And(seen.sides.inside, within)) & lanes;
      const uint32_t open = ~bits_of(hn::Or(seen.sides.missed, outside)) & lanes & ~blocked;
      if (HWY_UNLIKELY(open != 0)) blocked |= blocks_closely(tree, leaf, i, seen, packet, open);
    }
    return blocked;
  }
  /// Answers the rays `lanes` of a packet.
  HWY_NOINLINE PacketWork answer_packet(const BvhTree& tree, Packet& packet, uint32_t lanes,
                                        const int32_t* root, const LargeHits&, PacketState&,
                                        PacketStack& stack) const {
    struct Look {
      const AnyTriangle& goal;
      const BvhTree& tree;
      HWY_INLINE uint32_t look_at(Packet& packet, Child leaf, uint32_t lanes) const {
        const uint32_t blocked = goal.look_at(tree, packet, leaf, lanes);
        for (uint32_t left = blocked; left != 0; left &= left - 1)
          goal.answers_.logit[packet.first + lowest_bit(left)] = -kCertainLogit;
        return blocked;
      }
    } look{*this, tree};
    return traverse_packet(tree.decoded, packet, lanes, root, look, stack);
  }

 private:
  /// Which of the rays `lanes` a triangle blocks that they may meet.
  HWY_NOINLINE uint32_t blocks_closely(const BvhTree& tree, const DecodedLeaf& leaf, uint32_t i,
                                       const PacketTriangle& seen, const Packet& packet,
                                       uint32_t lanes) const {
    const auto range = depth_range(seen.z, seen.sides, packet.padding);
    const auto test = test_range(range, packet.begin, packet.end, packet.padding);
    uint32_t blocked = lanes & bits_of(hn::And(seen.sides.inside, test.within));
    for (uint32_t open = lanes & ~(blocked | bits_of(test.outside)); open != 0; open &= open - 1) {
      const uint32_t lane = lowest_bit(open);
      if (blocks_exactly(tree, leaf, 1u << i, packet.first + lane)) blocked |= 1u << lane;
    }
    return blocked;
  }
  HWY_NOINLINE bool blocks_exactly(const BvhTree& tree, const DecodedLeaf& leaf, uint32_t lanes,
                                   uint32_t ray) const {
    TriangleRay exact;
    prepare_for_triangles(tree.field, segment_of(batch_, ray), exact);
    for (; lanes != 0; lanes &= lanes - 1)
      if (cpu::HWY_NAMESPACE::blocks_exactly(holes_, exact, corners_of(leaf, lowest_bit(lanes)))) return true;
    return false;
  }

  [[no_unique_address]] Holes holes_;
  const SegmentBatch& batch_;
  AnswerBatch& answers_;
};

/// Goal: the nearest triangle that blocks a ray.
template <class Holes>
class FirstTriangle {
 public:
  static constexpr bool kNearestFirst = true, kPackets = !Holes::kAny;
  /// A place is the leaf times kBvhLeafTriangles, plus the lane.
  struct State : RayCandidates<Child>, ExactRayFor<Holes> {};
  /// By lane. RayCandidates::bound is up to date where candidates are added.
  struct PacketState {
    RayCandidates<Child> rays[kLanes];
    alignas(64) float bound[kLanes];
  };

  FirstTriangle(const Holes& holes, const SegmentBatch& batch, AnswerBatch& answers, HitBatch& hits,
                HitCandidates& candidates)
      : holes_(holes), batch_(batch), answers_(answers), hits_(hits), candidates_(candidates) {
    candidates.count = 0;
  }

  AnswerBatch& answers() const { return answers_; }
  HWY_INLINE void begin(Flight<FirstTriangle>& flight) const {
    flight.state.clear();
    flight.state.prepare(flight.tree->field, batch_, flight.number, flight.ray.exit[3]);
  }
  HWY_INLINE void look_at_none(LargeHits& hits) const {
    hn::Store(hn::Set(Floats(), kNoHit), Floats(), hits.bound);
    hn::Store(hn::Zero(Ints()), Ints(), hits.open);
  }
  /// Looks at the large triangles `met`, as bits. Rays need not go farther than the first that they surely meet.
  HWY_NOINLINE FirstLook look_at_large(const BvhTree& tree, uint32_t met, const SeenRays& rays,
                                       hn::Vec<Floats>& leave, LargeHits& hits) const {
    const Floats d;
    const Ints di;
    const auto never = hn::Set(d, std::numeric_limits<float>::infinity());
    auto bound = hn::Set(d, kNoHit);
    const LargeOrder order(rays.axis);
    for (uint32_t left = met; left != 0; left &= left - 1) {
      const uint32_t i = lowest_bit(left);
      LargeDepths depths;
      const LargeTest test = test_large(tree.decoded.large[i], rays, order, depths);
      bound = hn::IfThenElse(test.met, hn::Min(depths.high, bound), bound);
      hn::Store(hn::IfThenElse(test.open, depths.low, never), d, hits.low[i]);
    }
    hn::Store(bound, d, hits.bound);
    // Nor beyond `leave`.
    const auto reach = hn::MulAdd(leave, rays.steepest, hn::Mul(rays.padding, hn::Set(d, 4.0f)));
    const auto last = hn::Min(bound, reach);
    auto open = hn::Zero(di);
    for (uint32_t left = met; left != 0; left &= left - 1) {
      const uint32_t i = lowest_bit(left);
      const auto some = hn::RebindMask(di, hn::Le(hn::Load(d, hits.low[i]), last));
      open = hn::Or(open, hn::IfThenElseZero(some, hn::Set(di, int32_t(1u << i))));
    }
    hn::Store(open, di, hits.open);
    // As shorten().
    const auto t = hn::Div(bound, rays.steepest);
    const auto above = hn::Max(hn::Mul(t, hn::Set(d, 1 + 0x1p-21f)), hn::Mul(t, hn::Set(d, 1 - 0x1p-21f)));
    leave = hn::Min(hn::Add(above, hn::Set(d, std::numeric_limits<float>::min())), leave);
    return {.started = bits_of(hn::RebindMask(d, hn::Ne(open, hn::Zero(di))))};
  }
  /// A ray of that vector that meets nothing else.
  HWY_INLINE void end_at_large(const BvhTree& tree, const LargeHits& hits, uint32_t lane, uint32_t number,
                               uint32_t axis) const {
    if (HWY_UNLIKELY(!candidates_.has_room(kMostLarge))) finish();
    for (auto open = uint32_t(hits.open[lane]); open != 0; open &= open - 1)
      add_candidate(tree, number, axis, lowest_bit(open));
  }
  /// A ray that goes on to the tree.
  HWY_INLINE void go_on_from_large(const LargeHits& hits, uint32_t lane,
                                   Flight<FirstTriangle>& flight) const {
    flight.state.bound = hits.bound[lane];
    for (auto open = uint32_t(hits.open[lane]); open != 0; open &= open - 1)
      keep(*flight.tree, hits.low[lowest_bit(open)][lane], lowest_bit(open), flight.number, flight.state);
    shorten(flight.leaf_ray, flight.state.bound);
  }
  HWY_INLINE bool look_at(Child leaf, uint32_t lanes, Flight<FirstTriangle>& flight) const {
    State& state = flight.state;
    const float before = state.bound;
    const DecodedLeaf& triangles = flight.tree->decoded.leaves[leaf / kBvhLeafTriangles];
    LeafDepths depths = depths_of(triangles, flight.leaf_ray);
    if constexpr (Holes::kAny) {
      // Those with holes are met if they block the ray, else they are not open.
      if (const uint32_t holes = depths.open & lanes & holes_.in_leaf(leaf / kBvhLeafTriangles); holes != 0) {
        const uint32_t blocks =
            blocking(holes_, triangles, leaf / kBvhLeafTriangles, flight.leaf_ray, state.ray, holes);
        depths.open &= ~(holes & ~blocks);
        depths.met = (depths.met & ~holes) | blocks;
      }
    }
    for (uint32_t met = depths.met & lanes; met != 0; met &= met - 1)
      state.bound = min_of(depths.high[lowest_bit(met)], state.bound);
    for (uint32_t open = depths.open & lanes; open != 0; open &= open - 1) {
      const uint32_t i = lowest_bit(open);
      if (depths.low[i] <= state.bound)
        keep(*flight.tree, depths.low[i], leaf / kBvhLeafTriangles * kBvhLeafTriangles + i, flight.number,
             state);
    }
    if (state.bound < before) {
      shorten(flight.ray, state.bound);
      shorten(flight.leaf_ray, state.bound);
    }
    return false;
  }
  HWY_INLINE void end(const Flight<FirstTriangle>& flight, bool) const {
    add_candidates(*flight.tree, flight.number, flight.ray.exit[3], flight.state);
  }
  void finish() const { finish_hits(batch_, answers_, candidates_, hits_); }

  /// Looks at a leaf with the rays `lanes` of a packet.
  HWY_INLINE void look_at(const BvhTree& tree, Packet& packet, Child at, uint32_t lanes,
                          PacketState& state) const {
    const Floats d;
    const DecodedLeaf& leaf = tree.decoded.leaves[at / kBvhLeafTriangles];
    const uint32_t count = at % kBvhLeafTriangles + 1, place = at / kBvhLeafTriangles * kBvhLeafTriangles;
    auto bound = hn::Load(d, state.bound);
    uint32_t lower = 0;
    for (uint32_t i = 0; i < count; ++i) {
      const PacketTriangle seen = see(leaf, i, packet);
      const auto behind = hn::Gt(hn::Min(hn::Min(seen.z[0], seen.z[1]), seen.z[2]), bound);
      uint32_t open = ~bits_of(hn::Or(seen.sides.missed, behind)) & lanes;
      if (open == 0) continue;
      const auto range = depth_range(seen.z, seen.sides, packet.padding);
      const auto test = test_range(range, packet.begin, packet.end, packet.padding);
      const uint32_t met = open & bits_of(hn::And(seen.sides.inside, test.within));
      bound = hn::IfThenElse(mask_of(met), hn::Min(range.high, bound), bound);
      lower |= met;
      open &= bits_of(hn::Le(range.low, bound)) & ~bits_of(test.outside);
      if (open == 0) continue;
      alignas(64) float low[kLanes];
      hn::Store(range.low, d, low);
      hn::Store(bound, d, state.bound);
      for (; open != 0; open &= open - 1) {
        const uint32_t lane = lowest_bit(open);
        state.rays[lane].bound = state.bound[lane];
        keep(tree, low[lane], place + i, packet.first + lane, state.rays[lane]);
      }
    }
    if (lower == 0) return;
    hn::Store(bound, d, state.bound);
    packet.shorten(bound);
  }
  /// Answers the rays `lanes` of a packet. Each has met a slot of the root; `large` has what it met before.
  HWY_NOINLINE PacketWork answer_packet(const BvhTree& tree, Packet& packet, uint32_t lanes,
                                        const int32_t* root, const LargeHits& large, PacketState& state,
                                        PacketStack& stack) const {
    const Floats d;
    const bool any_large = !tree.decoded.large.empty();
    hn::Store(any_large ? hn::Load(d, large.bound) : hn::Set(d, kNoHit), d, state.bound);
    for (uint32_t lane = 0; lane < kLanes; ++lane) state.rays[lane].count = 0;
    for (uint32_t left = any_large ? lanes : 0; left != 0; left &= left - 1) {
      const uint32_t lane = lowest_bit(left);
      state.rays[lane].bound = state.bound[lane];
      for (auto open = uint32_t(large.open[lane]); open != 0; open &= open - 1)
        keep(tree, large.low[lowest_bit(open)][lane], lowest_bit(open), packet.first + lane,
             state.rays[lane]);
    }
    struct Look {
      const FirstTriangle& goal;
      const BvhTree& tree;
      PacketState& state;
      HWY_INLINE uint32_t look_at(Packet& packet, Child leaf, uint32_t lanes) const {
        goal.look_at(tree, packet, leaf, lanes, state);
        return 0;
      }
    } look{*this, tree, state};
    const PacketWork work = traverse_packet(tree.decoded, packet, lanes, root, look, stack);
    for (uint32_t left = lanes; left != 0; left &= left - 1) {
      const uint32_t lane = lowest_bit(left);
      state.rays[lane].bound = state.bound[lane];
      add_candidates(tree, packet.first + lane, packet.axis, state.rays[lane]);
    }
    return work;
  }

 private:
  /// Adds a candidate.
  HWY_INLINE void keep(const BvhTree& tree, float low, Child place, uint32_t ray,
                       RayCandidates<Child>& candidates) const {
    if (HWY_UNLIKELY(candidates.count == State::kMost) && !candidates.make_room())
      keep_first(
          tree.field, segment_of(batch_, ray), [&](Child at) { return corners_at(tree, at); }, candidates);
    candidates.add(low, place);
  }
  /// Those of a ray that may be the first.
  HWY_INLINE void add_candidates(const BvhTree& tree, uint32_t ray, uint32_t axis,
                                 const RayCandidates<Child>& found) const {
    if (HWY_UNLIKELY(!candidates_.has_room(State::kMost))) finish();
    for (uint32_t k = 0; k < found.count; ++k)
      if (found.low[k] <= found.bound) add_candidate(tree, ray, axis, found.places[k]);
  }
  HWY_INLINE void add_candidate(const BvhTree& tree, uint32_t ray, uint32_t axis, Child place) const {
    candidates_.add(ray, axis, tree.field.extent, tree.decoded.leaves[place / kBvhLeafTriangles],
                    place % kBvhLeafTriangles);
  }
  static HWY_INLINE TriangleCorners corners_at(const BvhTree& tree, Child place) {
    return corners_of(tree.decoded.leaves[place / kBvhLeafTriangles], place % kBvhLeafTriangles);
  }

  [[no_unique_address]] Holes holes_;
  const SegmentBatch& batch_;
  AnswerBatch& answers_;
  HitBatch& hits_;
  HitCandidates& candidates_;
};

/// Sends the rays that were made ready, from number `first` of the batch on, through the tree together, if enough of them agree
/// on the way to go. Returns those that are answered.
template <class Goal>
HWY_NOINLINE uint32_t answer_together(const Goal& goal, const BvhTree& tree, uint32_t first,
                                      TraversalScratch<Goal>& scratch) {
  const ReadyRays& ready = scratch.ready;
  const Way way = way_of_first(ready);
  PacketWork work{.spent = 1};
  if (way.lanes != 0) {
    Packet packet(ready, first, way);
    work = goal.answer_packet(tree, packet, way.lanes, ready.met, scratch.large, scratch.packet_state,
                              scratch.packet);
  }
  scratch.trials.add(work.pays());
  return way.lanes;
}

template <class Goal>
class Traversal {
 public:
  using Flight = decoded::Flight<Goal>;
  using FlightGroup = decoded::FlightGroup<Goal>;

  HWY_INLINE Traversal(const TreePart* parts, const SegmentBatch& batch, const float* enter,
                       const float* leave, const Goal& goal, TraversalScratch<Goal>& scratch)
      : parts_(parts),
        batch_(batch),
        enter_(enter),
        leave_(leave),
        goal_(goal),
        scratch_(scratch),
        ready_(scratch.ready),
        large_(scratch.large) {
    ready_.traversed = 0;
    scratch.trials = {};
  }

  /// Every ray tests the boxes of its node and moves to the next.
  HWY_INLINE void test_nodes(FlightGroup& group) const {
    uint32_t count = 0, done = 0;
    if (HWY_LIKELY(group.in_flight == kAllFlights)) {
      // Unrolled, so that addresses within the group are constants.
      const auto test_all = [&]<uint32_t... kAt>(std::integer_sequence<uint32_t, kAt...>) HWY_ATTR {
        (test_node(group, kAt, count, done), ...);
      };
      test_all(std::make_integer_sequence<uint32_t, kFlights>());
    } else {
      for (uint32_t bits = group.in_flight; bits != 0; bits &= bits - 1)
        test_node(group, lowest_bit(bits), count, done);
    }
    group.count = count;
    group.done = done;
  }

  /// Tests the leaves that rays have met.
  HWY_INLINE void test_leaves(FlightGroup& group) const {
    const uint32_t count = group.count;
    uint32_t left = 0, blocked = 0;
    for (uint32_t i = 0; i < count; ++i) {
      const Child leaf = group.leaves[i];
      const uint32_t at = group.rays[i], triangles = triangles_in(leaf);
      const Flight& flight = group.flights[at];
      const LeafTest test = test_leaf(flight.tree->decoded.leaves[leaf / kBvhLeafTriangles], flight.leaf_ray);
      const bool met = surely_blocks(leaf, test.met & triangles);
      group.leaves[left] = leaf;
      group.rays[left] = at;
      left += uint32_t((test.open & triangles) != 0) & uint32_t(!met);
      blocked |= uint32_t(met) << at;
    }
    group.count = left;
    group.blocked = blocked;
  }

  /// Processes the triangles that rays may have met, and replaces finished rays.
  HWY_INLINE void exchange(FlightGroup& group) {
    uint32_t blocked = group.blocked;
    for (uint32_t i = 0; i < group.count; ++i) {
      const Child leaf = group.leaves[i];
      const uint32_t at = group.rays[i];
      const bool met = goal_.look_at(leaf, triangles_in(leaf), group.flights[at]);
      blocked |= uint32_t(met) << at;
    }
    const uint32_t done = group.done | blocked;
    for (uint32_t ended = group.in_flight & done; ended != 0; ended &= ended - 1)
      goal_.end(group.flights[lowest_bit(ended)], (blocked >> lowest_bit(ended) & 1) != 0);
    group.in_flight &= ~done;
    for (uint32_t free = ~group.in_flight & kAllFlights; free != 0; free &= free - 1) {
      const uint32_t at = lowest_bit(free);
      do {
        if (ready_.traversed == 0 && !make_some_ready()) return;
      } while (!start(group.flights[at], group.tops[at]));
      group.in_flight |= 1u << at;
    }
  }

 private:
  /// Whether a ray that surely meets these triangles of a leaf, as bits, is finished.
  HWY_INLINE bool surely_blocks(Child leaf, uint32_t met) const {
    if constexpr (Goal::kNearestFirst)
      return false;
    else
      return (met & goal_.without_holes(leaf)) != 0;
  }
  HWY_INLINE void test_node(FlightGroup& group, uint32_t at, uint32_t& count, uint32_t& done) const {
    Flight& flight = group.flights[at];
    const int32_t top = group.tops[at];
    const DecodedNode& node = flight.tree->decoded.nodes[flight.stack[top]];
    const uint32_t met = meets_boxes(node, flight.ray);
    const uint32_t order = node.order[Goal::kNearestFirst ? flight.ray.entry[3] : 0];
    const uint32_t inner = met & (order >> 24), leaves = met & ~inner;
    const SlotWords d;
    for (uint32_t i = 0; i < kBvhWidth; i += uint32_t(hn::Lanes(d)))
      hn::StoreU(hn::Set(d, at), d, group.rays + count + i);
    count += append(node, leaves, group.leaves + count);
    Child* const to = flight.stack + top;  // instead of the node
    const int32_t next =
        top - 1 +
        int32_t(Goal::kNearestFirst ? append_by(node.children, order, inner, to) : append(node, inner, to));
    group.tops[at] = next;
    done |= uint32_t(next) >> 31 << at;
  }

  /// Looks at the large triangles first.
  struct LargeFirst {
    const Traversal& traversal;
    HWY_INLINE const BvhTree& tree() const { return *traversal.parts_->tree; }
    /// Asked before rays are put together as triangles see them, which takes long: many rays meet none of these boxes.
    HWY_INLINE uint32_t some_met(const BoxRays& boxes, uint32_t asked) const {
      if (HWY_LIKELY(tree().decoded.large.empty())) return 0;
      const uint32_t met = large_in_boxes(tree().decoded, boxes, asked);
      if (met == 0) traversal.goal_.look_at_none(traversal.large_);
      return met;
    }
    HWY_INLINE FirstLook operator()(uint32_t met, const SeenRays& rays,
                                    [[maybe_unused]] hn::Vec<Floats>& leave) const {
      if constexpr (Goal::kNearestFirst)
        return traversal.goal_.look_at_large(tree(), met, rays, leave, traversal.large_);
      else
        return traversal.goal_.look_at_large(tree(), met, rays);
    }
  };

  /// Returns false if no ray is left.
  HWY_INLINE bool make_some_ready() {
    while (ready_.traversed == 0) {
      if (!take_vector(parts_, batch_.count, first_, taken_)) return false;
      make_ready<DecodedNode>(*parts_->tree, batch_, enter_, leave_, first_, taken_, goal_.answers(), ready_,
                              LargeFirst{*this});
      if constexpr (kLanes >= kFewestPacketLanes && Goal::kPackets) {
        if (uint32_t(__builtin_popcount(ready_.traversed)) >= kFewestTogether && scratch_.trials.begin())
          ready_.traversed &= ~answer_together(Goal(goal_), *parts_->tree, first_, scratch_);
      }
    }
    return true;
  }

  /// Starts the next ray at the root. Returns false if it is finished.
  HWY_INLINE bool start(Flight& flight, int32_t& top) {
    const uint32_t lane = lowest_bit(ready_.traversed), number = first_ + lane;
    const BvhTree& tree = *parts_->tree;
    ready_.traversed &= ready_.traversed - 1;
    const auto met = uint32_t(ready_.met[lane]);
    if constexpr (Goal::kNearestFirst) {
      if (met == 0) {  // it was made ready for its large triangles
        goal_.end_at_large(tree, large_, lane, number, ready_.axis(lane));
        return false;
      }
    }
    ready_.take(lane, flight.ray);
    flight.tree = &tree;
    const DecodedNode& root = tree.decoded.nodes[0];
    const uint32_t order = root.order[Goal::kNearestFirst ? flight.ray.entry[3] : 0];
    // Usually the root has no leaves, and is skipped.
    if (HWY_LIKELY((met & ~(order >> 24)) == 0)) {
      top = int32_t(Goal::kNearestFirst ? append_by(root.children, order, met, flight.stack)
                                        : append(root, met, flight.stack)) -
            1;
    } else {
      flight.stack[0] = 0;
      top = 0;
    }
    flight.number = number;
    make_decoded_ray(flight.ray, flight.leaf_ray);
    goal_.begin(flight);
    if constexpr (Goal::kNearestFirst) {
      if (HWY_UNLIKELY(!tree.decoded.large.empty())) goal_.go_on_from_large(large_, lane, flight);
    }
    return true;
  }

  const TreePart* parts_;  ///< the first is that of the rays that were prepared last
  const SegmentBatch& batch_;
  const float *enter_, *leave_;
  const Goal goal_;
  TraversalScratch<Goal>& scratch_;
  ReadyRays& ready_;
  LargeHits& large_;
  uint32_t first_ = 0, taken_ = 0;  ///< rays of the batch that were prepared last, and that are prepared
};

template <class Goal>
HWY_INLINE void traverse_for(const Goal& goal, const TreePart* parts, const SegmentBatch& batch,
                             const float* enter, const float* leave, TraversalScratch<Goal>& scratch) {
  Traversal<Goal> traversal(parts, batch, enter, leave, goal, scratch);
  run_phases(traversal, scratch.groups);
}

}  // namespace decoded
}  // namespace nif::kernels::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
