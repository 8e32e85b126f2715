// Sends the rays of a vector through a decoded tree together: a ray in each lane, and one box or triangle at a time.
//
// A node takes as long as five rays by themselves, however many of the packet's rays meet it. So this is for rays that go
// almost the same way, as those of a camera's neighbouring pixels do, or shadow rays of one light. Their directions have the
// same signs and the same longest axis, so that they agree on entry planes, on the order of children and of axes.
//
// Tests are those of single rays (boxes-inl.hpp, leaves-inl.hpp), operation by operation, so that the same bounds hold; and what
// is left open is decided as theirs is.
//
// Compiled once for each target.
#if defined(NIF_BVH_PACKETS_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef NIF_BVH_PACKETS_INL
#undef NIF_BVH_PACKETS_INL
#else
#define NIF_BVH_PACKETS_INL
#endif

#include <hwy/highway.h>

#include <limits>

#include "kernels/cpu/triangles/leaves-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace nif::kernels::cpu::HWY_NAMESPACE {
namespace decoded {

/// Appends what `from` has for some slots of a node, none of it 0, in the order DecodedNode::order, from far to near. Eight
/// must have room. Returns how many there are.
HWY_INLINE uint32_t append_by(const uint32_t* from, uint32_t order, uint32_t slots, uint32_t* to) {
#if HWY_TARGET == HWY_AVX3
  const __m256i places =
      _mm256_srlv_epi32(_mm256_set1_epi32(int(order)), _mm256_setr_epi32(0, 3, 6, 9, 12, 15, 18, 21));
  const __m256i chosen =
      _mm256_maskz_mov_epi32(__mmask8(slots), _mm256_load_si256(reinterpret_cast<const __m256i*>(from)));
  const __m256i sorted = _mm256_permutevar8x32_epi32(chosen, places);
  _mm256_storeu_si256(reinterpret_cast<__m256i*>(to),
                      _mm256_maskz_compress_epi32(_mm256_test_epi32_mask(sorted, sorted), sorted));
  return uint32_t(__builtin_popcount(slots));
#elif HWY_TARGET == HWY_AVX2
  const __m256i places =
      _mm256_srlv_epi32(_mm256_set1_epi32(int(order)), _mm256_setr_epi32(0, 3, 6, 9, 12, 15, 18, 21));
  const __m256i bits = _mm256_setr_epi32(1, 2, 4, 8, 16, 32, 64, 128);
  const __m256i chosen = _mm256_cmpeq_epi32(_mm256_and_si256(_mm256_set1_epi32(int(slots)), bits), bits);
  const __m256i children = _mm256_load_si256(reinterpret_cast<const __m256i*>(from));
  const auto sorted_slots =
      uint32_t(_mm256_movemask_ps(_mm256_castsi256_ps(_mm256_permutevar8x32_epi32(chosen, places))));
  const __m256i together =
      _mm256_cvtepu8_epi32(_mm_loadl_epi64(reinterpret_cast<const __m128i*>(kTogether8[sorted_slots])));
  _mm256_storeu_si256(reinterpret_cast<__m256i*>(to),
                      _mm256_permutevar8x32_epi32(children, _mm256_permutevar8x32_epi32(places, together)));
  return uint32_t(__builtin_popcount(slots));
#else
  uint32_t count = 0;
  for (uint32_t s = 0; s < kBvhWidth; ++s, order >>= 3) {
    to[count] = from[order & 7];
    count += slots >> (order & 7) & 1;
  }
  return count;
#endif
}

/// Packets are of vectors with at least so many lanes, of which so many rays are left.
constexpr uint32_t kFewestPacketLanes = 8, kFewestTogether = kLanes / 2;
/// Each slot of the root that any of them meets must be met by so many on the mean.
constexpr uint32_t kRootTogether = kLanes * 3 / 8;
/// What packets cost, and what they save, by about what a ray's own step to a node costs (kNodeCost): measured, not counted,
/// because branches that are hard to predict cost most (docs/results/cpu-kernels.md, "Packets").
constexpr uint32_t kPacketNodeCost = 250, kPacketTriangleCost = 110, kNodeCost = 50, kLeafCost = 65;
/// After a vector whose rays do not agree, or whose packet did not pay, so many vectors are not tried; after the next of that
/// kind, so many times as many, and so on until a packet pays.
constexpr uint32_t kVectorsWithout = 4;

/// Which vectors of a batch are tried as packets.
struct PacketTrials {
  uint32_t vectors_without = 0, next = kVectorsWithout;
  /// Whether to try a vector.
  bool begin() { return vectors_without == 0 || --vectors_without == 0; }
  void add(bool paid) {
    vectors_without = paid ? 0 : next;
    next = paid ? kVectorsWithout : next * kVectorsWithout;
  }
};

/// What rays of a packet agree on.
struct Way {
  uint32_t lanes;  ///< the rays, as bits; 0: too few agree
  uint32_t signs;  ///< of their directions, bit `axis` if negative
  uint32_t axis;   ///< the longest of the directions
};

/// The way of the first ray that is traversed, and the others that go it. Rays that meet no slot of the root are not among them.
HWY_INLINE Way way_of_first(const ReadyRays& ready) {
  const auto way_of = [&](uint32_t lane) {
    const auto signs = __builtin_bit_cast(uint32_t, ready.groups[kReadyGroups - 2][lane][3]);
    return ready.axis(lane) << 3 | signs;
  };
  const uint32_t way = way_of(lowest_bit(ready.traversed));
  uint32_t lanes = 0, count = 0, slots = 0, meetings = 0;
  for (uint32_t left = ready.traversed; left != 0; left &= left - 1) {
    const uint32_t lane = lowest_bit(left);
    const auto met = uint32_t(ready.met[lane]);
    if (way_of(lane) != way || met == 0) continue;
    lanes |= 1u << lane;
    ++count;
    slots |= met;
    meetings += uint32_t(__builtin_popcount(met));
  }
  const bool enough =
      count >= kFewestTogether && meetings >= kRootTogether * uint32_t(__builtin_popcount(slots));
  return {enough ? lanes : 0, way & 7, way >> 3};
}

/// Rays of a vector that agree on the way to go, a ray in each lane; the other lanes mean nothing. As in ReadyRay.
struct Packet {
  uint32_t first;  ///< number of the first lane's ray in the batch
  uint32_t signs, axis;
  uint32_t rows[3];                             ///< DecodedRay::rows
  hn::Vec<Floats> inverse[3], near[3], far[3];  ///< for boxes
  hn::Vec<Floats> enter, leave;
  hn::Vec<Floats> origin[3], shear[2], error[2], padding;
  hn::Vec<Floats> begin, end;  ///< depths in the direction of the ray, surely inside its range
  hn::Vec<Floats> sign;        ///< of the direction's longest component

