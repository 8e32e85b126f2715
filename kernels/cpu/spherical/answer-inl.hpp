// Answers a `spherical` field, for each instruction set that includes this. The runtime's kernel and the one
// that times its stages share it.
//
// Each lane computes what kernels/reference/spherical/spherical_query.hpp defines, in its order and without
// fused multiply-add, so that the bits agree: sums add a layer's inputs one after the other, for many neurons
// at a time.
//
// Compiled once for each target, so the include guard toggles.
#if defined(NIF_SPHERICAL_ANSWER_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef NIF_SPHERICAL_ANSWER_INL
#undef NIF_SPHERICAL_ANSWER_INL
#else
#define NIF_SPHERICAL_ANSWER_INL
#endif

#include "kernels/cpu/lanes-inl.hpp"
#include "kernels/cpu/spherical/stage_times.hpp"
#include "kernels/reference/object_kernel.hpp"
#include "kernels/reference/spherical/spherical_query.hpp"

HWY_BEFORE_NAMESPACE();
namespace nif::kernels::cpu::HWY_NAMESPACE {

using Vector = hn::Vec<Floats>;

/// Rays for one network, in the order in which they appear in the batch.
struct SphericalQueue {
  uint32_t count;
  uint32_t ray[kBatchRays + kLanes];  ///< in the batch
  float at[5][kBatchRays + kLanes];   ///< SphericalCoordinates
};

/// Number of vectors of rays whose neurons are computed together.
inline constexpr uint32_t kGroups = 2;
inline constexpr uint32_t kRows = kGroups * kLanes;

struct SphericalScratch {
  alignas(64) SphericalQueue queues[2];  ///< outer, inner
  alignas(64) float layers[2][kMaxSphericalWidth][kRows];
};
static_assert(sizeof(SphericalScratch) <= kKernelScratchBytes);

HWY_INLINE Vector angle_of(Vector y, Vector x) {
  const Floats d;
  const Vector zero = hn::Zero(d), ax = hn::Abs(x), ay = hn::Abs(y);
  const Vector large = hn::Max(ax, ay), small = hn::Min(ax, ay);
  const Vector ratio = hn::IfThenElseZero(hn::Gt(large, zero), hn::Div(small, large));
  const Vector square = hn::Mul(ratio, ratio);
  Vector sum = hn::Set(d, atan_coefficient(8));
  for (int i = 7; i >= 0; --i) sum = hn::Add(hn::Mul(sum, square), hn::Set(d, atan_coefficient(i)));
  Vector angle = hn::Mul(sum, ratio);
  angle = hn::IfThenElse(hn::Gt(ay, ax), hn::Sub(hn::Set(d, kHalfPi), angle), angle);
  angle = hn::IfThenElse(hn::Lt(x, zero), hn::Sub(hn::Set(d, kPi), angle), angle);
  return hn::IfThenElse(hn::Lt(y, zero), hn::Neg(angle), angle);
}

HWY_INLINE void to_angles(const Vector (&v)[3], Vector& theta, Vector& phi) {
  const Floats d;
  const Vector across = hn::Sqrt(hn::Add(hn::Mul(v[0], v[0]), hn::Mul(v[1], v[1])));
  theta = hn::Mul(angle_of(across, v[2]), hn::Set(d, kPerPi));
  phi = hn::Add(hn::Mul(angle_of(v[1], v[0]), hn::Set(d, kPerTwoPi)), hn::Set(d, 0.5f));
}

/// min_of and max_of of the reference: the second argument if either is NaN.
HWY_INLINE Vector least(Vector a, Vector b) { return hn::IfThenElse(hn::Lt(a, b), a, b); }
HWY_INLINE Vector most(Vector a, Vector b) { return hn::IfThenElse(hn::Gt(a, b), a, b); }

HWY_INLINE void put(SphericalQueue& queue, uint32_t lanes, uint32_t first, const Vector (&at)[5]) {
  const Floats d;
  const Ints di;
  if (lanes == 0) return;
  for (int i = 0; i < 5; ++i) hn::StoreU(gather_lanes(lanes, at[i]), d, queue.at[i] + queue.count);
  const auto rays = hn::Add(hn::Iota(di, 0), hn::Set(di, int32_t(first)));
  hn::StoreU(gather_lanes(lanes, rays), di, reinterpret_cast<int32_t*>(queue.ray) + queue.count);
  queue.count += uint32_t(__builtin_popcount(lanes));
}

/// prepare_spherical() for one vector of rays: answers rays that miss and queues the others.
HWY_INLINE void sort_rays(const SphericalField& field, const SegmentBatch& batch, uint32_t first,
                          AnswerBatch& answers, SphericalQueue (&queues)[2]) {
  const Floats d;
  const auto infinity = hn::Inf(d);
  const Vector tmin = hn::LoadU(d, batch.tmin + first), tmax = hn::LoadU(d, batch.tmax + first);
  Vector o[3], v[3], start[3], low[3], high[3];
  Vector reach = hn::Set(d, field.extent), steepest = hn::Zero(d);
  auto good = hn::Le(tmin, tmax), inside = good;
  for (int a = 0; a < 3; ++a) {
    o[a] = hn::LoadU(d, batch.origin[a] + first);
    v[a] = hn::LoadU(d, batch.direction[a] + first);
    low[a] = hn::Set(d, field.low[a]);
    high[a] = hn::Set(d, field.high[a]);
    good = hn::And(good, hn::And(hn::Lt(hn::Abs(o[a]), infinity), hn::Lt(hn::Abs(v[a]), infinity)));
    reach = most(hn::Abs(o[a]), reach);
    steepest = most(hn::Abs(v[a]), steepest);
    start[a] = hn::Add(o[a], hn::Mul(tmin, v[a]));
    inside = hn::And(inside, hn::And(hn::Ge(start[a], low[a]), hn::Le(start[a], high[a])));
  }
  good = hn::And(good, hn::Le(reach, hn::Set(d, kMaxSphericalCoordinate)));
  good = hn::And(good, hn::And(hn::Ge(steepest, hn::Set(d, kMinDirection)),
                               hn::Le(steepest, hn::Set(d, kMaxDirection))));

  const Vector padding = hn::Add(hn::Mul(reach, hn::Set(d, 0x1p-20f)), hn::Set(d, field.margin));
  const Vector flattest = hn::Mul(steepest, hn::Set(d, 0x1p-30f));
  const Vector farthest = hn::Div(hn::Mul(hn::Set(d, 8.0f), reach), steepest);
  Vector enter = most(tmin, hn::Neg(farthest)), leave = least(tmax, farthest);
  for (int a = 0; a < 3; ++a) {
    const auto negative = hn::Lt(v[a], hn::Zero(d));
    const Vector outward = hn::IfThenElse(negative, hn::Neg(padding), padding);
    const Vector size = most(hn::Abs(v[a]), flattest);
    const Vector inverse = hn::Div(hn::Set(d, 1.0f), hn::IfThenElse(negative, hn::Neg(size), size));
    const Vector entry = hn::IfThenElse(negative, high[a], low[a]),
                 exit = hn::IfThenElse(negative, low[a], high[a]);
    enter = most(hn::Mul(hn::Sub(entry, hn::Add(o[a], outward)), inverse), enter);
    leave = least(hn::Mul(hn::Sub(exit, hn::Sub(o[a], outward)), inverse), leave);
  }
  const auto meets = hn::Le(enter, leave);
  Vector at[5];
  for (int a = 0; a < 3; ++a) {
    const Vector met = least(most(hn::Add(o[a], hn::Mul(enter, v[a])), low[a]), high[a]);
    start[a] = hn::Sub(hn::IfThenElse(inside, start[a], met), hn::Set(d, field.centre[a]));
  }
  to_angles(start, at[0], at[1]);
  to_angles(v, at[2], at[3]);
  const Vector square =
      hn::Add(hn::Add(hn::Mul(start[0], start[0]), hn::Mul(start[1], start[1])), hn::Mul(start[2], start[2]));
  at[4] = hn::Mul(hn::Sqrt(square), hn::Set(d, field.distance_scale));

  const uint32_t rays = batch.count - first;
  const uint32_t there = rays >= kLanes ? kAllLanes : (1u << rays) - 1;
  const uint32_t valid = bits_of(good) & there, within = bits_of(inside) & valid;
  const uint32_t outer = bits_of(meets) & valid & ~within;
  put(queues[0], outer, first, at);
  put(queues[1], within, first, at);

  // All others are visible: for certain if they miss and are in reach, or are empty.
  const auto in_reach = hn::Le(hn::Mul(reach, hn::Set(d, field.reach_scale)), hn::Set(d, kCertainReach));
  const uint32_t certain = (valid & bits_of(in_reach)) | (~valid & bits_of(hn::Gt(tmin, tmax)));
  for (uint32_t left = there & ~(outer | within); left != 0; left &= left - 1) {
    const auto lane = uint32_t(__builtin_ctz(left));
    answers.logit[first + lane] = kCertainLogit;
    answers.certain[first + lane] = uint8_t(certain >> lane & 1);
  }
}

/// Where a coordinate lies between entries of a grid, like the reference's SphericalCell.
struct Cells {
  hn::Vec<Ints> low, high;
  Vector fraction;
};
HWY_INLINE Cells cells_of(Vector x, uint32_t top, uint32_t last) {
  const Floats d;
  const Vector size = hn::Set(d, float(top));
  x = least(most(hn::Mul(x, size), hn::Zero(d)), size);
  const auto low = to_ints(least(x, hn::Set(d, float(last))));
  return {low, low, hn::Sub(x, hn::ConvertTo(d, low))};
}
HWY_INLINE Cells around(Vector phi, uint32_t resolution) {
  const Ints di;
  Cells cells = cells_of(phi, resolution, resolution - 1);
  const auto next = hn::Add(cells.low, hn::Set(di, 1));
  cells.high = hn::IfThenZeroElse(hn::Eq(next, hn::Set(di, int32_t(resolution))), next);
  return cells;
}
HWY_INLINE Cells along(Vector at, uint32_t resolution) {
  Cells cells = cells_of(at, resolution - 1, resolution - 2);
  cells.high = hn::Add(cells.low, hn::Set(Ints(), 1));
  return cells;
}

/// Feature f of the entries whose first values have the given indices.
HWY_INLINE Vector gather_values(const SphericalValues& values, hn::Vec<Ints> index, uint32_t f) {
  const Floats d;
  const Ints di;
  const Words dw;
  if (!values.half)
    return hn::BitCast(d, gather_words(static_cast<const float*>(values.data) + f, hn::ShiftLeft<2>(index)));
  // The word that ends with the wanted half: the bytes before it always exist, the bytes after it may not.
  const auto word = gather_words(static_cast<const uint16_t*>(values.data) + f - 1, hn::ShiftLeft<1>(index));
  const auto half = hn::ShiftRight<16>(word);
  const auto sign = hn::ShiftLeft<16>(hn::And(half, hn::Set(dw, 0x8000u)));
  const auto magnitude = hn::And(half, hn::Set(dw, 0x7fffu));
  const auto normal = hn::BitCast(d, hn::Add(hn::ShiftLeft<13>(magnitude), hn::Set(dw, 112u << 23)));
  const auto denormal = hn::Mul(hn::ConvertTo(d, hn::BitCast(di, magnitude)), hn::Set(d, 0x1p-24f));
  const auto is_normal = hn::RebindMask(d, hn::Gt(hn::BitCast(di, magnitude), hn::Set(di, 0x3ff)));
  return hn::Or(hn::IfThenElse(is_normal, normal, denormal), hn::BitCast(d, sign));
}

HWY_INLINE Vector between(Vector a, Vector b, Vector fraction) {
  return hn::Add(a, hn::Mul(fraction, hn::Sub(b, a)));
}

/// Inputs [feature][kRows] of one vector of rays.
HWY_INLINE void look_up_angles(const SphericalGrid& grid, Vector theta, Vector phi, float (*out)[kRows]) {
  const Floats d;
  const Ints di;
  const Cells row = along(theta, grid.resolution), column = around(phi, grid.resolution);
  const auto width = hn::Set(di, int32_t(grid.resolution)), features = hn::Set(di, int32_t(grid.features));
  const auto index = [&](hn::Vec<Ints> r, hn::Vec<Ints> c)
                         HWY_ATTR { return hn::Mul(hn::Add(hn::Mul(r, width), c), features); };
  const auto i00 = index(row.low, column.low), i01 = index(row.low, column.high),
             i10 = index(row.high, column.low), i11 = index(row.high, column.high);
  for (uint32_t f = 0; f < grid.features; ++f) {
    const Vector upper =
        between(gather_values(grid.values, i00, f), gather_values(grid.values, i01, f), column.fraction);
    const Vector lower =
        between(gather_values(grid.values, i10, f), gather_values(grid.values, i11, f), column.fraction);
    hn::StoreU(between(upper, lower, row.fraction), d, out[f]);
  }
}

HWY_INLINE void look_up_distance(const SphericalGrid& grid, Vector distance, float (*out)[kRows]) {
  const Floats d;
  const Ints di;
  const Cells cell = along(distance, grid.resolution);
  const auto features = hn::Set(di, int32_t(grid.features));
  const auto low = hn::Mul(cell.low, features), high = hn::Mul(cell.high, features);
  for (uint32_t f = 0; f < grid.features; ++f)
    hn::StoreU(
        between(gather_values(grid.values, low, f), gather_values(grid.values, high, f), cell.fraction), d,
        out[f]);
}

/// Sums of kOutputs neurons over all inputs, for kRows rays.
template <uint32_t kOutputs>
HWY_INLINE void sum_inputs(const float* HWY_RESTRICT weights, uint32_t inputs, uint32_t outputs,
                           const float (*HWY_RESTRICT x)[kRows], Vector (&sums)[kOutputs][kGroups]) {
  const Floats d;
  for (uint32_t o = 0; o < kOutputs; ++o)
    for (uint32_t g = 0; g < kGroups; ++g) sums[o][g] = hn::Zero(d);
  for (uint32_t i = 0; i < inputs; ++i, weights += outputs) {
    Vector in[kGroups];
    for (uint32_t g = 0; g < kGroups; ++g) in[g] = hn::Load(d, x[i] + g * kLanes);
    for (uint32_t o = 0; o < kOutputs; ++o) {
      const Vector w = hn::Set(d, weights[o]);
      for (uint32_t g = 0; g < kGroups; ++g) sums[o][g] = hn::Add(sums[o][g], hn::Mul(w, in[g]));
    }
  }
}

/// The network's output for kRows rays, whose inputs are in layers[0].
HWY_INLINE void evaluate(const SphericalNetwork& network, const float* weights, float slope,
                         float (&layers)[2][kMaxSphericalWidth][kRows], float* out) {
  const Floats d;
  const Vector leak = hn::Set(d, slope);
  uint32_t inputs = network.inputs, now = 0;
  for (uint32_t l = 0; l < network.hidden_layers; ++l, now ^= 1) {
    for (uint32_t o = 0; o < network.width; o += 4) {
      Vector sums[4][kGroups];
      sum_inputs<4>(weights + o, inputs, network.width, layers[now], sums);
      for (uint32_t k = 0; k < 4; ++k)
        for (uint32_t g = 0; g < kGroups; ++g)
          hn::Store(most(sums[k][g], hn::Mul(leak, sums[k][g])), d, layers[now ^ 1][o + k] + g * kLanes);
    }
    weights += size_t(inputs) * network.width;
    inputs = network.width;
  }
  Vector sums[1][kGroups];
  sum_inputs<1>(weights, inputs, 1, layers[now], sums);
  for (uint32_t g = 0; g < kGroups; ++g) hn::Store(sums[0][g], d, out + g * kLanes);
}

template <class Clock>
HWY_INLINE void answer_queue(const SphericalField& field, bool outer, SphericalScratch& s,
                             AnswerBatch& answers, Clock& clock) {
  const Floats d;
  const SphericalQueue& queue = s.queues[outer ? 0 : 1];
  if (queue.count == 0) return;
  const SphericalNetwork& network = outer ? field.outer : field.inner;
  const SphericalGrid& position = outer ? field.outer_position : field.inner_position;
  const SphericalGrid& direction = outer ? field.outer_direction : field.inner_direction;
  const float* weights = static_cast<const float*>(network.weights.data);  // single: the kernel's own
  alignas(64) float out[kRows];
  for (uint32_t first = 0; first < queue.count; first += kRows) {
    for (uint32_t g = 0; g < kGroups; ++g) {
      // Lanes beyond the last ray read the first entries of the grids.
      const uint32_t begin = first + g * kLanes;
      const uint32_t rays = begin < queue.count ? queue.count - begin : 0;
      const auto there = mask_of(rays >= kLanes ? kAllLanes : (1u << rays) - 1);
      Vector at[5];
      for (int i = 0; i < 5; ++i)
        at[i] = rays == 0 ? hn::Zero(d) : hn::IfThenElseZero(there, hn::LoadU(d, queue.at[i] + begin));
      float(*inputs)[kRows] = reinterpret_cast<float(*)[kRows]>(&s.layers[0][0][g * kLanes]);
      look_up_angles(position, at[0], at[1], inputs);
      look_up_angles(direction, at[2], at[3], inputs + position.features);
      if (!outer) look_up_distance(field.distance, at[4], inputs + 2 * position.features);
    }
    clock.lap(outer ? SphericalStage::outer_grids : SphericalStage::inner_grids);
    evaluate(network, weights, field.slope, s.layers, out);
    for (uint32_t k = 0; k < kRows && first + k < queue.count; ++k) {
      answers.logit[queue.ray[first + k]] = spherical_logit(out[k]);
      answers.certain[queue.ray[first + k]] = 0;
    }
    clock.lap(outer ? SphericalStage::outer_network : SphericalStage::inner_network);
  }
}

/// Takes the place of a clock in the runtime's kernel.
struct NoClock {
  void lap(SphericalStage) {}
};

/// Answers a batch of any number of rays. Calls `clock.lap(stage)` at the end of each stage.
template <class Clock>
HWY_INLINE void answer_batch(const SphericalField& field, const SegmentBatch& batch, AnswerBatch& answers,
                             void* memory, Clock& clock) {
  SphericalScratch& s = *static_cast<SphericalScratch*>(memory);
  s.queues[0].count = s.queues[1].count = 0;
  for (uint32_t first = 0; first < batch.count; first += kLanes)
    sort_rays(field, batch, first, answers, s.queues);
  clock.lap(SphericalStage::ray_cast);
  for (const bool outer : {true, false}) answer_queue(field, outer, s, answers, clock);
}

}  // namespace nif::kernels::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // NIF_SPHERICAL_ANSWER_INL
