// The planes of cells: on which sides of them rays pass, and the interval that lies between them. One ray per
// lane, with the bits of pass_cell() (kernels/reference/planes/cells.hpp).
//
// Compiled once for each target, so the include guard toggles.
#if defined(NIF_PLANES_CELL_PLANES_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef NIF_PLANES_CELL_PLANES_INL
#undef NIF_PLANES_CELL_PLANES_INL
#else
#define NIF_PLANES_CELL_PLANES_INL
#endif

#include "kernels/cpu/planes/ray_lanes-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace nif::kernels::cpu::HWY_NAMESPACE {

/// Heights of the planes that words stand for. Exact, with or without fused multiply-add.
struct Slabs {
  hn::Vec<Floats> lower, upper;

  HWY_INLINE Slabs(hn::Vec<Ints> from, hn::Vec<Floats> size) {
    const Floats d;
    const Ints di;
    const Words dw;
    const auto word = hn::BitCast(dw, from);
    const auto half_span = hn::MulAdd(size, hn::Set(d, static_cast<float>(kNormalHalf)), hn::Set(d, 1.0f));
    const auto step = hn::Mul(half_span, hn::Set(d, 1.0f / (kPlaneOffsets / 2)));
    const auto lower_offset = hn::BitCast(di, hn::And(hn::ShiftRight<16>(word), hn::Set(dw, 255)));
    const auto upper_offset = hn::BitCast(di, hn::ShiftRight<24>(word));
    lower = hn::MulSub(hn::ConvertTo(d, lower_offset), step, half_span);
    upper = hn::MulSub(hn::ConvertTo(d, upper_offset), step, hn::Sub(half_span, step));
  }
};

/// On which sides of slabs rays enter and leave their cells.
struct SlabSides {
  hn::Mask<Floats> enters_above, enters_below, leaves_above, leaves_below;

  HWY_INLINE SlabSides(const Slabs& slabs, hn::Vec<Floats> enter_height, hn::Vec<Floats> leave_height) {
    enters_above = hn::Gt(enter_height, slabs.upper);
    enters_below = hn::Lt(enter_height, slabs.lower);
    leaves_above = hn::Gt(leave_height, slabs.upper);
    leaves_below = hn::Lt(leave_height, slabs.lower);
  }
  HWY_INLINE hn::Mask<Floats> misses() const {
    return hn::Or(hn::And(enters_above, leaves_above), hn::And(enters_below, leaves_below));
  }
  HWY_INLINE hn::Mask<Floats> crosses() const {
    return hn::Or(hn::And(enters_above, leaves_below), hn::And(enters_below, leaves_above));
  }
};

/// Heights at which rays enter and leave their cells.
struct PassageHeights {
  hn::Vec<Floats> enter, leave;

  /// For cells of the given size that begin at `low`, entered at rays.now and left at `left`.
  HWY_INLINE PassageHeights(const LaneRays& rays, const hn::Vec<Floats> (&low)[3], hn::Vec<Floats> size,
                            hn::Vec<Floats> left) {
    const Floats d;
    const Ints di;
    const auto bits_6 = hn::Set(di, 63);
    const auto half_sum = hn::Set(d, static_cast<float>(kNormalHalf));
    const auto u = hn::Sub(hn::ConvertTo(d, hn::And(hn::ShiftRight<4>(rays.word), bits_6)), half_sum);
    const auto v = hn::Sub(hn::ConvertTo(d, hn::And(hn::ShiftRight<10>(rays.word), bits_6)), half_sum);
    const auto width = hn::Max(hn::Abs(u), hn::Abs(v));
    const hn::Vec<Floats> upright[3] = {
        hn::Add(u, v), hn::Sub(u, v),
        hn::Sub(hn::Set(d, static_cast<float>(kNormalSum)), hn::Add(width, width))};
    hn::Vec<Floats> enters[3], leaves[3];
    const auto half_size = hn::Mul(size, hn::Set(d, 0.5f));
    for (uint32_t a = 0; a < 3; ++a) {
      // Normals are mirrored as rays are.
      const auto sign = hn::And(hn::ShiftLeftSame(rays.info, int(31 - a)), hn::Set(di, INT32_MIN));
      const auto normal = floats(hn::Xor(ints(upright[a]), sign));
      const auto from = hn::Sub(rays.origin[a], hn::Add(low[a], half_size));
      enters[a] = hn::Mul(normal, hn::Add(from, hn::Mul(rays.now, rays.direction[a])));
      leaves[a] = hn::Mul(normal, hn::Add(from, hn::Mul(left, rays.direction[a])));
    }
    enter = hn::Add(hn::Add(enters[0], enters[1]), enters[2]);
    leave = hn::Add(hn::Add(leaves[0], leaves[1]), leaves[2]);
  }
};

