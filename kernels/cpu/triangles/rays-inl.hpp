// Prepares rays for the traversal of a `bvh` object: computes with one ray per lane, then stores each ray's
// data together.
//
// Box tests scale t by the power of two in the direction's longest component, so that no ray can overflow
// them. docs/encodings/bvh.md, "Boxes never change an answer" and "Triangles in single precision", derives
// the bounds that are computed here.
//
// Compiled once for each target.
#if defined(NIF_BVH_RAYS_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef NIF_BVH_RAYS_INL
#undef NIF_BVH_RAYS_INL
#else
#define NIF_BVH_RAYS_INL
#endif

#include <hwy/highway.h>

#include <cstddef>
#include <cstring>

#include "kernels/cpu/lanes-inl.hpp"
#include "kernels/cpu/triangles/decoded_tree.hpp"
#include "kernels/cpu/triangles/tree.hpp"
#include "kernels/reference/batch.hpp"
#include "kernels/reference/triangles/triangles_hit.hpp"

HWY_BEFORE_NAMESPACE();
namespace nif::kernels::cpu::HWY_NAMESPACE {

/// The error of a triangle's sides is at most kSideError times reach, times their size (plus the constant
/// below).
constexpr float kSideError = 24 * 0x1p-24f;
/// More than underflow can change the side of a triangle.
constexpr float kSideUnderflow = 0x1p-110f;
/// For larger coordinates the sum of a triangle's sides might overflow, or its inverse underflow: then every
/// triangle is left to the reference.
constexpr float kMaxSingleReach = 0x1p56f;

/// What the tests read of one ray, in groups of four.
struct ReadyRay {
  float inverse[4];   ///< of the direction, by axis; the last is 0
  float near[4];      ///< a plane p is entered at t = p inverse + near, and left at
  float far[4];       ///< p inverse + far; the last are 0
  float origin[4];    ///< the longest axis of the direction comes third, the others keep their cyclic order;
                      ///< the last is the padding
  float shear[4];     ///< slopes of the first two axes against the third; two factors of sides' error bounds
  float limits[4];    ///< enter and leave, for boxes; third-coordinate bounds surely inside t's range
  uint32_t entry[4];  ///< by axis: where in a node the entry planes are; the last has bit `axis` if the
                      ///< direction is negative
  uint32_t exit[4];   ///< those of the exit planes; the last is the axis of the direction's longest component
};
constexpr uint32_t kReadyGroups = sizeof(ReadyRay) / 16;

/// As many rays as a vector has lanes, group by group.
struct ReadyRays {
  alignas(64) float groups[kReadyGroups][kLanes][4];
  alignas(64) int32_t met[kLanes];  ///< slots of the root, as bits
  uint32_t traversed = 0;           ///< bits of the rays that meet any

  void take(uint32_t lane, ReadyRay& ray) const {
    const hn::FixedTag<float, 4> d;
    float* const to = ray.inverse;
    for (uint32_t g = 0; g < kReadyGroups; ++g) hn::Store(hn::Load(d, groups[g][lane]), d, to + 4 * g);
  }
  /// ReadyRay::exit[3].
  uint32_t axis(uint32_t lane) const {
    return __builtin_bit_cast(uint32_t, groups[kReadyGroups - 1][lane][3]);
  }
};

/// The rays of a vector as boxes see them. As in ReadyRay.
struct BoxRays {
  HWY_INLINE BoxRays() {}  // GCC makes implicit ones for the baseline, not for the target
  hn::Vec<Floats> inverse[3], near[3], far[3];
  hn::Mask<Floats> backwards[3];
  hn::Vec<Floats> enter, leave;

