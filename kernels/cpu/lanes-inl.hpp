// Vectors with one ray per lane, and operations that Highway (1.0.3) lacks or is slow at: lane sets as the
// bits of an integer, moving chosen lanes together and apart, small tables, unaligned gathers.
//
// Compiled once for each target.
#if defined(NIF_LANES_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef NIF_LANES_INL
#undef NIF_LANES_INL
#else
#define NIF_LANES_INL
#endif

#include <hwy/highway.h>

#include <cstring>

#include "kernels/cpu/isa.hpp"
#include "kernels/cpu/network/lane_tables.hpp"

HWY_BEFORE_NAMESPACE();
namespace nif::kernels::cpu::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;
using Floats = hn::CappedTag<float, 16>;
using Ints = hn::RebindToSigned<Floats>;
using Words = hn::RebindToUnsigned<Floats>;
constexpr uint32_t kLanes = uint32_t(hn::MaxLanes(Floats()));
constexpr uint32_t kAllLanes = (1u << kLanes) - 1;

/// Reinterprets the bits.
HWY_INLINE hn::Vec<Ints> ints(hn::Vec<Floats> v) { return hn::BitCast(Ints(), v); }
HWY_INLINE hn::Vec<Floats> floats(hn::Vec<Ints> v) { return hn::BitCast(Floats(), v); }

/// For whole numbers in range. Highway's conversion costs twice as much because it handles all others.
HWY_INLINE hn::Vec<Ints> to_ints(hn::Vec<Floats> v) {
#if HWY_TARGET == HWY_AVX3 || HWY_TARGET == HWY_AVX3_DL
  return hn::Vec<Ints>{_mm512_cvttps_epi32(v.raw)};
#elif HWY_TARGET == HWY_AVX2
  return hn::Vec<Ints>{_mm256_cvttps_epi32(v.raw)};
#elif HWY_TARGET == HWY_SSE4
  return hn::Vec<Ints>{_mm_cvttps_epi32(v.raw)};
#else
  return hn::ConvertTo(Ints(), v);
#endif
}

#if HWY_TARGET == HWY_AVX2 || HWY_TARGET == HWY_SSE4
// Of each lane, of 32 bits, or of 64 if it is a double. Highway's go through a byte, which costs another instruction or two.
HWY_INLINE uint32_t sign_bits(__m128 v) { return uint32_t(_mm_movemask_ps(v)); }
HWY_INLINE uint32_t sign_bits(__m128i v) { return sign_bits(_mm_castsi128_ps(v)); }
HWY_INLINE uint32_t sign_bits(__m128d v) { return uint32_t(_mm_movemask_pd(v)); }
#if HWY_TARGET == HWY_AVX2
HWY_INLINE uint32_t sign_bits(__m256 v) { return uint32_t(_mm256_movemask_ps(v)); }
HWY_INLINE uint32_t sign_bits(__m256i v) { return sign_bits(_mm256_castsi256_ps(v)); }
HWY_INLINE uint32_t sign_bits(__m256d v) { return uint32_t(_mm256_movemask_pd(v)); }
#endif
#elif HWY_TARGET == HWY_AVX3 || HWY_TARGET == HWY_AVX3_DL
/// The bits of a register for masks: __mmask8 or __mmask16, also those of intrinsics. In assembly, because GCC 12 may spill the mask
/// as 8 or 16 bits and read 32 back: then the upper ones are whatever lay there.
template <class Mask>
HWY_INLINE uint32_t bits_of_register(Mask mask) {
  uint32_t bits;
  if constexpr (sizeof(mask) == 1)
    asm("kmovb %1, %0" : "=r"(bits) : "k"(mask));
  else
    asm("kmovw %1, %0" : "=r"(bits) : "k"(mask));
  return bits;
}
#endif

/// The bits of a mask, that of lane 0 lowest. Bits beyond the lanes are 0.
template <class D>
HWY_INLINE uint32_t bits_of_mask([[maybe_unused]] D d, hn::Mask<D> mask) {
#if HWY_TARGET == HWY_AVX3 || HWY_TARGET == HWY_AVX3_DL
  uint32_t bits = bits_of_register(mask.raw);
  if constexpr (hn::MaxLanes(D()) < 8) bits &= (1u << hn::MaxLanes(D())) - 1;
  return bits;
#elif HWY_TARGET == HWY_AVX2 || HWY_TARGET == HWY_SSE4
  const uint32_t bits = sign_bits(mask.raw);
  constexpr size_t kLanesOfMask = hn::MaxLanes(D()), kWidth = sizeof(hn::TFromD<D>);
  return kLanesOfMask * kWidth == sizeof(mask.raw) ? bits : bits & ((1u << kLanesOfMask) - 1);
#elif HWY_TARGET == HWY_WASM
  return uint32_t(wasm_i32x4_bitmask(mask.raw));
#else
  uint8_t bytes[8] = {};
  hn::StoreMaskBits(d, mask, bytes);
  uint32_t bits;
  std::memcpy(&bits, bytes, sizeof(bits));
  return bits;
#endif
}
template <class Mask>
HWY_INLINE uint32_t bits_of(Mask mask) {
  return bits_of_mask(Floats(), hn::RebindMask(Floats(), mask));
}

