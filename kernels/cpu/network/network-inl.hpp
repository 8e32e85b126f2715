// Answers in SIMD what the traversal leaves open: sample points, features, network; one ray per lane
// throughout.
//
// Compiled once for each target.
#if defined(NIF_NETWORK_NETWORK_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef NIF_NETWORK_NETWORK_INL
#undef NIF_NETWORK_NETWORK_INL
#else
#define NIF_NETWORK_NETWORK_INL
#endif

#include "kernels/cpu/network/packed_field.hpp"
#include "kernels/cpu/planes/grid_traversal-inl.hpp"
#include "kernels/reference/network/samples.hpp"

HWY_BEFORE_NAMESPACE();
namespace nif::kernels::cpu::HWY_NAMESPACE {

/// Intervals of one ray that there is room for. The reference answers rays with more.
inline constexpr uint32_t kMaxPendingIntervals = 32;

/// Rays for the network to answer next, one per lane.
struct Pending {
  alignas(64) float origin[3][kLanes];  ///< in grid space, as in the reference
  float direction[3][kLanes];
  float begin[kMaxPendingIntervals][kLanes], end[kMaxPendingIntervals][kLanes];  ///< of intervals
  int32_t heights[kMaxPendingIntervals][kLanes];
  float open_t[kLanes];
  int32_t interval_count[kLanes];
  int32_t flags[kLanes];  ///< bytes: saw outside, saw inside, starts, ends; 0 or 127 each
};

/// Voxels whose corners are fetched together: for all points of all lanes, each voxel that differs from the
/// point before.
inline constexpr uint32_t kMaxVisits = kMaxSamples * kLanes;

/// The reference's Placement and inputs, for all lanes.
struct NetworkInputs {
  alignas(64) int32_t voxel[kMaxSamples][kLanes];  ///< x + 2^10 y + 2^20 z
  int32_t fraction[kMaxSamples][kLanes];           ///< x + 2^8 y + 2^16 z, 0..128 each
  int32_t visits[kMaxVisits + kLanes];             ///< voxels, in the order of points and then lanes
  uint32_t visited[4][kMaxVisits + kLanes];        ///< of each: features at x and x + 1 of a row along x
  uint32_t corners[4][kLanes];                     ///< the same for each lane's current voxel
  uint32_t inputs[kMaxInputs / 4][kLanes];         ///< four to a word
  uint32_t hidden[2][kMaxWidth / 4][kLanes];
};

/// Like the reference's to_index, but without truncation, which the conversion to integers does.
HWY_INLINE hn::Vec<Floats> clamp(hn::Vec<Floats> x, float top) {
  const Floats d;
  return hn::Min(hn::Max(x, hn::Zero(d)), hn::Set(d, top));
}

/// Adds to each 32-bit sum the products of its four bytes, 0..127 in x and -127..127 in w. kAvxVnni: the
/// machine has AVX-VNNI, the one AVX-512 VNNI instruction that exists for AVX2.
template <bool kAvxVnni>
HWY_INLINE hn::Vec<Ints> add_dot(hn::Vec<Ints> sum, hn::Vec<Words> x, hn::Vec<Words> w) {
#if HWY_TARGET == HWY_AVX3_DL
  // The intrinsic needs a target that Highway's list for AVX3_DL does not name (1.0.3).
  asm("vpdpbusd %2, %1, %0" : "+v"(sum.raw) : "v"(x.raw), "v"(w.raw));
  return sum;
#elif HWY_TARGET == HWY_AVX3
  const __m512i pairs = _mm512_maddubs_epi16(x.raw, w.raw);
  return hn::Vec<Ints>{_mm512_add_epi32(sum.raw, _mm512_madd_epi16(pairs, _mm512_set1_epi16(1)))};
#elif HWY_TARGET == HWY_AVX2
  if constexpr (kAvxVnni) {
    asm("%{vex%} vpdpbusd %2, %1, %0" : "+x"(sum.raw) : "x"(x.raw), "x"(w.raw));
    return sum;
  }
  const __m256i pairs = _mm256_maddubs_epi16(x.raw, w.raw);
  return hn::Vec<Ints>{_mm256_add_epi32(sum.raw, _mm256_madd_epi16(pairs, _mm256_set1_epi16(1)))};
#elif HWY_TARGET == HWY_SSE4
  const __m128i pairs = _mm_maddubs_epi16(x.raw, w.raw);
  return hn::Vec<Ints>{_mm_add_epi32(sum.raw, _mm_madd_epi16(pairs, _mm_set1_epi16(1)))};
#elif HWY_TARGET == HWY_WASM
  // Even bytes, then odd ones, as 16-bit numbers.
  const v128_t even = wasm_i32x4_dot_i16x8(wasm_v128_and(x.raw, wasm_i16x8_splat(255)),
                                           wasm_i16x8_shr(wasm_i16x8_shl(w.raw, 8), 8));
  const v128_t odd = wasm_i32x4_dot_i16x8(wasm_u16x8_shr(x.raw, 8), wasm_i16x8_shr(w.raw, 8));
  return hn::Vec<Ints>{wasm_i32x4_add(sum.raw, wasm_i32x4_add(even, odd))};
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

/// x.a0 w.a0 + x.a1 w.a1 for the pairs (a0, a1) of 16-bit numbers in x and w.
HWY_INLINE hn::Vec<Ints> pair_dot(hn::Vec<Ints> x, hn::Vec<Ints> w) {
#if HWY_TARGET == HWY_AVX3_DL || HWY_TARGET == HWY_AVX3
  return hn::Vec<Ints>{_mm512_madd_epi16(x.raw, w.raw)};
#elif HWY_TARGET == HWY_AVX2
  return hn::Vec<Ints>{_mm256_madd_epi16(x.raw, w.raw)};
#elif HWY_TARGET == HWY_SSE4
  return hn::Vec<Ints>{_mm_madd_epi16(x.raw, w.raw)};
#elif HWY_TARGET == HWY_WASM
  return hn::Vec<Ints>{wasm_i32x4_dot_i16x8(x.raw, w.raw)};
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

  const auto open_t = hn::Load(d, rays.open_t);
  const auto spacing = hn::Div(open_t, hn::Set(d, float(count)));
  // Arc length at which each interval starts, summed up as the reference does. A point at arc length s is in
  // the last interval that starts before s, because no interval has negative length.
  const auto interval_count = hn::Load(di, rays.interval_count);
  uint32_t intervals = 1;
  alignas(64) float interval_start[kMaxPendingIntervals][kLanes];
  auto start = zero;
  for (; intervals < kMaxPendingIntervals; ++intervals) {
    const auto more = hn::RebindMask(d, hn::Gt(interval_count, hn::Set(di, int32_t(intervals))));
    if (hn::AllFalse(d, more)) break;
    start =
        hn::Add(start, hn::Sub(hn::Load(d, rays.end[intervals - 1]), hn::Load(d, rays.begin[intervals - 1])));
    hn::Store(hn::IfThenElse(more, start, hn::Set(d, kNever)), d, interval_start[intervals]);
  }
  const Words dw;
  uint32_t(*const height_words)[kLanes] = out.inputs + count * field.features_per_corner / 4;
  auto heights_of_four = hn::Zero(di);
  for (uint32_t j = 0; j < count; ++j) {
    // If the ray is reversed, points are counted from the end.
    const auto rank =
        hn::IfThenElse(reversed, hn::Set(d, float(count - 1 - j) + 0.5f), hn::Set(d, float(j) + 0.5f));
    const auto s = hn::Mul(rank, spacing);
    auto begin = hn::Load(d, rays.begin[0]), end = hn::Load(d, rays.end[0]), interval_from = zero;
    auto heights = hn::Load(di, rays.heights[0]);
    for (uint32_t r = 1; r < intervals; ++r) {
      const auto from = hn::Load(d, interval_start[r]);
      const auto later = hn::Gt(s, from);
      interval_from = hn::IfThenElse(later, from, interval_from);
      begin = hn::IfThenElse(later, hn::Load(d, rays.begin[r]), begin);
      end = hn::IfThenElse(later, hn::Load(d, rays.end[r]), end);
      heights = hn::IfThenElse(hn::RebindMask(di, later), hn::Load(di, rays.heights[r]), heights);
    }
    const auto t = hn::Min(hn::Add(begin, hn::Sub(s, interval_from)), end);
    const auto low = hn::ConvertTo(d, hn::And(heights, hn::Set(di, 255))),
               high = hn::ConvertTo(d, hn::ShiftRight<8>(heights));
    const auto share = hn::Div(hn::Sub(t, begin), hn::Sub(end, begin));
    const auto height = hn::Add(hn::Add(low, hn::Mul(hn::Sub(high, low), share)), hn::Set(d, 0.5f));
    heights_of_four = hn::Or(heights_of_four,
                             hn::ShiftLeftSame(to_ints(clamp(height, float(kTopHeight))), int(8 * (j % 4))));
    if (j % 4 == 3) {
      hn::Store(hn::BitCast(dw, heights_of_four), dw, height_words[j / 4]);
      heights_of_four = hn::Zero(di);
    }
    auto voxels = hn::Zero(di), fractions = hn::Zero(di);
    for (uint32_t a = 0; a < 3; ++a) {
      const auto at =
          hn::Mul(hn::Add(origin[a], hn::Mul(t, direction[a])), hn::Set(d, field.voxels_per_cell));
      const auto voxel = hn::Trunc(clamp(at, float(field.voxels[a] - 1)));
      const auto scaled =
          hn::Add(hn::Mul(hn::Sub(at, voxel), hn::Set(d, float(kFractionOne))), hn::Set(d, 0.5f));
      const auto fraction = clamp(scaled, float(kFractionOne));
      voxels = hn::Or(voxels, hn::ShiftLeftSame(to_ints(voxel), int(10 * a)));
      fractions = hn::Or(fractions, hn::ShiftLeftSame(to_ints(fraction), int(8 * a)));
    }
    hn::Store(voxels, di, out.voxel[j]);
    hn::Store(fractions, di, out.fraction[j]);
  }

  const auto square = [&](uint32_t a) { return hn::Mul(direction[a], direction[a]); };
  const auto length = hn::Sqrt(hn::Add(hn::Add(square(0), square(1)), square(2)));
  auto globals = hn::Zero(di);
  for (uint32_t a = 0; a < 3; ++a) {
    const auto unit = hn::Div(direction[a], length);
    const auto upward = hn::IfThenElse(reversed, hn::Neg(unit), unit);
    const auto scaled = hn::Add(hn::Set(d, 64.0f), hn::Mul(hn::Set(d, 63.5f), upward));
    const auto input = to_ints(clamp(scaled, 127));
    globals = hn::Or(globals, hn::ShiftLeftSame(input, int(8 * a)));
  }
  const auto inside = hn::Mul(hn::Mul(open_t, length), hn::Set(d, field.length_scale));
  const auto inside_input = to_ints(clamp(hn::Add(inside, hn::Set(d, 0.5f)), 127));
  globals = hn::Or(globals, hn::ShiftLeft<24>(inside_input));
  // Bytes: saw outside, saw inside, starts, ends; a reversed segment ends where it started.
  const auto flags = hn::Load(di, rays.flags);
  const auto swapped = hn::Or(hn::And(flags, hn::Set(di, 0xffff)),
                              hn::Or(hn::And(hn::ShiftLeft<8>(flags), hn::Set(di, 0x7f000000)),
                                     hn::And(hn::ShiftRight<8>(flags), hn::Set(di, 0x00ff0000))));
  uint32_t(*const words)[kLanes] = height_words + count / 4;
  hn::Store(hn::BitCast(dw, globals), dw, words[0]);
  hn::Store(hn::BitCast(dw, hn::IfThenElse(reversed_int, swapped, flags)), dw, words[1]);
}

/// The features at the corners of a voxel without surface, into which rounding moved a point.
HWY_NOINLINE void visit_beside(const PackedField& field, NetworkInputs& out, uint32_t visit) {
  const auto voxel = uint32_t(out.visits[visit]);
  for (uint32_t r = 0; r < 4; ++r) {
    uint16_t two[2];
    for (uint32_t k = 0; k < 2; ++k)
      two[k] = corner_pair(field, (voxel & 1023) + k, (voxel >> 10 & 1023) + r % 2, (voxel >> 20) + r / 2);
    out.visited[r][visit] = uint32_t(two[0]) | uint32_t(two[1]) << 16;
  }
}

/// Fetches the corners of all voxels visited.
HWY_INLINE void visit_voxels(const PackedField& field, uint32_t count, NetworkInputs& out) {
  const Ints di;
  const Words dw;
  const FeatureGrid& grid = field.corners_by_brick;
  const auto three = hn::Set(di, 3), one = hn::Set(di, 1);
  for (uint32_t i = 0; i < count; i += kLanes) {
    const auto voxel = hn::Load(di, out.visits + i);
    const auto ten_bits = hn::Set(di, 1023);
    const auto x = hn::And(voxel, ten_bits), y = hn::And(hn::ShiftRight<10>(voxel), ten_bits),
               z = hn::ShiftRight<20>(voxel);
    const auto row =
        hn::Add(hn::ShiftRight<2>(y), hn::Mul(hn::ShiftRight<2>(z), hn::Set(di, int32_t(grid.size[1]))));
    const auto brick = hn::Add(hn::ShiftRight<2>(x), hn::Mul(row, hn::Set(di, int32_t(grid.size[0]))));
    const auto word = gather_ints(grid.table.data(), hn::ShiftLeft<2>(hn::ShiftRight<4>(brick)));
    const auto number_bit = shifted(1, hn::And(brick, hn::Set(di, 15)));
    const auto before = count_bits(hn::And(word, hn::Sub(number_bit, one)));
    const auto rank = hn::Add(before, hn::BitCast(di, hn::ShiftRight<16>(hn::BitCast(dw, word))));
    const auto entry = hn::IfThenElseZero(hn::TestBit(word, number_bit), hn::Add(rank, one));
    const auto record = hn::ShiftLeft<3>(hn::Add(entry, hn::ShiftLeft<1>(entry)));  // records have 24 bytes
    const auto layer = hn::Add(record, hn::ShiftLeft<2>(hn::And(z, three)));
    const auto first = gather_ints(grid.bricks.data(), record);
    const char* const layers = reinterpret_cast<const char*>(grid.bricks.data()) + sizeof(uint32_t);
    const auto low = gather_ints(layers, layer), high = gather_ints(layers + 4, layer);
    const auto y_bit = hn::And(y, three);
    const auto bit = hn::Add(hn::And(x, three), hn::Add(y_bit, hn::ShiftLeft<2>(y_bit)));
    const auto below_0 = hn::Sub(shifted(1, bit), one);
    const auto below_1 = hn::Or(hn::ShiftLeft<5>(below_0), hn::Set(di, 31));
    const auto four = shifted(0x63, bit);
    const auto missing = hn::Ne(hn::And(hn::And(low, high), four), four);
    const auto at = [&](hn::Vec<Ints> corners, hn::Vec<Ints> below) {
      const auto words = hn::BitCast(dw, corners);
      const auto under = hn::Add(hn::BitCast(di, hn::ShiftRight<25>(words)), first);
      const auto lower = count_bits(hn::And(corners, below));
      return hn::ShiftLeft<1>(hn::Add(under, lower));
    };
    hn::Store(gather_words(grid.pairs.data(), at(low, below_0)), dw, out.visited[0] + i);
    hn::Store(gather_words(grid.pairs.data(), at(low, below_1)), dw, out.visited[1] + i);
    hn::Store(gather_words(grid.pairs.data(), at(high, below_0)), dw, out.visited[2] + i);
    hn::Store(gather_words(grid.pairs.data(), at(high, below_1)), dw, out.visited[3] + i);
    uint32_t beside = bits_of(missing);
    for (beside &= (count - i >= kLanes ? ~0u : (1u << (count - i)) - 1); HWY_UNLIKELY(beside != 0);
         beside &= beside - 1)
      visit_beside(field, out, i + uint32_t(__builtin_ctz(beside)));
  }
}

/// Computes inputs for two features per corner: each point gives two bytes.
HWY_INLINE void gather_pairs(const PackedField& field, uint32_t rays, NetworkInputs& out) {
  const Ints di;
  const Words dw;
  const uint32_t present = (1u << rays) - 1;
  uint32_t count = 0;
  uint32_t fresh[kMaxSamples];  // lanes whose point lies in another voxel than the previous point
  auto held = hn::Set(di, -1);
  for (uint32_t j = 0; j < field.samples; ++j) {
    const auto voxel = hn::Load(di, out.voxel[j]);
    fresh[j] = bits_of(hn::Ne(voxel, held)) & present;
    hn::StoreU(gather_lanes(fresh[j], voxel), di, out.visits + count);
    count += uint32_t(__builtin_popcount(fresh[j]));
    held = voxel;
  }
  hn::StoreU(hn::Zero(di), di, out.visits + count);
  visit_voxels(field, count, out);

  for (uint32_t r = 0; r < 4; ++r) hn::Store(hn::Zero(dw), dw, out.corners[r]);
  const auto whole = hn::Set(di, kFractionOne), byte = hn::Set(di, 255);
  const auto rounding = hn::Set(di, (127 << 21) + (1 << 21));
  uint32_t next = 0;
  for (uint32_t j = 0; j < field.samples; ++j) {
    hn::Vec<Words> corners[4];
    for (uint32_t r = 0; r < 4; ++r) {
      corners[r] = scatter_lanes(fresh[j], hn::Load(dw, out.corners[r]), out.visited[r] + next);
      hn::Store(corners[r], dw, out.corners[r]);
    }
    next += uint32_t(__builtin_popcount(fresh[j]));
    // Weights of the low and high end along x, as a pair of 16-bit numbers.
    const auto fraction = hn::Load(di, out.fraction[j]);
    const auto x1 = hn::And(fraction, byte), y1 = hn::And(hn::ShiftRight<8>(fraction), byte),
               z1 = hn::ShiftRight<16>(fraction);
    const auto y0 = hn::Sub(whole, y1), z0 = hn::Sub(whole, z1);
    const auto x_pair = hn::Or(hn::Sub(whole, x1), hn::ShiftLeft<16>(x1));
    hn::Vec<Ints> along_x[2][4];  // [feature][row], -127..127 times 128
    for (uint32_t r = 0; r < 4; ++r) {
      // Bytes: feature 0 and 1 at x, then at x + 1.
      const hn::RepartitionToNarrow<Ints> dn;
      const auto row = hn::BitCast(dn, corners[r]);
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

/// The same for any number of features, one ray at a time.
HWY_INLINE void gather_each(const PackedField& field, uint32_t rays, NetworkInputs& out) {
  const uint32_t features = field.features_per_corner;
  for (uint32_t lane = 0; lane < rays; ++lane) {
    uint8_t inputs[kMaxFeatures * kMaxSamples];
    for (uint32_t j = 0; j < field.samples; ++j) {
      SamplePoint point;
      for (uint32_t a = 0; a < 3; ++a) {
        point.voxel[a] = uint16_t(out.voxel[j][lane] >> (10 * a) & 1023);
        point.fraction[a] = uint8_t(out.fraction[j][lane] >> (8 * a) & 255);
      }
      interpolate_features(field, point, inputs + j * features);
    }
    for (uint32_t w = 0; w < field.samples * features / 4; ++w)
      std::memcpy(&out.inputs[w][lane], inputs + 4 * w, 4);
  }
}

/// The logits of all lanes.
template <bool kAvxVnni>
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
      for (uint32_t i = 0; i < words; ++i) sum = add_dot<kAvxVnni>(sum, hn::Load(dw, x[i]), weight(0, i));
      return sum;
    }
    uint32_t(*const y)[kLanes] = in.hidden[l % 2];
    const auto half = hn::Set(di, (1 << layer.shift) >> 1);
    for (uint32_t row = 0; row < layer.outputs; row += 4) {
      hn::Vec<Ints> sum[4];
      for (uint32_t k = 0; k < 4; ++k) sum[k] = hn::Set(di, layer.biases[row + k]);
      for (uint32_t i = 0; i < words; ++i) {
        const auto input = hn::Load(dw, x[i]);
        for (uint32_t k = 0; k < 4; ++k) sum[k] = add_dot<kAvxVnni>(sum[k], input, weight(row + k, i));
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

/// Takes up to kLanes open rays, starting with number k.
HWY_INLINE void take_open(const SegmentField& field, const SegmentBatch& batch, const IntervalLog& log,
                          uint32_t k, Pending& rays) {
  const Floats d;
  const Ints di;
  const OpenIntervals& open = log.open;
  const auto present = hn::FirstN(d, log.count - k);
  const auto present_int = hn::RebindMask(di, present);
  const auto if_present = [&](hn::Vec<Ints> v) { return hn::IfThenElseZero(present_int, v); };
  // Lanes beyond the last ray: an interval without length, anywhere in the grid.
  const auto info = if_present(hn::Load(di, log.end_info + k));
  const auto ray = hn::ShiftRight<kRayShift>(info);
  const auto flags = gather(di, log.flags, ray);
  const auto intervals = if_present(hn::Load(di, open.cells + k)),
             first = if_present(hn::Load(di, open.first + k));

  const auto scale = hn::Set(d, field.cells_per_unit);
  for (uint32_t a = 0; a < 3; ++a) {
    const auto origin = gather(d, batch.origin[a], ray), direction = gather(d, batch.direction[a], ray);
    const auto flat = hn::RebindMask(d, hn::TestBit(flags, hn::Set(di, kFlatAxis << a)));
    const auto from = hn::Mul(hn::Sub(origin, hn::Set(d, field.origin[a])), scale);
    hn::Store(hn::IfThenElseZero(present, from), d, rays.origin[a]);
    hn::Store(hn::IfThenElseZero(hn::AndNot(flat, present), hn::Mul(direction, scale)), d, rays.direction[a]);
  }

  const auto interval_count = hn::Min(intervals, hn::Set(di, int32_t(kMaxPendingIntervals)));
  auto open_t = hn::Zero(d), last_end = hn::Zero(d);
  for (uint32_t r = 0; r < kMaxPendingIntervals; ++r) {
    const auto in_use_int = hn::Gt(interval_count, hn::Set(di, int32_t(r)));
    const auto in_use = hn::RebindMask(d, in_use_int);
    if (r > 0 && hn::AllFalse(d, in_use)) break;
    const auto number = hn::IfThenElseZero(in_use_int, hn::Add(first, hn::Set(di, int32_t(r))));
    const auto begin = hn::IfThenElseZero(in_use, gather(d, open.begin, number));
    const auto end = hn::IfThenElseZero(in_use, gather(d, open.end, number));
    hn::Store(begin, d, rays.begin[r]);
    hn::Store(end, d, rays.end[r]);
    hn::Store(hn::IfThenElseZero(in_use_int, gather(di, open.heights, number)), di, rays.heights[r]);
    open_t = hn::Add(open_t, hn::Sub(end, begin));
    last_end = hn::IfThenElse(in_use, end, last_end);
  }
  hn::Store(open_t, d, rays.open_t);
  hn::Store(interval_count, di, rays.interval_count);

  const auto when = [&](auto condition, int32_t value) {
    return hn::IfThenElseZero(condition, hn::Set(di, value));
  };
  const auto has = [&](hn::Vec<Ints> bits, int32_t bit) { return hn::TestBit(bits, hn::Set(di, bit)); };
  const auto first_begin = hn::Load(d, rays.begin[0]), enter = gather(d, log.enter, ray);
  const auto starts = hn::AndNot(has(flags, kEntersGrid), hn::RebindMask(di, hn::Eq(first_begin, enter)));
  const auto ends =
      hn::AndNot(has(flags, kLeavesGrid), hn::RebindMask(di, hn::Eq(last_end, gather(d, log.leave, ray))));
  const auto outside = has(info, int32_t(kSeenOutside) << kSeenShift),
             inside = has(info, int32_t(kSeenInside) << kSeenShift);
  hn::Store(hn::Or(hn::Or(when(outside, 127), when(inside, 127 << 8)),
                   hn::Or(when(starts, 127 << 16), when(ends, 127 << 24))),
            di, rays.flags);
}

/// Answers what the traversal left open, and adds rays with too many intervals to the hard rays.
template <bool kAvxVnni>
HWY_INLINE void answer_open(const PackedField& field, const SegmentBatch& batch, const IntervalLog& log,
                            Pending& rays, NetworkInputs& work, AnswerBatch& answers, HardRays& hard) {
  const Ints di;
  for (uint32_t k = 0; k < log.count; k += kLanes) {
    const uint32_t count = std::min(kLanes, log.count - k);
    take_open(field, batch, log, k, rays);
    place_samples(field, rays, work);
    if (field.features_per_corner == 2)
      gather_pairs(field, count, work);
    else
      gather_each(field, count, work);
    alignas(64) int32_t logits[kLanes];
    hn::Store(evaluate_network<kAvxVnni>(field.network, work), di, logits);
    for (uint32_t lane = 0; lane < count; ++lane) {
      const auto ray = log.ray(k + lane);
      answers.logit[ray] = logits[lane];
      answers.certain[ray] = 0;
      if (HWY_UNLIKELY(log.open.cells[k + lane] > int32_t(kMaxPendingIntervals)))
        hard.ray[hard.count++] = ray;
    }
  }
}

}  // namespace nif::kernels::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