  HWY_INLINE Packet(const ReadyRays& ready, uint32_t number, const Way& way)
      : first(number), signs(way.signs), axis(way.axis) {
    const Floats d;
    constexpr uint32_t kRow = sizeof(DecodedLeaf::corners[0][0]);
    for (uint32_t i = 0; i < 3; ++i) rows[i] = kAxisOrder[axis][i] * kRow;
    hn::Vec<Floats> unused, low, high;
    const auto load = [&](uint32_t group, auto& x, auto& y, auto& z, auto& w)
                          HWY_ATTR { hn::LoadInterleaved4(d, ready.groups[group][0], x, y, z, w); };
    load(0, inverse[0], inverse[1], inverse[2], unused);
    load(1, near[0], near[1], near[2], unused);
    load(2, far[0], far[1], far[2], unused);
    load(3, origin[0], origin[1], origin[2], padding);
    load(4, shear[0], shear[1], error[0], error[1]);
    load(5, enter, leave, low, high);
    const bool backward = (signs >> axis & 1) != 0;
    sign = hn::Set(d, backward ? -0.0f : 0.0f);
    begin = backward ? hn::Neg(high) : low;
    end = backward ? hn::Neg(low) : high;
  }

  /// Boxes that rays enter after these depths hold no first hit. As that of a ReadyRay.
  HWY_INLINE void shorten(hn::Vec<Floats> depth) {
    const Floats d;
    const auto t = hn::Mul(depth, hn::Abs(inverse[axis]));
    const auto above = hn::Max(hn::Mul(t, hn::Set(d, 1 + 0x1p-21f)), hn::Mul(t, hn::Set(d, 1 - 0x1p-21f)));
    leave = hn::Min(hn::Add(above, hn::Set(d, std::numeric_limits<float>::min())), leave);
  }
};

/// What the rays of a packet do together, in the units of kNodeCost.
struct PacketWork {
  uint32_t spent = 0, saved = 0;
  bool pays() const { return saved >= spent; }
  void add_node(uint32_t lanes) {
    spent += kPacketNodeCost;
    saved += kNodeCost * uint32_t(__builtin_popcount(lanes));
  }
  void add_leaf(Child leaf, uint32_t lanes) {
    spent += kPacketTriangleCost * (leaf % kBvhLeafTriangles + 1);
    saved += kLeafCost * uint32_t(__builtin_popcount(lanes));
  }
};

/// Nodes that a packet has still to visit, the next one last.
struct PacketStack {
  Child nodes[kBvhStack + kBvhWidth];
  uint32_t lanes[kBvhStack + kBvhWidth];  ///< the rays that met each one's box, as bits
};

/// A triangle seen along each of the rays, in their directions.
struct PacketTriangle {
  HWY_INLINE PacketTriangle() {}  // as BoxRays
  hn::Vec<Floats> z[3];
  EdgeSides<hn::Vec<Floats>> sides;
};

/// As see().
HWY_INLINE PacketTriangle see(const DecodedLeaf& leaf, uint32_t i, const Packet& packet) {
  const Floats d;
  const auto row = [&](uint32_t k, uint32_t axis) HWY_ATTR {
    const auto* const corner = reinterpret_cast<const char*>(leaf.corners[k]) + packet.rows[axis];
    return hn::Set(d, reinterpret_cast<const float*>(corner)[i]);
  };
  PacketTriangle seen;
  hn::Vec<Floats> x[3], y[3];
  auto size = hn::Zero(d);
  for (uint32_t k = 0; k < 3; ++k) {
    const auto z = hn::Sub(row(k, 2), packet.origin[2]);
    x[k] = hn::NegMulAdd(z, packet.shear[0], hn::Sub(row(k, 0), packet.origin[0]));
    y[k] = hn::NegMulAdd(z, packet.shear[1], hn::Sub(row(k, 1), packet.origin[1]));
    size = hn::Add(size, hn::Add(hn::Abs(x[k]), hn::Abs(y[k])));
    seen.z[k] = hn::Xor(z, packet.sign);
  }
  seen.sides = edge_sides(x, y, size, packet.error[0], packet.error[1]);
  return seen;
}

/// Goes through the tree with the rays `lanes`, which have met these slots of the root, as ReadyRays::met. Goal:
/// look_at(packet, leaf, lanes) takes the triangles of a leaf, and returns the rays that are finished; it may lower
/// `packet.leave`.
template <class Goal>
HWY_INLINE PacketWork traverse_packet(const DecodedTree& tree, Packet& packet, uint32_t lanes,
                                      const int32_t* root, const Goal& goal, PacketStack& stack) {
  const Floats d;
  const Ints di;
  uint32_t entry[3], exit[3];
  for (uint32_t a = 0; a < 3; ++a) {
    const bool negative = (packet.signs >> a & 1) != 0;
    const auto low = uint32_t(offsetof(DecodedNode, low) + a * sizeof(DecodedNode::low[a]));
    const auto high = uint32_t(offsetof(DecodedNode, high) + a * sizeof(DecodedNode::high[a]));
    entry[a] = negative ? high : low;
    exit[a] = negative ? low : high;
  }
  PacketWork work;
  uint32_t waiting = 0;                 // on the stack
  alignas(64) uint32_t met[kBvhWidth];  // rays by slot
  uint32_t slots = 0;                   // that any ray has met, as bits
  // Looks at the node's leaves, and puts its inner nodes onto the stack.
  const auto go_on = [&](const DecodedNode& node) HWY_ATTR {
    const uint32_t order = node.order[packet.signs], inner = slots & order >> 24;
    for (uint32_t leaves = slots & ~inner; leaves != 0; leaves &= leaves - 1) {
      const uint32_t s = lowest_bit(leaves), asked = met[s] & lanes;
      if (asked == 0) continue;
      work.add_leaf(node.children[s], asked);
      lanes &= ~goal.look_at(packet, node.children[s], asked);
    }
    append_by(met, order, inner, stack.lanes + waiting);
    waiting += append_by(node.children, order, inner, stack.nodes + waiting);
  };
  const auto set = [&](uint32_t s, uint32_t rays) HWY_ATTR {
    met[s] = rays;
    slots |= uint32_t(rays != 0) << s;
  };
  const auto of_root = hn::Load(di, root);
  for (uint32_t s = 0; s < kBvhWidth; ++s)
    set(s, bits_of(hn::Ne(hn::And(of_root, hn::Set(di, int32_t(1u << s))), hn::Zero(di))) & lanes);
  go_on(tree.nodes[0]);
  while (waiting != 0) {
    const DecodedNode& node = tree.nodes[stack.nodes[--waiting]];
    const uint32_t active = stack.lanes[waiting] & lanes;
    if (active == 0) continue;
    work.add_node(active);
    const auto* const planes = reinterpret_cast<const char*>(&node);
    slots = 0;
    for (uint32_t s = 0; s < kBvhWidth; ++s) {
      auto enter = packet.enter, leave = packet.leave;
      for (uint32_t a = 0; a < 3; ++a) {
        const auto from = hn::Set(d, reinterpret_cast<const float*>(planes + entry[a])[s]);
        const auto to = hn::Set(d, reinterpret_cast<const float*>(planes + exit[a])[s]);
        enter = hn::Max(hn::MulAdd(from, packet.inverse[a], packet.near[a]), enter);
        leave = hn::Min(hn::MulAdd(to, packet.inverse[a], packet.far[a]), leave);
      }
      set(s, bits_of(hn::Le(enter, leave)) & active);
    }
    go_on(node);
  }
  return work;
}

}  // namespace decoded
}  // namespace nif::kernels::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