/// Bits beyond kLanes must be 0.
HWY_INLINE hn::Mask<Floats> mask_of(uint32_t bits) {
  uint8_t bytes[8] = {};
  std::memcpy(bytes, &bits, sizeof(bits));
  return hn::LoadMaskBits(Floats(), bytes);
}

#if HWY_TARGET != HWY_WASM  // where Highway lacks doubles
/// Vectors with so few rays that their doubles fill one.
using Doubles = hn::CappedTag<double, 8>;
using FewFloats = hn::Rebind<float, Doubles>;
using FewInts = hn::Rebind<int32_t, Doubles>;
constexpr uint32_t kDoubles = uint32_t(hn::MaxLanes(Doubles()));

/// Bits beyond kDoubles must be 0.
HWY_INLINE hn::Mask<FewFloats> mask_of_few(uint32_t bits) {
  const uint8_t bytes[8] = {uint8_t(bits)};
  return hn::LoadMaskBits(FewFloats(), bytes);
}
#endif

/// The chosen lanes of v, moved to the front; the lanes after them are undefined.
template <class V>
HWY_INLINE V gather_lanes(uint32_t lanes, V v) {
#if HWY_TARGET == HWY_AVX3 || HWY_TARGET == HWY_AVX3_DL
  return hn::Compress(v, hn::RebindMask(hn::DFromV<V>(), mask_of(lanes)));
#elif HWY_TARGET == HWY_AVX2
  const hn::DFromV<V> d;
  const __m256i order =
      _mm256_cvtepu8_epi32(_mm_loadl_epi64(reinterpret_cast<const __m128i*>(kTogether8[lanes])));
  return hn::BitCast(d, hn::Vec<Ints>{_mm256_permutevar8x32_epi32(hn::BitCast(Ints(), v).raw, order)});
#elif HWY_TARGET == HWY_SSE4
  const hn::DFromV<V> d;
  const __m128i order = _mm_load_si128(reinterpret_cast<const __m128i*>(kTogether4[lanes]));
  return hn::BitCast(d, hn::Vec<Ints>{_mm_shuffle_epi8(hn::BitCast(Ints(), v).raw, order)});
#elif HWY_TARGET == HWY_WASM
  const hn::DFromV<V> d;
  const v128_t order = wasm_v128_load(kTogether4[lanes]);
  return hn::BitCast(d, hn::Vec<Ints>{wasm_i8x16_swizzle(hn::BitCast(Ints(), v).raw, order)});
#else
  return hn::Compress(v, hn::RebindMask(hn::DFromV<V>(), mask_of(lanes)));
#endif
}

/// Puts consecutive entries, starting at `from`, into the chosen lanes of v. A whole vector must be readable.
template <class V, class T>
HWY_INLINE V scatter_lanes(uint32_t lanes, V v, const T* from) {
  const hn::DFromV<V> d;
  [[maybe_unused]] const auto chosen = hn::RebindMask(d, mask_of(lanes));
#if HWY_TARGET == HWY_AVX3 || HWY_TARGET == HWY_AVX3_DL
  const Ints di;
  const auto next = hn::BitCast(di, hn::LoadU(d, from));
  return hn::BitCast(
      d, hn::Vec<Ints>{_mm512_mask_expand_epi32(hn::BitCast(di, v).raw, __mmask16(lanes), next.raw)});
#elif HWY_TARGET == HWY_AVX2
  const __m256i order =
      _mm256_cvtepu8_epi32(_mm_loadl_epi64(reinterpret_cast<const __m128i*>(kApart8[lanes])));
  const hn::Vec<Ints> next{_mm256_permutevar8x32_epi32(hn::BitCast(Ints(), hn::LoadU(d, from)).raw, order)};
  return hn::IfThenElse(chosen, hn::BitCast(d, next), v);
#elif HWY_TARGET == HWY_SSE4
  const __m128i order = _mm_load_si128(reinterpret_cast<const __m128i*>(kApart4[lanes]));
  const hn::Vec<Ints> next{_mm_shuffle_epi8(hn::BitCast(Ints(), hn::LoadU(d, from)).raw, order)};
  return hn::IfThenElse(chosen, hn::BitCast(d, next), v);
#elif HWY_TARGET == HWY_WASM
  const v128_t order = wasm_v128_load(kApart4[lanes]);
  const hn::Vec<Ints> next{wasm_i8x16_swizzle(hn::BitCast(Ints(), hn::LoadU(d, from)).raw, order)};
  return hn::IfThenElse(chosen, hn::BitCast(d, next), v);
#else
  alignas(64) T entries[kLanes];
  hn::Store(v, d, entries);
  for (; lanes != 0; lanes &= lanes - 1) entries[__builtin_ctz(lanes)] = *from++;
  return hn::Load(d, entries);
#endif
}