/// What planes prove, by kind of word.
class KindFacts {
 public:
  KindFacts() {
    for (uint32_t kind = 0; kind < 16; ++kind)
      facts_[kind] = kind < kPlaneKinds ? int32_t(kCellKinds[kind].above | kCellKinds[kind].below << 2 |
                                                  (kCellKinds[kind].wall ? kSeenBoth << 4 : 0u))
                                        : 0;
  }

  /// SeenBits of passages through cells.
  HWY_INLINE hn::Vec<Ints> seen(hn::Vec<Ints> word, const SlabSides& sides) const {
    const Ints di;
    const auto facts = look_up<16>(di, facts_, hn::And(word, hn::Set(di, 15)));
    return hn::Or(hn::Or(bits_if(hn::Or(sides.enters_above, sides.leaves_above), facts),
                         bits_if(hn::Or(sides.enters_below, sides.leaves_below), hn::ShiftRight<2>(facts))),
                  bits_if(sides.crosses(), hn::ShiftRight<4>(facts)));
  }

 private:
  alignas(64) int32_t facts_[16];  ///< SeenBits above, then below, then both if it is a wall
};

/// The intervals between the planes of open cells, as part_between() has them.
struct SlabIntervals {
  hn::Vec<Floats> begin, end;
  hn::Vec<Ints> heights;

  /// For cells that are entered at `enter` and left at `leave`, at these heights.
  HWY_INLINE SlabIntervals(const Slabs& slabs, hn::Vec<Floats> enter, hn::Vec<Floats> leave,
                           hn::Vec<Floats> enter_height, hn::Vec<Floats> leave_height) {
    const Floats d;
    const auto &lower = slabs.lower, &upper = slabs.upper;
    const SlabSides sides(slabs, enter_height, leave_height);
    const auto rate = hn::Div(hn::Sub(leave, enter), hn::Sub(leave_height, enter_height));
    const auto first = hn::Sub(hn::IfThenElse(sides.enters_above, upper, lower), enter_height);
    const auto last = hn::Sub(hn::IfThenElse(sides.leaves_above, upper, lower), enter_height);
    const auto from = hn::Min(hn::Max(hn::Add(enter, hn::Mul(first, rate)), enter), leave);
    begin = hn::IfThenElse(hn::Or(sides.enters_above, sides.enters_below), from, enter);
    const auto to = hn::Min(hn::Max(hn::Add(enter, hn::Mul(last, rate)), begin), leave);
    end = hn::IfThenElse(hn::Or(sides.leaves_above, sides.leaves_below), to, leave);
    const auto top = hn::Set(d, static_cast<float>(kTopHeight));
    const auto scale = hn::Div(top, hn::Sub(upper, lower));
    const auto height = [&](hn::Vec<Floats> h) HWY_ATTR {
      const auto scaled = hn::Add(hn::Mul(hn::Sub(h, lower), scale), hn::Set(d, 0.5f));
      return to_ints(hn::Min(hn::Max(scaled, hn::Zero(d)), top));
    };
    heights = hn::Or(height(enter_height), hn::ShiftLeft<8>(height(leave_height)));
  }
};

}  // namespace nif::kernels::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
