// Tests the boxes of a scene's instances against vectors of rays, brings those that may meet them to object
// space, and keeps the rays together. Compiled once for each Highway target.
#include "kernels/cpu/top_level/ray_stream.hpp"

#include <type_traits>

#include "kernels/cpu/targets.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/cpu/top_level/ray_stream.cpp"
#include <hwy/foreach_target.h>  // must come before highway.h

#include <hwy/highway.h>

// For a single lane there is the reference.
#if HWY_TARGET != HWY_SCALAR
#include "kernels/cpu/lanes-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace nif::kernels::cpu::HWY_NAMESPACE {
namespace {

static_assert(kBatchRoom >= kBatchRays + kLanes);

// In WebAssembly code size matters.
#undef NIF_OF_STREAMS
#if HWY_TARGET == HWY_WASM
#define NIF_OF_STREAMS HWY_NOINLINE
#else
#define NIF_OF_STREAMS HWY_INLINE
#endif

// As kernels::min_of() and max_of(), also if a number is NaN.
HWY_INLINE hn::Vec<Floats> min_of(hn::Vec<Floats> a, hn::Vec<Floats> b) {
#if HWY_ARCH_X86
  return hn::Min(a, b);
#else
  return hn::IfThenElse(hn::Lt(a, b), a, b);
#endif
}
HWY_INLINE hn::Vec<Floats> max_of(hn::Vec<Floats> a, hn::Vec<Floats> b) {
#if HWY_ARCH_X86
  return hn::Max(a, b);
#else
  return hn::IfThenElse(hn::Gt(a, b), a, b);
#endif
}

HWY_INLINE hn::Vec<Ints> words_at(const uint32_t* words, uint32_t k) {
  return hn::BitCast(Ints(), hn::LoadU(Words(), words + k));
}
HWY_INLINE void put_words(hn::Vec<Ints> from, uint32_t* to, uint32_t k) {
  hn::StoreU(hn::BitCast(Words(), from), Words(), to + k);
}

void start_stream(const SegmentBatch& rays, const uint32_t* masks, RayStream& stream) {
  const Floats d;
  const Ints di;
  uint32_t count = 0;
  for (uint32_t i = 0; i < rays.count; i += kLanes) {
    const auto tmin = hn::LoadU(d, rays.tmin + i), tmax = hn::LoadU(d, rays.tmax + i);
    hn::Vec<Floats> origin[3], direction[3], inverse[3];
    auto steepest = hn::Zero(d);
    auto meets = hn::And(hn::FirstN(d, rays.count - i), hn::Le(tmin, tmax));
    for (uint32_t a = 0; a < 3; ++a) {
      origin[a] = hn::LoadU(d, rays.origin[a] + i);
      direction[a] = hn::LoadU(d, rays.direction[a] + i);
      const auto size = hn::Abs(direction[a]);
      const auto largest = hn::Set(d, std::numeric_limits<float>::max());
      meets = hn::And(meets, hn::Le(hn::Abs(hn::Mul(origin[a], hn::Set(d, kToOverflow))), largest));
      meets = hn::And(meets, hn::Le(size, largest));
      steepest = max_of(size, steepest);
      const auto counts = hn::Ge(size, hn::Set(d, kLeastComponent));
      inverse[a] = hn::Div(hn::Set(d, 1.0f), hn::IfThenElseZero(counts, direction[a]));
    }
    meets = hn::And(meets, hn::And(hn::Ge(steepest, hn::Set(d, kMinDirection)),
                                   hn::Le(steepest, hn::Set(d, kMaxDirection))));
    const uint32_t lanes = bits_of(meets);
    const LanesTogether together(lanes);
    for (uint32_t a = 0; a < 3; ++a) {
      hn::StoreU(together(origin[a]), d, stream.origin[a] + count);
      hn::StoreU(together(direction[a]), d, stream.direction[a] + count);
      hn::StoreU(together(inverse[a]), d, stream.inverse[a] + count);
    }
    hn::StoreU(together(tmin), d, stream.tmin + count);
    hn::StoreU(together(tmax), d, stream.tmax + count);
    put_words(masks ? together(words_at(masks, i)) : hn::Set(di, -1), stream.mask, count);
    put_words(together(hn::Iota(di, int32_t(i))), stream.ray, count);
    count += uint32_t(__builtin_popcount(lanes));
  }
  stream.count = count;
  stream.dropped = 0;
  stream.masked = masks != nullptr;
}

/// As BoxPassage.
struct Passages {
  hn::Vec<Floats> enter, leave;
};
/// pass_box(). Column: column(c, k) has what `c`, a column of the stream, has for the rays.
template <class Column>
HWY_INLINE Passages pass_box(const RayStream& stream, const WorldBox& box, const Column& column) {
  const Floats d;
  hn::Vec<Floats> near[3], far[3];
  for (uint32_t a = 0; a < 3; ++a) {
    const auto origin = column(stream.origin[a]), inverse = column(stream.inverse[a]);
    const auto low = hn::Mul(hn::Sub(hn::Set(d, box.min[a]), origin), inverse);
    const auto high = hn::Mul(hn::Sub(hn::Set(d, box.max[a]), origin), inverse);
    near[a] = min_of(low, high);
    far[a] = max_of(high, low);
  }
  const auto enter = max_of(near[2], max_of(near[1], max_of(near[0], hn::Set(d, -kUnlimited))));
  const auto leave = min_of(far[2], min_of(far[1], min_of(far[0], hn::Set(d, kUnlimited))));
  const auto less = hn::Set(d, 1 - kBoxSlack), more = hn::Set(d, 1 + kBoxSlack),
             slack = hn::Set(d, kLeastSlack);
  const auto first = hn::Sub(min_of(hn::Mul(enter, less), hn::Mul(enter, more)), slack);
  const auto last = hn::Add(max_of(hn::Mul(leave, less), hn::Mul(leave, more)), slack);
  return {max_of(min_of(first, hn::Set(d, kMostT)), column(stream.tmin)),
          min_of(max_of(last, hn::Set(d, -kMostT)), column(stream.tmax))};
}

/// The rays of a vector that may meet a box, as bits.
NIF_OF_STREAMS uint32_t may_meet(const RayStream& stream, uint32_t k, const WorldBox& box) {
  const Passages passages =
      pass_box(stream, box, [k](const float* column) HWY_ATTR { return hn::Load(Floats(), column + k); });
  return bits_of(hn::Le(passages.enter, passages.leave));
}

NIF_OF_STREAMS hn::Vec<Floats> row_times(const float* row, const hn::Vec<Floats> (&v)[3]) {
  const Floats d;
  return hn::Add(hn::Add(hn::Mul(hn::Set(d, row[0]), v[0]), hn::Mul(hn::Set(d, row[1]), v[1])),
                 hn::Mul(hn::Set(d, row[2]), v[2]));
}

/// Writes the entries that may meet the box, and have a bit of the mask. Returns how many there are.
NIF_OF_STREAMS uint32_t find_entries(const RayStream& stream, const WorldBox& box, uint32_t mask,
                                     uint32_t* entries) {
  const Ints di;
  uint32_t count = 0;
  for (uint32_t k = 0; k < stream.count; k += kLanes) {
    uint32_t lanes = may_meet(stream, k, box);
    if (stream.count - k < kLanes) lanes &= (1u << (stream.count - k)) - 1;
    if (stream.masked)
      lanes &= bits_of(hn::Ne(hn::And(words_at(stream.mask, k), hn::Set(di, int32_t(mask))), hn::Zero(di)));
#if HWY_TARGET != HWY_WASM
    if (lanes == 0) continue;
#endif
    put_words(gather_lanes(lanes, hn::Iota(di, int32_t(k))), entries, count);
    count += uint32_t(__builtin_popcount(lanes));
  }
  return count;
}

/// Entries of a column.
struct Gathered {
  hn::Vec<Ints> at;
  NIF_OF_STREAMS hn::Vec<Floats> operator()(const float* column) const {
    return gather(Floats(), column, at);
  }
};
/// Consecutive ones.
struct Consecutive {
  uint32_t at;
  HWY_INLINE hn::Vec<Floats> operator()(const float* column) const {
    return hn::LoadU(Floats(), column + at);
  }
};

/// Brings a vector of rays to object space.
template <class Column>
NIF_OF_STREAMS void bring_to_object(const RayStream& stream, const WorldToObject* transform,
                                    const Column& column, SegmentBatch& local, uint32_t k) {
  const Floats d;
  hn::Vec<Floats> origin[3], direction[3];
  for (uint32_t a = 0; a < 3; ++a) {
    origin[a] = column(stream.origin[a]);
    direction[a] = column(stream.direction[a]);
  }
  if (transform) {
    for (uint32_t a = 0; a < 3; ++a)
      origin[a] = hn::Sub(hn::Sub(origin[a], hn::Set(d, transform->translation[a])),
                          hn::Set(d, transform->remainder[a]));
    for (uint32_t a = 0; a < 3; ++a) {
      hn::Store(row_times(transform->inverse + 3 * a, origin), d, local.origin[a] + k);
      hn::Store(row_times(transform->inverse + 3 * a, direction), d, local.direction[a] + k);
    }
  } else {
    for (uint32_t a = 0; a < 3; ++a) {
      hn::Store(origin[a], d, local.origin[a] + k);
      hn::Store(direction[a], d, local.direction[a] + k);
    }
  }
  hn::Store(column(stream.tmin), d, local.tmin + k);
  hn::Store(column(stream.tmax), d, local.tmax + k);
}

/// In two passes, because most vectors hold few rays that meet a small object.
void meet_stream(const RayStream& stream, const StreamInstance& instance, SegmentBatch& local,
                 uint32_t* entries) {
  const Ints di;
  const uint32_t count = find_entries(stream, instance.box, instance.mask, entries);
  local.count = count;
  // Lanes beyond the last entry read what is there: the first one.
  put_words(hn::Zero(di), entries, count);
  for (uint32_t k = 0; k < count; k += kLanes) {
#if HWY_TARGET != HWY_WASM
    if (k + kLanes <= count && entries[k + kLanes - 1] - entries[k] == kLanes - 1) {
      bring_to_object(stream, instance.to_object, Consecutive{entries[k]}, local, k);
      continue;
    }
#endif
    bring_to_object(stream, instance.to_object, Gathered{words_at(entries, k)}, local, k);
  }
}

/// Moves the chosen rays of a vector, entry k and after, to entry `at` and after: together, without gaps.
NIF_OF_STREAMS void move_entries(const RayStream& from, uint32_t k, const LanesTogether& together,
                                 RayStream& to, uint32_t at) {
  const Floats d;
  for (uint32_t a = 0; a < 3; ++a) {
    hn::StoreU(together(hn::Load(d, from.origin[a] + k)), d, to.origin[a] + at);
    hn::StoreU(together(hn::Load(d, from.direction[a] + k)), d, to.direction[a] + at);
    hn::StoreU(together(hn::Load(d, from.inverse[a] + k)), d, to.inverse[a] + at);
  }
  hn::StoreU(together(hn::Load(d, from.tmin + k)), d, to.tmin + at);
  hn::StoreU(together(hn::Load(d, from.tmax + k)), d, to.tmax + at);
  put_words(together(words_at(from.mask, k)), to.mask, at);
  put_words(together(words_at(from.ray, k)), to.ray, at);
}

void narrow_stream(const RayStream& stream, const WorldBox& box, RayStream& narrowed, uint32_t* entries) {
  uint32_t count = 0;
  for (uint32_t k = 0; k < stream.count; k += kLanes) {
    uint32_t lanes = may_meet(stream, k, box);
    if (stream.count - k < kLanes) lanes &= (1u << (stream.count - k)) - 1;
    if (lanes == 0) continue;
    const LanesTogether together(lanes);
    move_entries(stream, k, together, narrowed, count);
    put_words(together(hn::Iota(Ints(), int32_t(k))), entries, count);
    count += uint32_t(__builtin_popcount(lanes));
  }
  narrowed.count = count;
  narrowed.dropped = 0;
  narrowed.masked = stream.masked;
}

/// stays_certain() in an instance with a transform, of rays that have a tmin and a tmax in this order: of ray k in object space and
/// those after it, as a mask. `column` reads theirs in the world.
template <class Rays, class Column>
HWY_INLINE hn::Mask<Floats> stay_certain(const Rays& world, const SegmentBatch& local, uint32_t k,
                                         const WorldToObject& transform, float reach_scale,
                                         const Column& column) {
  const Floats d;
  hn::Vec<Floats> origin[3], direction[3];
  bool remains = false;
  for (uint32_t a = 0; a < 3; ++a) {
    remains = remains || transform.remainder[a] != 0;
    origin[a] = hn::Abs(hn::Sub(hn::Sub(column(world.origin[a]), hn::Set(d, transform.translation[a])),
                                hn::Set(d, transform.remainder[a])));
    direction[a] = hn::Abs(column(world.direction[a]));
  }
  auto reach = hn::Zero(d), spread = reach, steepest = reach;
  for (uint32_t a = 0; a < 3; ++a) {
    float row[3];
    for (uint32_t b = 0; b < 3; ++b) row[b] = magnitude(transform.inverse[3 * a + b]);
    reach = max_of(row_times(row, origin), reach);
    spread = max_of(row_times(row, direction), spread);
    steepest = max_of(hn::Abs(hn::LoadU(d, local.direction[a] + k)), steepest);
  }
  if (remains) reach = hn::Mul(reach, hn::Set(d, 1.25f));
  return hn::And(hn::Le(hn::Mul(reach, hn::Set(d, reach_scale)), hn::Set(d, kCertainReach / 8)),
                 hn::Le(spread, hn::Mul(hn::Set(d, 4.0f), steepest)));
}

void join_hits(RayStream& stream, const WorldBox& box, const StreamHits& added, HitBatch& hits,
               uint32_t* instances) {
  const Floats d;
  const Ints di;
  const HitBatch& met = added.met;
  const auto none = hn::Set(d, kNoHit);
  const bool proves =
      !added.instance.unproven && (added.instance.identity || added.instance.well_conditioned);
  // Joins ray k in object space and those after it in a vector, `present`. `column` reads their entries of the stream, `of_batch` those
  // of the batch.
  const auto join = [&](uint32_t k, uint32_t present, const auto& column, const auto& of_batch) HWY_ATTR {
    auto t = hn::Load(d, met.t + k), low = hn::Load(d, met.low + k), high = hn::Load(d, met.high + k);
    // forget_proof()
    auto certain = mask_of(proves ? present : 0);
    if (proves && !added.instance.identity)
      certain = stay_certain(stream, added.local, k, added.instance.to_object, added.reach_scale, column);
    low = hn::IfThenElse(certain, low, hn::Neg(none));
    high = hn::IfThenElse(certain, high, none);
#if HWY_TARGET != HWY_WASM
    // Certain misses change nothing.
    if ((bits_of(hn::Eq(low, none)) & present) == present) return;
#endif
    // begin_in_box()
    const auto enter = pass_box(stream, box, column).enter;
    const auto begins = hn::Lt(enter, hn::Set(d, kMostT));
    low = hn::IfThenElse(begins, max_of(low, enter), low);
    t = hn::IfThenElse(hn::And(begins, hn::Lt(t, none)), max_of(t, enter), t);
    // SceneHit::add()
    const auto other = of_batch(hits.t);
    const auto in = ints(of_batch(reinterpret_cast<const float*>(instances)));
    // kNoInstance is the greatest as an unsigned number; numbers of instances are less than 2^31.
    const auto earlier =
        hn::RebindMask(d, hn::Or(hn::Lt(in, hn::Zero(di)), hn::Gt(in, hn::Set(di, int32_t(added.number)))));
    const auto nearer =
        hn::Or(hn::Lt(t, other), hn::And(hn::Eq(t, other), hn::And(earlier, hn::Lt(t, none))));
    const auto low_before = of_batch(hits.low), high_before = of_batch(hits.high);
    low = hn::Add(min_of(low, low_before), hn::Zero(d));
    high = hn::Add(min_of(high, high_before), hn::Zero(d));
    const auto changed = hn::Or(hn::Lt(low, low_before), hn::Lt(high, high_before));
    if constexpr (std::is_same_v<decltype(of_batch), const Consecutive&>) {
      const auto put = [&](uint32_t lanes, hn::Vec<Floats> v, float* to) HWY_ATTR {
        hn::StoreU(hn::IfThenElse(mask_of(lanes), v, hn::LoadU(d, to)), d, to);
      };
      const uint32_t i = of_batch.at, entry = column.at;
      const uint32_t changes = bits_of(changed) & present, replaced = bits_of(nearer) & present;
      if (changes != 0) {
        put(changes, low, hits.low + i);
        put(changes, high, hits.high + i);
        const auto end = min_of(high, column(stream.tmax));
        put(changes, end, stream.tmax + entry);
        const uint32_t stay = bits_of(hn::Le(column(stream.tmin), end));
        stream.dropped += uint32_t(__builtin_popcount(changes & ~stay));
      }
      if (replaced == 0) return;
      put(replaced, t, hits.t + i);
      for (uint32_t a = 0; a < 3; ++a) put(replaced, hn::Load(d, met.normal[a] + k), hits.normal[a] + i);
      put(replaced, hn::Load(d, met.u + k), hits.u + i);
      put(replaced, hn::Load(d, met.v + k), hits.v + i);
      const auto put_number = [&](hn::Vec<Ints> v, uint32_t* to) HWY_ATTR {
        put_words(hn::IfThenElse(hn::RebindMask(di, mask_of(replaced)), v, words_at(to, 0)), to, 0);
      };
      put_number(words_at(met.triangle, k), hits.triangle + i);
      put_number(hn::Set(di, int32_t(added.number)), instances + i);
    } else {
      alignas(64) float ts[kLanes], lows[kLanes], highs[kLanes];
      alignas(64) uint32_t rays[kLanes];
      hn::Store(t, d, ts);
      hn::Store(low, d, lows);
      hn::Store(high, d, highs);
      put_words(of_batch.at, rays, 0);
      for (uint32_t lanes = bits_of(changed) & present; lanes != 0; lanes &= lanes - 1) {
        const uint32_t lane = lowest_bit(lanes), entry = added.entries[k + lane];
        hits.low[rays[lane]] = lows[lane];
        hits.high[rays[lane]] = highs[lane];
        stream.tmax[entry] = kernels::min_of(highs[lane], stream.tmax[entry]);
        stream.dropped += uint32_t(!(stream.tmin[entry] <= stream.tmax[entry]));
      }
      for (uint32_t lanes = bits_of(nearer) & present; lanes != 0; lanes &= lanes - 1) {
        const uint32_t lane = lowest_bit(lanes), i = rays[lane];
        hits.t[i] = ts[lane];
        for (uint32_t a = 0; a < 3; ++a) hits.normal[a][i] = met.normal[a][k + lane];
        hits.triangle[i] = met.triangle[k + lane];
        hits.u[i] = met.u[k + lane];
        hits.v[i] = met.v[k + lane];
        instances[i] = added.number;
      }
    }
  };
  for (uint32_t k = 0; k < added.local.count; k += kLanes) {
    const uint32_t left = added.local.count - k, present = bits_of(hn::FirstN(d, left));
#if HWY_TARGET != HWY_WASM
    // As those of neighbouring pixels.
    const uint32_t others = (left < kLanes ? left : kLanes) - 1;
    const uint32_t first = added.entries[k], last = added.entries[k + others];
    if (stream.ray[last] - stream.ray[first] == others) {
      join(k, present, Consecutive{first}, Consecutive{stream.ray[first]});
      continue;
    }
#endif
    const Gathered column{hn::IfThenElseZero(hn::FirstN(di, left), words_at(added.entries, k))};
    join(k, present, column, Gathered{ints(column(reinterpret_cast<const float*>(stream.ray)))});
  }
}

void pack_stream(RayStream& stream) {
  const Floats d;
  uint32_t kept = 0;
  for (uint32_t k = 0; k < stream.count; k += kLanes) {
    const auto stays = hn::Le(hn::Load(d, stream.tmin + k), hn::Load(d, stream.tmax + k));
    const uint32_t lanes = bits_of(hn::And(hn::FirstN(d, stream.count - k), stays));
    move_entries(stream, k, LanesTogether(lanes), stream, kept);  // not beyond what has been read
    kept += uint32_t(__builtin_popcount(lanes));
  }
  stream.count = kept;
  stream.dropped = 0;
}

#if HWY_TARGET != HWY_WASM
/// find_unproven(): of ray k in object space, and those after it in a vector, as bits.
template <class Column>
HWY_INLINE uint32_t unproven_of(const SegmentBatch& world, const SegmentBatch& local, uint32_t k,
                                const PlacedInstance& instance, float reach_scale, const Column& column) {
  const uint32_t present = local.count - k < kLanes ? (1u << (local.count - k)) - 1 : kAllLanes;
  if (instance.unproven) return present;
  const uint32_t empty = bits_of(hn::Gt(column(world.tmin), column(world.tmax)));
  if (!instance.well_conditioned) return present & ~empty;
  return present & ~empty & ~bits_of(stay_certain(world, local, k, instance.to_object, reach_scale, column));
}

uint32_t find_unproven(const SegmentBatch& world, const uint32_t* numbers, const SegmentBatch& local,
                       const PlacedInstance& instance, float reach_scale, uint32_t* found) {
  uint32_t count = 0;
  for (uint32_t k = 0; k < local.count; k += kLanes) {
    const uint32_t lanes =
        numbers ? unproven_of(world, local, k, instance, reach_scale, Gathered{words_at(numbers, k)})
                : unproven_of(world, local, k, instance, reach_scale, Consecutive{k});
    if (lanes == 0) continue;
    put_words(gather_lanes(lanes, hn::Iota(Ints(), int32_t(k))), found, count);
    count += uint32_t(__builtin_popcount(lanes));
  }
  return count;
}

/// world_normal() of the hits from number k on, of `lanes`, with its operations in their order. `transform`: of all of these, null for
/// the identity.
HWY_INLINE void turn_hits(const SegmentBatch& rays, const WorldToObject* transform, uint32_t k,
                          uint32_t lanes, HitBatch& hits) {
  const Doubles d;
  const FewFloats df;
  const auto column = [&](const float* of) HWY_ATTR { return hn::PromoteTo(d, hn::LoadU(df, of + k)); };
  using V = hn::Vec<Doubles>;
  const V zero = hn::Zero(d);
  const V along[3] = {column(rays.direction[0]), column(rays.direction[1]), column(rays.direction[2])};
  V normal[3] = {column(hits.normal[0]), column(hits.normal[1]), column(hits.normal[2])};
  const auto dot = [&](const V* a, const V* b) HWY_ATTR {
    return hn::Add(hn::Add(hn::Add(zero, hn::Mul(a[0], b[0])), hn::Mul(a[1], b[1])), hn::Mul(a[2], b[2]));
  };
  if (transform) {
    const V local[3] = {normal[0], normal[1], normal[2]};
    for (uint32_t a = 0; a < 3; ++a) {
      const auto times = [&](uint32_t row) HWY_ATTR {
        return hn::Mul(hn::Set(d, double{transform->inverse[3 * row + a]}), local[row]);
      };
      normal[a] = hn::Add(hn::Add(times(0), times(1)), times(2));
    }
  }
  V square = dot(normal, normal);
  const auto lacks = hn::Not(hn::Gt(square, zero));
  if (HWY_UNLIKELY(!hn::AllFalse(d, lacks))) {
    for (uint32_t a = 0; a < 3; ++a) normal[a] = hn::IfThenElse(lacks, hn::Neg(along[a]), normal[a]);
    square = hn::IfThenElse(lacks, dot(along, along), square);
  }
  const auto away = hn::Gt(dot(normal, along), zero);
  const V length = hn::Sqrt(square);
  for (uint32_t a = 0; a < 3; ++a) {
    const V turned = hn::Div(hn::IfThenElse(away, hn::Neg(normal[a]), normal[a]), length);
    hn::BlendedStore(hn::DemoteTo(df, turned), mask_of_few(lanes), df, hits.normal[a] + k);
  }
}

HWY_NOINLINE void turn_hit(const SegmentBatch& rays, const WorldToObject& transform, uint32_t i,
                           HitBatch& hits) {
  const float normal[3] = {hits.normal[0][i], hits.normal[1][i], hits.normal[2][i]};
  const float direction[3] = {rays.direction[0][i], rays.direction[1][i], rays.direction[2][i]};
  float turned[3];
  world_normal(&transform, normal, direction, turned);
  for (uint32_t a = 0; a < 3; ++a) hits.normal[a][i] = turned[a];
}

void turn_normals(const SegmentBatch& rays, const PlacedInstance* instances, const uint32_t* in,
                  HitBatch& hits) {
  const FewInts di;
  const auto none = hn::Set(di, int32_t(kNoInstance));
  for (uint32_t k = 0; k < rays.count; k += kDoubles) {
    const auto of = hn::LoadU(di, reinterpret_cast<const int32_t*>(in + k));
    uint32_t left = bits_of_mask(di, hn::Ne(of, none));
    if (rays.count - k < kDoubles) left &= (1u << (rays.count - k)) - 1;
    uint32_t identity = 0;
    for (uint32_t lanes = left; lanes != 0; lanes &= lanes - 1)
      identity |= uint32_t(instances[in[k + lowest_bit(lanes)]].identity) << lowest_bit(lanes);
    if (identity != 0) turn_hits(rays, nullptr, k, identity, hits);
    for (left &= ~identity; left != 0;) {
      const uint32_t number = in[k + lowest_bit(left)];
      const uint32_t same = left & bits_of_mask(di, hn::Eq(of, hn::Set(di, int32_t(number))));
      if ((same & (same - 1)) == 0)
        turn_hit(rays, instances[number].to_object, k + lowest_bit(same), hits);
      else
        turn_hits(rays, &instances[number].to_object, k, same, hits);
      left &= ~same;
    }
  }
}
#endif

}  // namespace

constexpr StreamFunctions kStreamFunctions = {start_stream, meet_stream,  narrow_stream,
                                              join_hits,    pack_stream,
#if HWY_TARGET != HWY_WASM
                                              turn_normals, find_unproven
#endif
};

}  // namespace nif::kernels::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif  // HWY_TARGET

#if HWY_ONCE
#include "kernels/cpu/dispatch-inl.hpp"

namespace nif::kernels::cpu {

const StreamFunctions& stream_functions(Isa isa) {
  return NIF_FUNCTIONS_FOR(StreamFunctions, kStreamFunctions, isa);
}

}  // namespace nif::kernels::cpu
#endif