/// gather_lanes() of several vectors: computes the order once.
class LanesTogether {
 public:
#if HWY_TARGET == HWY_AVX3 || HWY_TARGET == HWY_AVX3_DL
  HWY_INLINE explicit LanesTogether(uint32_t lanes)
      : order_(_mm512_maskz_compress_epi32(__mmask16(lanes), hn::Iota(Ints(), 0).raw)) {}
  template <class V>
  HWY_INLINE V operator()(V v) const {
    return hn::BitCast(hn::DFromV<V>(),
                       hn::Vec<Ints>{_mm512_permutexvar_epi32(order_, hn::BitCast(Ints(), v).raw)});
  }

 private:
  __m512i order_;
#else
  HWY_INLINE explicit LanesTogether(uint32_t lanes) : lanes_(lanes) {}
  template <class V>
  HWY_INLINE V operator()(V v) const {
    return gather_lanes(lanes_, v);
  }

 private:
  uint32_t lanes_;
#endif
};

/// scatter_lanes() of several vectors.
class LanesApart {
 public:
#if HWY_TARGET == HWY_AVX3 || HWY_TARGET == HWY_AVX3_DL
  HWY_INLINE explicit LanesApart(uint32_t lanes)
      : order_(_mm512_mask_expand_epi32(hn::Iota(Ints(), 0).raw, __mmask16(lanes),
                                        hn::Iota(Ints(), int32_t(kLanes)).raw)) {}
  template <class V, class T>
  HWY_INLINE V operator()(V v, const T* from) const {
    const hn::DFromV<V> d;
    const auto next = hn::BitCast(Ints(), hn::LoadU(d, from));
    return hn::BitCast(
        d, hn::Vec<Ints>{_mm512_permutex2var_epi32(hn::BitCast(Ints(), v).raw, order_, next.raw)});
  }

 private:
  __m512i order_;
#else
  HWY_INLINE explicit LanesApart(uint32_t lanes) : lanes_(lanes) {}
  template <class V, class T>
  HWY_INLINE V operator()(V v, const T* from) const {
    return scatter_lanes(lanes_, v, from);
  }

 private:
  uint32_t lanes_;
#endif
};

#if HWY_TARGET == HWY_AVX2
// base[index], with a load for each lane.
template <class T>
HWY_INLINE __m128i load_lanes(const T* base, __m128i index) {
  static_assert(sizeof(T) == sizeof(int32_t));
  const auto word_at = [base](uint64_t i) HWY_ATTR {
    int32_t word;
    std::memcpy(&word, base + i, sizeof(word));
    return word;
  };
  const auto low = uint64_t(_mm_cvtsi128_si64(index)), high = uint64_t(_mm_extract_epi64(index, 1));
  __m128i words = _mm_cvtsi32_si128(word_at(low & 0xffffffff));
  words = _mm_insert_epi32(words, word_at(low >> 32), 1);
  words = _mm_insert_epi32(words, word_at(high & 0xffffffff), 2);
  return _mm_insert_epi32(words, word_at(high >> 32), 3);
}
template <class T>
HWY_INLINE __m256i load_lanes(const T* base, __m256i index) {
  const __m128i low = load_lanes(base, _mm256_castsi256_si128(index));
  const __m128i high = load_lanes(base, _mm256_extracti128_si256(index, 1));
  return _mm256_inserti128_si256(_mm256_castsi128_si256(low), high, 1);
}
#endif

/// base[index]; no index is negative. On AMD's processors AVX2's gather takes longer than a load for each lane; with AVX-512, which
/// has more lanes, to choose costs more than loads gain (docs/results/cpu-kernels.md, "Gathers").
template <class D, class T, class V>
HWY_INLINE hn::Vec<D> gather(D d, const T* base, V index) {
#if HWY_TARGET == HWY_AVX2
  if (kSlowGathers) return hn::BitCast(d, hn::Vec<hn::RebindToSigned<D>>{load_lanes(base, index.raw)});
#endif
  return hn::GatherIndex(d, base, index);
}