  /// Those that may meet something in a box.
  HWY_INLINE hn::Mask<Floats> meet(const float (&low)[3], const float (&high)[3]) const {
    const Floats d;
    auto first_in = enter, last_out = leave;
    for (uint32_t a = 0; a < 3; ++a) {
      const auto from = hn::Set(d, low[a]), to = hn::Set(d, high[a]);
      const auto in = hn::IfThenElse(backwards[a], to, from), out = hn::IfThenElse(backwards[a], from, to);
      first_in = hn::Max(hn::MulAdd(in, inverse[a], near[a]), first_in);
      last_out = hn::Min(hn::MulAdd(out, inverse[a], far[a]), last_out);
    }
    return hn::Le(first_in, last_out);
  }
};

/// The rays of a vector as triangles see them.
struct SeenRays {
  uint32_t first;             ///< of the batch
  uint32_t asked;             ///< those that are to be answered, as bits
  hn::Vec<Ints> axis;         ///< of the direction's longest component, which comes third
  hn::Vec<Floats> origin[3];  ///< in the order of ReadyRay
  hn::Vec<Floats> shear[2];   ///< slopes of the first two axes against the third
  hn::Vec<Floats> error[2];   ///< two factors of sides' error bounds
  hn::Vec<Floats> padding;
  hn::Vec<Floats> begin, end;  ///< depths in the direction of the ray, surely inside its range
  hn::Vec<Floats> steepest;    ///< depth by t, in the units of boxes
  hn::Mask<Floats> backward;
};
/// What is looked at before the root.
struct FirstLook {
  uint32_t finished = 0;  ///< rays that are, as bits
  uint32_t started = 0;   ///< rays that have met something and must be traversed, whatever the root says
};
struct NothingFirst {
  HWY_INLINE uint32_t some_met(const BoxRays&, uint32_t) const { return 0; }
  HWY_INLINE FirstLook operator()(uint32_t, const SeenRays&, hn::Vec<Floats>&) const { return {}; }
};

/// The rays of a vector, with those from far away moved to the object. The others do not change.
struct MovedLanes {
  alignas(64) float origin[3][kLanes];
  float tmin[kLanes], tmax[kLanes], reach[kLanes];
};
HWY_NOINLINE inline void move_lanes(const BvhTree& tree, const SegmentBatch& batch, uint32_t first,
                                    uint32_t far, MovedLanes& lanes) {
  for (; far != 0; far &= far - 1) {
    const uint32_t lane = lowest_bit(far);
    const Segment segment = segment_of(batch, first + lane);
    const Segment near = moved_to(start_of(tree.field, segment), segment);
    for (uint32_t a = 0; a < 3; ++a) lanes.origin[a][lane] = near.origin[a];
    lanes.tmin[lane] = near.tmin;
    lanes.tmax[lane] = near.tmax;
    lanes.reach[lane] = moved_reach(max_of(largest_of(near.origin), tree.reach), largest_of(segment.origin));
  }
}

/// Whether any ray of a batch, from `first` to before `end`, is moved.
HWY_NOINLINE inline bool any_far(const TrianglesField& field, const SegmentBatch& batch, uint32_t first,
                                 uint32_t end) {
  const Floats d;
  const auto moved_from = hn::Set(d, field.extent * kBvhMovedFrom);
  uint32_t far = 0;
  for (; first < end; first += kLanes) {
    auto far_off = hn::Zero(d);
    for (uint32_t a = 0; a < 3; ++a)
      far_off = hn::Max(far_off, hn::Abs(hn::LoadU(d, batch.origin[a] + first)));
    const uint32_t present = end - first < kLanes ? (1u << (end - first)) - 1 : kAllLanes;
    far |= bits_of(hn::Gt(far_off, moved_from)) & present;
  }
  return far != 0;
}

/// Goes on to the next rays of a batch of `count` that one call of make_ready() prepares: those from `first` to before `end`.
/// `parts` becomes theirs. Returns false if there are none.
HWY_NOINLINE inline bool take_vector(const TreePart*& parts, uint32_t count, uint32_t& first, uint32_t& end) {
  if (end == count) return false;
  parts += uint32_t(end == parts->end);
  first = end;
  end = parts->end - first < kLanes ? parts->end : first + kLanes;
  return true;
}

/// Prepares the batch's rays from `first` to before `end`, at most a vector of them, and answers them as if they met
/// nothing. Boxes count from `from` to `to`, where t counts from start_of() the ray; triangles from the ray's tmin to tmax.
/// Look: look.some_met(boxes, asked) says whose boxes rays meet of the triangles outside the tree, as bits; look(those, rays, leave) looks
/// at them, and may lower `leave` of the boxes.
template <class Node, class Look>
HWY_INLINE void make_ready(const BvhTree& tree, const SegmentBatch& batch, const float* from, const float* to,
                           uint32_t first, uint32_t end, AnswerBatch& answers, ReadyRays& ready,
                           const Look& look) {
  const Floats d;
  const Ints di;
  const auto zero = hn::Zero(d), one = hn::Set(d, 1.0f);
  hn::Vec<Floats> origin[3], direction[3];
  auto far_off = zero, steepest = zero;
  auto finite = hn::Eq(zero, zero);
  const auto infinity = floats(hn::Set(di, 0x7f800000));
  for (uint32_t a = 0; a < 3; ++a) {
    origin[a] = hn::LoadU(d, batch.origin[a] + first);
    direction[a] = hn::LoadU(d, batch.direction[a] + first);
    const auto offset = hn::Abs(origin[a]), size = hn::Abs(direction[a]);
    finite = hn::And(finite, hn::And(hn::Lt(offset, infinity), hn::Lt(size, infinity)));
    far_off = hn::Max(far_off, offset);
    steepest = hn::Max(steepest, size);
  }
  // Like prepare_ray().
  const auto extent = hn::Set(d, tree.field.extent);
  auto tmin = hn::LoadU(d, batch.tmin + first), tmax = hn::LoadU(d, batch.tmax + first);
  const auto ordered = hn::Le(tmin, tmax);
  auto askable = hn::And(finite, hn::Le(hn::Max(far_off, extent), hn::Set(d, kMaxBvhCoordinate)));
  askable = hn::And(askable, hn::Le(far_off, hn::Mul(extent, hn::Set(d, kBvhFarthest))));
  askable = hn::And(askable, hn::And(hn::Ge(steepest, hn::Set(d, kMinDirection)),
                                     hn::Le(steepest, hn::Set(d, kMaxDirection))));
  askable = hn::And(askable, ordered);
  const uint32_t present = end - first < kLanes ? (1u << (end - first)) - 1 : kAllLanes;

  const auto near_enough = hn::Le(far_off, hn::Mul(extent, hn::Set(d, kBvhReach)));
  const auto empty = hn::Gt(tmin, tmax);
  const uint32_t certain = bits_of(hn::Or(hn::And(askable, near_enough), hn::AndNot(askable, empty)));
  for (uint32_t lane = 0; lane < kLanes; ++lane) answers.certain[first + lane] = uint8_t(certain >> lane & 1);
  hn::StoreU(hn::Set(di, kCertainLogit), di, answers.logit + first);

  auto reach = hn::Max(far_off, hn::Set(d, tree.reach));
  const auto moved = hn::And(askable, hn::Gt(far_off, hn::Mul(extent, hn::Set(d, kBvhMovedFrom))));
  if (const uint32_t far = bits_of(moved) & present; HWY_UNLIKELY(far != 0)) {
    MovedLanes lanes;
    for (uint32_t a = 0; a < 3; ++a) hn::Store(origin[a], d, lanes.origin[a]);
    hn::Store(tmin, d, lanes.tmin);
    hn::Store(tmax, d, lanes.tmax);
    hn::Store(reach, d, lanes.reach);
    move_lanes(tree, batch, first, far, lanes);
    for (uint32_t a = 0; a < 3; ++a) origin[a] = hn::Load(d, lanes.origin[a]);
    tmin = hn::Load(d, lanes.tmin);
    tmax = hn::Load(d, lanes.tmax);
    reach = hn::Load(d, lanes.reach);
  }

  // Powers of two: dividing by one is exact.
  const auto power = hn::And(ints(steepest), hn::Set(di, 0x7f800000));
  const auto scale_down = floats(hn::Sub(hn::Set(di, 0x7f000000), power)), scale_up = floats(power);
  steepest = hn::Mul(steepest, scale_down);
  const auto padding = hn::Mul(reach, hn::Set(d, kBvhPadding));
  const auto flattest = hn::Mul(steepest, hn::Set(d, kBvhFlattest));
  BoxRays boxes;
  hn::Vec<Floats> entry[3], exit[3];
  auto signs = hn::Zero(di);
  for (uint32_t a = 0; a < 3; ++a) {
    direction[a] = hn::Mul(direction[a], scale_down);
    const auto negative = boxes.backwards[a] = hn::Lt(direction[a], zero);
    const auto size = hn::Div(one, hn::Max(hn::Abs(direction[a]), flattest));
    const auto inverse = boxes.inverse[a] = hn::IfThenElse(negative, hn::Neg(size), size);
    const auto outward = hn::IfThenElse(negative, hn::Neg(padding), padding);
    boxes.near[a] = hn::Neg(hn::Mul(hn::Add(origin[a], outward), inverse));
    boxes.far[a] = hn::Neg(hn::Mul(hn::Sub(origin[a], outward), inverse));
    const auto low = floats(hn::Set(di, int32_t(offsetof(Node, low) + a * sizeof(Node::low[a]))));
    const auto high = floats(hn::Set(di, int32_t(offsetof(Node, high) + a * sizeof(Node::high[a]))));
    signs = hn::Or(signs, hn::IfThenElseZero(hn::RebindMask(di, negative), hn::Set(di, 1 << a)));
    entry[a] = hn::IfThenElse(negative, high, low);
    exit[a] = hn::IfThenElse(negative, low, high);
  }
  const auto farthest = hn::Div(hn::Mul(reach, hn::Set(d, 4.0f)), steepest);
  const auto clamp = [&](hn::Vec<Floats> t) HWY_ATTR {
    return hn::Min(hn::Max(hn::Mul(t, scale_up), hn::Neg(farthest)), farthest);
  };
  boxes.enter = clamp(hn::LoadU(d, from + first));
  boxes.leave = clamp(hn::LoadU(d, to + first));

  // The boxes of the root, for all rays at once: many rays need no more, and are not prepared any further.
  const uint32_t asked = bits_of(askable) & present, large = look.some_met(boxes, asked);
  auto met = hn::Zero(di);
  const auto meet_root = [&]() HWY_ATTR {
    for (uint32_t used = tree.inner | tree.leaves, s = 0; used >> s != 0; ++s) {
      const auto meets = hn::RebindMask(di, boxes.meet(tree.low[s], tree.high[s]));
      met = hn::Or(met, hn::IfThenElseZero(meets, hn::Set(di, int32_t(1u << s))));
    }
    return bits_of(hn::Ne(met, hn::Zero(di))) & asked;
  };
  if (HWY_LIKELY(large == 0)) {
    ready.traversed = meet_root();
    if (ready.traversed == 0) return;
  }

  // prepare_ray() chooses the axes of triangles the same way.
  const auto second = hn::Gt(hn::Abs(direction[1]), hn::Abs(direction[0]));
  const auto third = hn::Gt(hn::Abs(direction[2]), hn::Max(hn::Abs(direction[0]), hn::Abs(direction[1])));
  const auto choose = [&](const hn::Vec<Floats>* of, uint32_t next) HWY_ATTR {
    const auto x = of[next % 3], y = of[(next + 1) % 3], z = of[(next + 2) % 3];
    return hn::IfThenElse(third, z, hn::IfThenElse(second, y, x));
  };
  const auto axis = hn::IfThenElse(hn::RebindMask(di, third), hn::Set(di, 2),
                                   hn::IfThenElse(hn::RebindMask(di, second), hn::Set(di, 1), hn::Zero(di)));
  const auto length = choose(direction, 0);
  const auto shear_x = hn::Div(choose(direction, 1), length), shear_y = hn::Div(choose(direction, 2), length);
  const auto error = hn::IfThenElse(hn::Le(reach, hn::Set(d, kMaxSingleReach)),
                                    hn::Mul(reach, hn::Set(d, kSideError)), infinity);
  const auto least_error = hn::MulAdd(error, error, hn::Set(d, kSideUnderflow));
  const auto low = hn::Add(hn::Mul(clamp(tmin), steepest), padding);
  const auto high = hn::Sub(hn::Mul(clamp(tmax), steepest), padding);
  const auto backward = hn::Lt(length, zero);
  const auto begin = hn::IfThenElse(backward, hn::Neg(high), low);
  const auto last = hn::IfThenElse(backward, hn::Neg(low), high);
  const hn::Vec<Floats> in_order[3] = {choose(origin, 1), choose(origin, 2), choose(origin, 0)};
  if (HWY_UNLIKELY(large != 0)) {
    const SeenRays seen{first,
                        asked,
                        axis,
                        {in_order[0], in_order[1], in_order[2]},
                        {shear_x, shear_y},
                        {error, least_error},
                        padding,
                        low,
                        high,
                        steepest,
                        backward};
    auto leave = boxes.leave;  // so that the others stay in registers
    const FirstLook looked = look(large, seen, leave);
    boxes.leave = leave;
    ready.traversed = (meet_root() & ~looked.finished) | (looked.started & asked);
    if (ready.traversed == 0) return;
  }
  hn::Store(met, di, ready.met);

  const auto store =
      [&](uint32_t group, hn::Vec<Floats> x, hn::Vec<Floats> y, hn::Vec<Floats> z, hn::Vec<Floats> w)
          HWY_ATTR { hn::StoreInterleaved4(x, y, z, w, d, ready.groups[group][0]); };
  store(0, boxes.inverse[0], boxes.inverse[1], boxes.inverse[2], zero);
  store(1, boxes.near[0], boxes.near[1], boxes.near[2], zero);
  store(2, boxes.far[0], boxes.far[1], boxes.far[2], zero);
  store(3, in_order[0], in_order[1], in_order[2], padding);
  store(4, shear_x, shear_y, error, least_error);
  store(5, boxes.enter, boxes.leave, begin, last);
  store(6, entry[0], entry[1], entry[2], floats(signs));
  store(7, exit[0], exit[1], exit[2], floats(axis));
}

}  // namespace nif::kernels::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
