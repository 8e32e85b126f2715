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

/// Rays of a vector that agree on the signs of their directions and on the longest axis.
struct Packet {
  const SeenRays& rays;
  BoxRays& boxes;
  uint32_t signs;    ///< of the directions, bit `axis` if negative
  uint32_t axis;     ///< the longest of the directions
  uint32_t rows[3];  ///< DecodedRay::rows

  Packet(const SeenRays& seen, BoxRays& seen_boxes, uint32_t all_signs, uint32_t longest)
      : rays(seen), boxes(seen_boxes), signs(all_signs), axis(longest) {
    constexpr uint32_t kRow = sizeof(DecodedLeaf::corners[0][0]);
    for (uint32_t i = 0; i < 3; ++i) rows[i] = kAxisOrder[axis][i] * kRow;
  }
};

/// As shorten() of a single ray: boxes that rays enter after these depths hold no first hit.
HWY_INLINE void shorten(BoxRays& boxes, hn::Vec<Floats> depth, hn::Vec<Floats> steepest) {
  const Floats d;
  const auto t = hn::Div(depth, steepest);
  const auto above = hn::Max(hn::Mul(t, hn::Set(d, 1 + 0x1p-21f)), hn::Mul(t, hn::Set(d, 1 - 0x1p-21f)));
  boxes.leave = hn::Min(hn::Add(above, hn::Set(d, std::numeric_limits<float>::min())), boxes.leave);
}

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

struct PacketStack {
  Child nodes[kBvhStack + kBvhWidth];
  uint32_t lanes[kBvhStack + kBvhWidth];  ///< the rays that met its box
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
  const SeenRays& rays = packet.rays;
  const auto sign = hn::IfThenElseZero(rays.backward, hn::Set(d, -0.0f));
  const auto row = [&](uint32_t k, uint32_t axis) HWY_ATTR {
    const auto* const corner = reinterpret_cast<const char*>(leaf.corners[k]) + packet.rows[axis];
    return hn::Set(d, reinterpret_cast<const float*>(corner)[i]);
  };
  PacketTriangle seen;
  hn::Vec<Floats> x[3], y[3];
  auto size = hn::Zero(d);
  for (uint32_t k = 0; k < 3; ++k) {
    const auto z = hn::Sub(row(k, 2), rays.origin[2]);
    x[k] = hn::NegMulAdd(z, rays.shear[0], hn::Sub(row(k, 0), rays.origin[0]));
    y[k] = hn::NegMulAdd(z, rays.shear[1], hn::Sub(row(k, 1), rays.origin[1]));
    size = hn::Add(size, hn::Add(hn::Abs(x[k]), hn::Abs(y[k])));
    seen.z[k] = hn::Xor(z, sign);
  }
  seen.sides = edge_sides(x, y, size, rays.error[0], rays.error[1]);
  return seen;
}

/// Goes through the tree with the rays `lanes`, which have met these slots of the root, as ReadyRays::met. Goal:
/// look_at(packet, leaf, lanes) takes the triangles of a leaf, and returns the rays that are finished; it may lower
/// `packet.boxes.leave`.
template <class Goal>
HWY_INLINE PacketWork traverse_packet(const DecodedTree& tree, const Packet& packet, uint32_t lanes,
                                      const int32_t* root, const Goal& goal, PacketStack& stack) {
  const Floats d;
  const Ints di;
  const BoxRays& boxes = packet.boxes;
  uint32_t entry[3], exit[3];
  for (uint32_t a = 0; a < 3; ++a) {
    const bool negative = (packet.signs >> a & 1) != 0;
    const auto low = uint32_t(offsetof(DecodedNode, low) + a * sizeof(DecodedNode::low[a]));
    const auto high = uint32_t(offsetof(DecodedNode, high) + a * sizeof(DecodedNode::high[a]));
    entry[a] = negative ? high : low;
    exit[a] = negative ? low : high;
  }
  PacketWork work;
  int32_t top = -1;
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
    append_by(met, order, inner, stack.lanes + top + 1);
    top += int32_t(append_by(node.children, order, inner, stack.nodes + top + 1));
  };
  const auto set = [&](uint32_t s, uint32_t rays) HWY_ATTR {
    met[s] = rays;
    slots |= uint32_t(rays != 0) << s;
  };
  const auto of_root = hn::Load(di, root);
  for (uint32_t s = 0; s < kBvhWidth; ++s)
    set(s, bits_of(hn::Ne(hn::And(of_root, hn::Set(di, int32_t(1u << s))), hn::Zero(di))) & lanes);
  go_on(tree.nodes[0]);
  while (top >= 0) {
    const DecodedNode& node = tree.nodes[stack.nodes[top]];
    const uint32_t active = stack.lanes[top--] & lanes;
    if (active == 0) continue;
    work.add_node(active);
    const auto* const planes = reinterpret_cast<const char*>(&node);
    slots = 0;
    for (uint32_t s = 0; s < kBvhWidth; ++s) {
      auto enter = boxes.enter, leave = boxes.leave;
      for (uint32_t a = 0; a < 3; ++a) {
        const auto from = hn::Set(d, reinterpret_cast<const float*>(planes + entry[a])[s]);
        const auto to = hn::Set(d, reinterpret_cast<const float*>(planes + exit[a])[s]);
        enter = hn::Max(hn::MulAdd(from, boxes.inverse[a], boxes.near[a]), enter);
        leave = hn::Min(hn::MulAdd(to, boxes.inverse[a], boxes.far[a]), leave);
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