/// table[index]; the table is aligned and has kSize entries.
template <uint32_t kSize, class Tag, class T>
HWY_INLINE hn::Vec<Tag> look_up(Tag d, const T* table, hn::Vec<Ints> index) {
  static_assert(kSize <= 16);
#if HWY_TARGET == HWY_WASM
  // Highway's version works byte by byte. Bytes beyond a vector give 0.
  v128_t bytes =
      wasm_i32x4_add(wasm_i32x4_mul(index.raw, wasm_i32x4_splat(0x04040404)), wasm_i32x4_splat(0x03020100));
  v128_t found = wasm_i8x16_swizzle(wasm_v128_load(table), bytes);
  for (uint32_t first = kLanes; first < kSize; first += kLanes) {
    bytes = wasm_i8x16_sub(bytes, wasm_i8x16_splat(16));
    found = wasm_v128_or(found, wasm_i8x16_swizzle(wasm_v128_load(table + first), bytes));
  }
  return hn::BitCast(d, hn::Vec<Ints>{found});
#else
  if constexpr (kLanes >= kSize) {
    return hn::TableLookupLanes(hn::Load(d, table), hn::IndicesFromVec(d, index));
  } else if constexpr (kLanes * 2 == kSize) {
    const Ints di;
    const auto half = hn::Set(di, int32_t(kLanes));
    const auto indices = hn::IndicesFromVec(d, hn::And(index, hn::Set(di, int32_t(kLanes - 1))));
    const auto low = hn::TableLookupLanes(hn::Load(d, table), indices);
    const auto high = hn::TableLookupLanes(hn::Load(d, table + kLanes), indices);
    return hn::IfThenElse(hn::RebindMask(d, hn::Lt(index, half)), low, high);
  } else {
    return gather(d, table, index);
  }
#endif
}

/// By number of four bits: how many are set.
alignas(16) constexpr uint8_t kBitsOfNibbles[16] = {0, 1, 1, 2, 1, 2, 2, 3, 1, 2, 2, 3, 2, 3, 3, 4};

/// The number of set bits in each lane.
HWY_INLINE hn::Vec<Ints> count_bits(hn::Vec<Ints> v) {
#if HWY_TARGET == HWY_WASM  // Highway's version works byte by byte
  return hn::Vec<Ints>{
      wasm_u32x4_extadd_pairwise_u16x8(wasm_u16x8_extadd_pairwise_u8x16(wasm_i8x16_popcnt(v.raw)))};
#else
  return hn::BitCast(Ints(), hn::PopulationCount(hn::BitCast(Words(), v)));
#endif
}

/// The same for values below 256: Highway's version adds up the counts of all four bytes.
HWY_INLINE hn::Vec<Ints> count_bits_of_byte(hn::Vec<Ints> v) {
#if HWY_TARGET == HWY_WASM
  return hn::Vec<Ints>{wasm_i8x16_popcnt(v.raw)};
#else
  const Ints di;
  const auto counts = hn::LoadDup128(di, reinterpret_cast<const int32_t*>(kBitsOfNibbles));
  const auto low = hn::And(v, hn::Set(di, 15)), high = hn::ShiftRight<4>(v);
  return hn::Add(hn::TableLookupBytes(counts, low), hn::TableLookupBytes(counts, high));
#endif
}

/// value << bits. This value and 1 << bits must be less than 2^31.
HWY_INLINE hn::Vec<Ints> shifted(int32_t value, hn::Vec<Ints> bits) {
  const Ints di;
#if HWY_TARGET == HWY_WASM  // Highway's version takes a step for each bit of `bits`
  const auto power = floats(hn::ShiftLeft<23>(hn::Add(bits, hn::Set(di, 127))));
  const auto one = to_ints(power);
  return value == 1 ? one : hn::Mul(one, hn::Set(di, value));
#else
  return hn::Shl(hn::Set(di, value), bits);
#endif
}

/// Words at the given byte offsets from `base`, which need not be aligned.
HWY_INLINE hn::Vec<Words> gather_words(const void* base, hn::Vec<Ints> bytes) {
  const Words dw;
  if constexpr (kLanes >= 8) {
    return hn::GatherOffset(dw, static_cast<const uint32_t*>(base), bytes);
  } else {
    const Ints di;
    alignas(16) int32_t offsets[kLanes];
    alignas(16) uint32_t words[kLanes];
    hn::Store(bytes, di, offsets);
    for (uint32_t lane = 0; lane < kLanes; ++lane)
      std::memcpy(&words[lane], static_cast<const char*>(base) + offsets[lane], sizeof(uint32_t));
    return hn::Load(dw, words);
  }
}

HWY_INLINE hn::Vec<Ints> gather_ints(const void* base, hn::Vec<Ints> bytes) {
  return hn::BitCast(Ints(), gather_words(base, bytes));
}

}  // namespace nif::kernels::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
