// What the walk leaves open, in SIMD: sample points, features, network; a ray to a lane throughout.
//
// Compiled once for each target.
#if defined(NIF_SEGMENT_NETWORK_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef NIF_SEGMENT_NETWORK_INL
#undef NIF_SEGMENT_NETWORK_INL
#else
#define NIF_SEGMENT_NETWORK_INL
#endif

#include "kernels/cpu/segment_walk-inl.hpp"
#include "kernels/reference/samples.hpp"

HWY_BEFORE_NAMESPACE();
namespace nif::kernels::cpu::HWY_NAMESPACE {

/// Rays that wait for the network, one to a lane.
struct Pending {
  alignas(64) float origin[3][kLanes];  ///< in grid space, as the reference has them
  float direction[3][kLanes];
  float begin[kMaxPendingRuns][kLanes], end[kMaxPendingRuns][kLanes];  ///< of runs
  float surface_t[kLanes];
  int32_t run_count[kLanes];
  int32_t flags[kLanes];  ///< bytes: saw outside, saw inside, starts, ends; 0 or 127 each
  uint32_t ray[kLanes];
  uint32_t count;
};

/// What the reference calls a Placement and inputs, for all lanes.
struct NetworkInputs {
  alignas(64) int32_t voxel[3][kMaxSamples][kLanes];
  int32_t fraction[3][kMaxSamples][kLanes];
  uint32_t corners[4][kLanes];  ///< features of one point's voxel: x and x + 1 of a row along x, F = 2 each
  uint32_t inputs[kMaxInputs / 4][kLanes];  ///< four to a word
  uint32_t hidden[2][kMaxWidth / 4][kLanes];
};

/// As to_index of the reference; the result is still a float.
HWY_INLINE hn::Vec<Floats> to_index(Floats d, hn::Vec<Floats> x, float top) {
  return hn::Trunc(hn::Min(hn::Max(x, hn::Zero(d)), hn::Set(d, top)));
}

/// Adds to each 32-bit sum the products of its four bytes, 0..127 in x and -127..127 in w.
HWY_INLINE hn::Vec<Ints> add_dot(hn::Vec<Ints> sum, hn::Vec<Words> x, hn::Vec<Words> w) {
#if HWY_TARGET == HWY_AVX3_DL
  // The intrinsic wants a target that Highway's list for AVX3_DL does not name (1.0.3).
  asm("vpdpbusd %2, %1, %0" : "+v"(sum.raw) : "v"(x.raw), "v"(w.raw));
  return sum;
#elif HWY_TARGET == HWY_AVX3
  const __m512i pairs = _mm512_maddubs_epi16(x.raw, w.raw);
  return hn::Vec<Ints>{_mm512_add_epi32(sum.raw, _mm512_madd_epi16(pairs, _mm512_set1_epi16(1)))};
#elif HWY_TARGET == HWY_AVX2
  const __m256i pairs = _mm256_maddubs_epi16(x.raw, w.raw);
  return hn::Vec<Ints>{_mm256_add_epi32(sum.raw, _mm256_madd_epi16(pairs, _mm256_set1_epi16(1)))};
#elif HWY_TARGET == HWY_SSE4
  const __m128i pairs = _mm_maddubs_epi16(x.raw, w.raw);
  return hn::Vec<Ints>{_mm_add_epi32(sum.raw, _mm_madd_epi16(pairs, _mm_set1_epi16(1)))};
#else
  const Ints d;
  const auto signed_w = hn::BitCast(d, w), signed_x = hn::BitCast(d, x);
  const auto byte = hn::Set(d, 255);
  sum = hn::Add(sum, hn::Mul(hn::And(signed_x, byte), hn::ShiftRight<24>(hn::ShiftLeft<24>(signed_w))));
  sum = hn::Add(sum, hn::Mul(hn::And(hn::ShiftRight<8>(signed_x), byte),
                             hn::ShiftRight<24>(hn::ShiftLeft<16>(signed_w))));
  sum = hn::Add(sum, hn::Mul(hn::And(hn::ShiftRight<16>(signed_x), byte),
                             hn::ShiftRight<24>(hn::ShiftLeft<8>(signed_w))));
  return hn::Add(sum, hn::Mul(hn::ShiftRight<24>(signed_x), hn::ShiftRight<24>(signed_w)));
#endif
}

/// Of the pairs (a0, a1) of 16-bit numbers in x and w, x.a0 w.a0 + x.a1 w.a1.
HWY_INLINE hn::Vec<Ints> pair_dot(hn::Vec<Ints> x, hn::Vec<Ints> w) {
#if HWY_TARGET == HWY_AVX3_DL || HWY_TARGET == HWY_AVX3
  return hn::Vec<Ints>{_mm512_madd_epi16(x.raw, w.raw)};
#elif HWY_TARGET == HWY_AVX2
  return hn::Vec<Ints>{_mm256_madd_epi16(x.raw, w.raw)};
#elif HWY_TARGET == HWY_SSE4
  return hn::Vec<Ints>{_mm_madd_epi16(x.raw, w.raw)};
#else
  const auto low =
      hn::Mul(hn::ShiftRight<16>(hn::ShiftLeft<16>(x)), hn::ShiftRight<16>(hn::ShiftLeft<16>(w)));
  return hn::Add(low, hn::Mul(hn::ShiftRight<16>(x), hn::ShiftRight<16>(w)));
#endif
}

/// K points for every lane, in the order of the network's inputs, and the inputs that are not features.
HWY_INLINE void place_samples(const SegmentField& field, const Pending& rays, NetworkInputs& out) {
  const Floats d;
  const Ints di;
  const uint32_t count = field.samples;
  const auto zero = hn::Zero(d);
  hn::Vec<Floats> origin[3], direction[3];
  for (uint32_t a = 0; a < 3; ++a) {
    origin[a] = hn::Load(d, rays.origin[a]);
    direction[a] = hn::Load(d, rays.direction[a]);
  }
  const auto reversed =
      hn::Or(hn::Lt(direction[2], zero),
             hn::And(hn::Eq(direction[2], zero),
                     hn::Or(hn::Lt(direction[1], zero),
                            hn::And(hn::Eq(direction[1], zero), hn::Lt(direction[0], zero)))));
  const auto reversed_int = hn::RebindMask(di, reversed);

  const auto surface_t = hn::Load(d, rays.surface_t);
  const auto spacing = hn::Div(surface_t, hn::Set(d, float(count)));
  const auto last_run = hn::Sub(hn::Load(di, rays.run_count), hn::Set(di, 1));
  auto run = hn::Zero(di);
  auto run_start = zero, begin = hn::Load(d, rays.begin[0]), end = hn::Load(d, rays.end[0]);
  for (uint32_t j = 0; j < count; ++j) {
    const auto s = hn::Mul(hn::Set(d, float(j) + 0.5f), spacing);
    for (;;) {
      const auto run_end = hn::Add(run_start, hn::Sub(end, begin));
      const auto beyond = hn::And(hn::RebindMask(d, hn::Lt(run, last_run)), hn::Gt(s, run_end));
      if (hn::AllFalse(d, beyond)) break;
      run_start = hn::IfThenElse(beyond, run_end, run_start);
      run = hn::Add(run, hn::IfThenElseZero(hn::RebindMask(di, beyond), hn::Set(di, 1)));
      const auto at = hn::Add(hn::Mul(run, hn::Set(di, int32_t(kLanes))), hn::Iota(di, 0));
      begin = hn::GatherIndex(d, rays.begin[0], at);
      end = hn::GatherIndex(d, rays.end[0], at);
    }
    const auto t = hn::Min(hn::Add(begin, hn::Sub(s, run_start)), end);
    for (uint32_t a = 0; a < 3; ++a) {
      const auto at = hn::Add(origin[a], hn::Mul(t, direction[a]));
      const auto voxel = to_index(d, at, float(field.voxels[a] - 1));
      const auto scaled =
          hn::Add(hn::Mul(hn::Sub(at, voxel), hn::Set(d, float(kFractionOne))), hn::Set(d, 0.5f));
      const auto voxel_int = hn::ConvertTo(di, voxel);
      const auto fraction = hn::ConvertTo(di, to_index(d, scaled, float(kFractionOne)));
      hn::BlendedStore(voxel_int, hn::Not(reversed_int), di, out.voxel[a][j]);
      hn::BlendedStore(voxel_int, reversed_int, di, out.voxel[a][count - 1 - j]);
      hn::BlendedStore(fraction, hn::Not(reversed_int), di, out.fraction[a][j]);
      hn::BlendedStore(fraction, reversed_int, di, out.fraction[a][count - 1 - j]);
    }
  }

  const auto square = [&](uint32_t a) { return hn::Mul(direction[a], direction[a]); };
  const auto length = hn::Sqrt(hn::Add(hn::Add(square(0), square(1)), square(2)));
  auto globals = hn::Zero(di);
  for (uint32_t a = 0; a < 3; ++a) {
    const auto unit = hn::Div(direction[a], length);
    const auto upward = hn::IfThenElse(reversed, hn::Neg(unit), unit);
    const auto scaled = hn::Add(hn::Set(d, 64.0f), hn::Mul(hn::Set(d, 63.5f), upward));
    const auto input = hn::ConvertTo(di, to_index(d, scaled, 127));
    globals = hn::Or(globals, hn::ShiftLeftSame(input, int(8 * a)));
  }
  const auto inside = hn::Mul(hn::Mul(surface_t, length), hn::Set(d, field.length_scale));
  const auto inside_input = hn::ConvertTo(di, to_index(d, hn::Add(inside, hn::Set(d, 0.5f)), 127));
  globals = hn::Or(globals, hn::ShiftLeft<24>(inside_input));
  // Bytes: saw outside, saw inside, starts, ends; a reversed segment ends where it started.
  const auto flags = hn::Load(di, rays.flags);
  const auto swapped = hn::Or(hn::And(flags, hn::Set(di, 0xffff)),
                              hn::Or(hn::And(hn::ShiftLeft<8>(flags), hn::Set(di, 0x7f000000)),
                                     hn::And(hn::ShiftRight<8>(flags), hn::Set(di, 0x00ff0000))));
  const Words dw;
  uint32_t(*const words)[kLanes] = out.inputs + count * field.features_per_corner / 4;
  hn::Store(hn::BitCast(dw, globals), dw, words[0]);
  hn::Store(hn::BitCast(dw, hn::IfThenElse(reversed_int, swapped, flags)), dw, words[1]);
}

/// Features of the corners (x, y, z) and (x + 1, y, z), two bytes each; 0 where one has none.
HWY_INLINE uint32_t fetch_two(const SegmentField& field, uint32_t x, uint32_t bits_yz, uint32_t bricks_yz) {
  uint32_t two = 0;
  for (uint32_t k = 0; k < 2; ++k) {
    const uint16_t entry = field.brick_table[bricks_yz + ((x + k) >> 2)];
    if (HWY_UNLIKELY(entry < kFirstMixedBrick)) continue;
    const uint64_t corners = field.brick_corners[entry - kFirstMixedBrick];
    const uint32_t bit = ((x + k) & 3) + bits_yz;
    if (HWY_UNLIKELY(!((corners >> bit) & 1))) continue;
    const auto rank = uint32_t(__builtin_popcountll(corners & ((uint64_t{1} << bit) - 1)));
    uint16_t pair;
    std::memcpy(&pair, field.features + 2 * size_t(field.corner_base[entry - kFirstMixedBrick] + rank), 2);
    two |= uint32_t(pair) << (16 * k);
  }
  return two;
}

/// The rows of a voxel's corners, for two features: row r runs along x at (y + r % 2, z + r / 2). All eight
/// are looked up alike, because branches on where a voxel lies in its brick are mispredicted.
HWY_INLINE void fetch_corners(const SegmentField& field, uint32_t x, uint32_t y, uint32_t z, uint32_t lane,
                              uint32_t (*rows)[kLanes]) {
  const uint32_t brick_x[2] = {x >> 2, (x + 1) >> 2}, bit_x[2] = {x & 3, (x + 1) & 3};
  uint32_t two[4];
  bool all = true;
  HWY_UNROLL(4)
  for (uint32_t r = 0; r < 4; ++r) {
    const uint32_t cy = y + r % 2, cz = z + r / 2;
    const uint32_t bits_yz = 4 * (cy & 3) + 16 * (cz & 3);
    const uint32_t bricks_yz = field.bricks[0] * ((cy >> 2) + field.bricks[1] * (cz >> 2));
    two[r] = 0;
    HWY_UNROLL(2)
    for (uint32_t k = 0; k < 2; ++k) {
      const uint32_t entry = field.brick_table[bricks_yz + brick_x[k]];
      const bool mixed = entry >= kFirstMixedBrick;
      const uint32_t brick = mixed ? entry - kFirstMixedBrick : 0;
      const uint64_t corners = field.brick_corners[brick];
      const uint32_t bit = bit_x[k] + bits_yz;
      all = all & mixed & ((corners >> bit) & 1);
      const auto rank = uint32_t(__builtin_popcountll(corners & ((uint64_t{1} << bit) - 1)));
      uint32_t corner = field.corner_base[brick] + rank;
      corner = corner < field.corners ? corner : 0;
      uint16_t pair;
      std::memcpy(&pair, field.features + 2 * size_t(corner), 2);
      two[r] |= uint32_t(pair) << (16 * k);
    }
  }
  for (uint32_t r = 0; r < 4; ++r) rows[r][lane] = two[r];
  if (HWY_UNLIKELY(!all)) {
    // A point that rounding has put into a voxel beside the surface.
    for (uint32_t r = 0; r < 4; ++r) {
      const uint32_t cy = y + r % 2, cz = z + r / 2;
      rows[r][lane] = fetch_two(field, x, 4 * (cy & 3) + 16 * (cz & 3),
                                field.bricks[0] * ((cy >> 2) + field.bricks[1] * (cz >> 2)));
    }
  }
}

/// Inputs from features, for two features a corner: each point gives two bytes.
HWY_INLINE void gather_pairs(const SegmentField& field, uint32_t rays, NetworkInputs& out) {
  const Ints di;
  const Words dw;
  const SegmentField own = field;  // which no store below can change
  const uint32_t present = (1u << rays) - 1;
  auto held = hn::Set(di, -1);  // the voxels whose corners the lanes hold
  for (uint32_t r = 0; r < 4; ++r) hn::Store(hn::Zero(dw), dw, out.corners[r]);
  const auto one = hn::Set(di, kFractionOne);
  const auto rounding = hn::Set(di, (127 << 21) + (1 << 21));
  for (uint32_t j = 0; j < field.samples; ++j) {
    const auto key =
        hn::Or(hn::Load(di, out.voxel[0][j]), hn::Or(hn::ShiftLeft<10>(hn::Load(di, out.voxel[1][j])),
                                                     hn::ShiftLeft<20>(hn::Load(di, out.voxel[2][j]))));
    uint32_t wanted = bits_of(Floats(), hn::RebindMask(Floats(), hn::Ne(key, held))) & present;
    held = key;
    for (; wanted != 0; wanted &= wanted - 1) {
      const auto lane = uint32_t(__builtin_ctz(wanted));
      fetch_corners(own, uint32_t(out.voxel[0][j][lane]), uint32_t(out.voxel[1][j][lane]),
                    uint32_t(out.voxel[2][j][lane]), lane, out.corners);
    }
    // Weights of low and high end along x, as a pair of 16-bit numbers.
    const auto x1 = hn::Load(di, out.fraction[0][j]), y1 = hn::Load(di, out.fraction[1][j]),
               z1 = hn::Load(di, out.fraction[2][j]);
    const auto y0 = hn::Sub(one, y1), z0 = hn::Sub(one, z1);
    const auto x_pair = hn::Or(hn::Sub(one, x1), hn::ShiftLeft<16>(x1));
    hn::Vec<Ints> along_x[2][4];  // [feature][row], -127..127 times 128
    for (uint32_t r = 0; r < 4; ++r) {
      // Bytes: feature 0 and 1 at x, then at x + 1.
      const hn::RepartitionToNarrow<Ints> dn;
      const auto row = hn::BitCast(dn, hn::Load(dw, out.corners[r]));
      const auto first = hn::ShiftRight<8>(hn::ShiftLeft<8>(row)), second = hn::ShiftRight<8>(row);
      along_x[0][r] = pair_dot(hn::BitCast(di, first), x_pair);
      along_x[1][r] = pair_dot(hn::BitCast(di, second), x_pair);
    }
    hn::Vec<Ints> input[2];
    for (uint32_t f = 0; f < 2; ++f) {
      const auto& g = along_x[f];
      const auto low = hn::Add(hn::Mul(g[0], y0), hn::Mul(g[1], y1));
      const auto high = hn::Add(hn::Mul(g[2], y0), hn::Mul(g[3], y1));
      const auto sum = hn::Add(hn::Mul(low, z0), hn::Mul(high, z1));
      input[f] = hn::ShiftRight<22>(hn::Add(sum, rounding));
    }
    const auto pair = hn::BitCast(dw, hn::Or(input[0], hn::ShiftLeft<8>(input[1])));
    uint32_t* word = out.inputs[j / 2];
    hn::Store(j % 2 == 0 ? pair : hn::Or(hn::Load(dw, word), hn::ShiftLeft<16>(pair)), dw, word);
  }
}

/// The same for any number of features, a ray at a time.
HWY_INLINE void gather_each(const SegmentField& field, uint32_t rays, NetworkInputs& out) {
  const uint32_t features = field.features_per_corner;
  for (uint32_t lane = 0; lane < rays; ++lane) {
    uint8_t inputs[kMaxFeatures * kMaxSamples];
    for (uint32_t j = 0; j < field.samples; ++j) {
      SamplePoint point;
      for (uint32_t a = 0; a < 3; ++a) {
        point.voxel[a] = uint16_t(out.voxel[a][j][lane]);
        point.fraction[a] = uint8_t(out.fraction[a][j][lane]);
      }
      interpolate_features(field, point, inputs + j * features);
    }
    for (uint32_t w = 0; w < field.samples * features / 4; ++w)
      std::memcpy(&out.inputs[w][lane], inputs + 4 * w, 4);
  }
}

/// The logits of all lanes.
HWY_INLINE hn::Vec<Ints> evaluate_network(const Network& network, NetworkInputs& in) {
  const Ints di;
  const Words dw;
  const uint32_t(*x)[kLanes] = in.inputs;
  for (uint32_t l = 0;; ++l) {
    const Network::Layer& layer = network.layers[l];
    const uint32_t words = layer.inputs / 4;
    const auto weight = [&](uint32_t row, uint32_t word) {
      uint32_t four;
      std::memcpy(&four, layer.weights + size_t(row) * layer.inputs + 4 * word, 4);
      return hn::Set(dw, four);
    };
    if (l + 1 == network.layer_count) {
      auto sum = hn::Set(di, layer.biases[0]);
      for (uint32_t i = 0; i < words; ++i) sum = add_dot(sum, hn::Load(dw, x[i]), weight(0, i));
      return sum;
    }
    uint32_t(*const y)[kLanes] = in.hidden[l % 2];
    const auto half = hn::Set(di, (1 << layer.shift) >> 1);
    for (uint32_t row = 0; row < layer.outputs; row += 4) {
      hn::Vec<Ints> sum[4];
      for (uint32_t k = 0; k < 4; ++k) sum[k] = hn::Set(di, layer.biases[row + k]);
      for (uint32_t i = 0; i < words; ++i) {
        const auto input = hn::Load(dw, x[i]);
        for (uint32_t k = 0; k < 4; ++k) sum[k] = add_dot(sum[k], input, weight(row + k, i));
      }
      auto four = hn::Zero(dw);
      for (uint32_t k = 0; k < 4; ++k) {
        const auto scaled = hn::ShiftRightSame(hn::Add(sum[k], half), int(layer.shift));
        const auto clamped = hn::Min(hn::Max(scaled, hn::Zero(di)), hn::Set(di, 127));
        four = hn::Or(four, hn::ShiftLeftSame(hn::BitCast(dw, clamped), int(8 * k)));
      }
      hn::Store(four, dw, y[row / 4]);
    }
    x = y;
  }
}

/// Answers all rays that wait.
HWY_INLINE void answer_pending(const SegmentField& field, Pending& rays, NetworkInputs& work,
                               AnswerBatch& answers) {
  // Lanes beyond the last ray repeat what an earlier batch left there or this does: any numbers will do that
  // place points inside the grid and end.
  for (uint32_t lane = rays.count; lane < kLanes; ++lane) {
    for (uint32_t a = 0; a < 3; ++a) rays.origin[a][lane] = rays.direction[a][lane] = 0;
    rays.begin[0][lane] = rays.end[0][lane] = rays.surface_t[lane] = 0;
    rays.run_count[lane] = 1;
    rays.flags[lane] = 0;
  }
  place_samples(field, rays, work);
  if (field.features_per_corner == 2)
    gather_pairs(field, rays.count, work);
  else
    gather_each(field, rays.count, work);
  const Ints di;
  alignas(64) int32_t logits[kLanes];
  hn::Store(evaluate_network(field.network, work), di, logits);
  for (uint32_t lane = 0; lane < rays.count; ++lane) {
    answers.logit[rays.ray[lane]] = logits[lane];
    answers.certain[rays.ray[lane]] = 0;
  }
  rays.count = 0;
}

}  // namespace nif::kernels::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
