// Tests the triangles of a node's leaves, four at once in single precision, if that surely gives the
// reference's answer.
//
// The sides of a triangle that a ray passes on, in single precision, have a bounded error
// (docs/encodings/bvh.md, "Triangles in single precision"). A ray that passes nearer to an edge, or to an end
// of the segment, is left to the reference.
//
// Compiled once for each target.
#if defined(NIF_BVH_TRIANGLES_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef NIF_BVH_TRIANGLES_INL
#undef NIF_BVH_TRIANGLES_INL
#else
#define NIF_BVH_TRIANGLES_INL
#endif

#include <hwy/highway.h>

#include "kernels/cpu/holes/holes.hpp"
#include "kernels/cpu/triangles/rays-inl.hpp"
#include "kernels/cpu/triangles/sides-inl.hpp"
#include "kernels/reference/batch.hpp"

HWY_BEFORE_NAMESPACE();
namespace nif::kernels::cpu::HWY_NAMESPACE {

/// One triangle of a leaf per lane.
using Four = hn::FixedTag<float, 4>;

/// Magnitudes of two coordinates, summed or separate.
#if HWY_TARGET == HWY_AVX3
using Sizes = hn::Vec<hn::FixedTag<float, 8>>;
#else
using Sizes = hn::Vec<Four>;
#endif

/// One corner of each triangle, sheared: seen along the ray, which is the origin.
struct Corner {
  hn::Vec<Four> x, y;
  Sizes size;
};

/// For each longest axis: where a loaded vertex has its coordinates, in the order of ReadyRay::origin.
/// Vertices are loaded from the word before them, because memory may end right after the last one.
alignas(64) constexpr int32_t kVertexOrder[3][4] = {{2, 3, 1, 0}, {3, 1, 2, 0}, {1, 2, 3, 0}};

#if HWY_TARGET == HWY_AVX3
/// The same for the coordinates of four vertices: one per block, each four times.
alignas(64) constexpr int32_t kCoordinateOrder[3][16] = {
    {2, 6, 10, 14, 3, 7, 11, 15, 1, 5, 9, 13, 1, 5, 9, 13},
    {3, 7, 11, 15, 1, 5, 9, 13, 2, 6, 10, 14, 2, 6, 10, 14},
    {1, 5, 9, 13, 2, 6, 10, 14, 3, 7, 11, 15, 3, 7, 11, 15}};
alignas(64) constexpr int32_t kEachFourTimes[16] = {0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 2, 2, 2, 2};

/// What the tests of a leaf's triangles share.
class LeafRay {
 public:
  HWY_INLINE explicit LeafRay(const ReadyRay& ray)
      : order_(_mm512_load_si512(kCoordinateOrder[ray.exit[3]])),
        origin_(spread(ray.origin)),
        shear_(_mm512_castps512_ps256(spread(ray.shear))) {}

  HWY_INLINE Corner corner(const float* const vertices[4]) const {
    const __m256 low =
        _mm256_insertf128_ps(_mm256_castps128_ps256(_mm_loadu_ps(vertices[0])), _mm_loadu_ps(vertices[1]), 1);
    const __m256 high =
        _mm256_insertf128_ps(_mm256_castps128_ps256(_mm_loadu_ps(vertices[2])), _mm_loadu_ps(vertices[3]), 1);
    const __m512 all = _mm512_insertf32x8(_mm512_castps256_ps512(low), high, 1);
    const __m512 seen = _mm512_sub_ps(_mm512_permutexvar_ps(order_, all), origin_);
    const __m256 depth = _mm512_castps512_ps256(_mm512_shuffle_f32x4(seen, seen, 0xaa));
    const __m256 xy = _mm256_fnmadd_ps(depth, shear_, _mm512_castps512_ps256(seen));
    const __m256 size = _mm256_and_ps(xy, _mm256_castsi256_ps(_mm256_set1_epi32(0x7fffffff)));
    return {hn::Vec<Four>{_mm256_castps256_ps128(xy)}, hn::Vec<Four>{_mm256_extractf128_ps(xy, 1)},
            Sizes{size}};
  }

  /// The sum of all magnitudes.
  static HWY_INLINE hn::Vec<Four> sum(Sizes a, Sizes b, Sizes c) {
    const __m256 xy = _mm256_add_ps(_mm256_add_ps(a.raw, b.raw), c.raw);
    return hn::Vec<Four>{_mm_add_ps(_mm256_castps256_ps128(xy), _mm256_extractf128_ps(xy, 1))};
  }

 private:
  static HWY_INLINE __m512 spread(const float* from) {
    return _mm512_permutexvar_ps(_mm512_load_si512(kEachFourTimes),
                                 _mm512_castps128_ps512(_mm_load_ps(from)));
  }
  __m512i order_;
  __m512 origin_;
  __m256 shear_;
};
#else
class LeafRay {
 public:
  HWY_INLINE explicit LeafRay(const ReadyRay& ray)
#if HWY_TARGET == HWY_WASM
      : order_(wasm_i32x4_add(
            wasm_i32x4_mul(wasm_v128_load(kVertexOrder[ray.exit[3]]), wasm_i32x4_splat(0x04040404)),
            wasm_i32x4_splat(0x03020100))) {
#else
      : order_(hn::SetTableIndices(Four(), kVertexOrder[ray.exit[3]])) {
#endif
    const Four d;
    for (uint32_t a = 0; a < 3; ++a) origin_[a] = hn::Set(d, ray.origin[a]);
    for (uint32_t a = 0; a < 2; ++a) shear_[a] = hn::Set(d, ray.shear[a]);
  }

  HWY_INLINE Corner corner(const float* const vertices[4]) const {
    const Four d;
    const auto p = row(vertices[0]), q = row(vertices[1]), r = row(vertices[2]), s = row(vertices[3]);
    const auto xy_pq = hn::InterleaveLower(d, p, q), xy_rs = hn::InterleaveLower(d, r, s);
    const auto z_pq = hn::InterleaveUpper(d, p, q), z_rs = hn::InterleaveUpper(d, r, s);
    const auto depth = hn::Sub(hn::ConcatLowerLower(d, z_rs, z_pq), origin_[2]);
    const auto x = hn::Sub(hn::ConcatLowerLower(d, xy_rs, xy_pq), origin_[0]);
    const auto y = hn::Sub(hn::ConcatUpperUpper(d, xy_rs, xy_pq), origin_[1]);
    const auto sheared_x = hn::NegMulAdd(depth, shear_[0], x), sheared_y = hn::NegMulAdd(depth, shear_[1], y);
    return {sheared_x, sheared_y, hn::Add(hn::Abs(sheared_x), hn::Abs(sheared_y))};
  }

  /// The sum of all magnitudes.
  static HWY_INLINE hn::Vec<Four> sum(Sizes a, Sizes b, Sizes c) { return hn::Add(hn::Add(a, b), c); }

 private:
  HWY_INLINE hn::Vec<Four> row(const float* from) const {
#if HWY_TARGET == HWY_WASM  // Highway's version works byte by byte
    return hn::BitCast(Four(), hn::Vec<Ints>{wasm_i8x16_swizzle(wasm_v128_load(from), order_)});
#else
    return hn::TableLookupLanes(hn::LoadU(Four(), from), order_);
#endif
  }
#if HWY_TARGET == HWY_WASM
  v128_t order_;  ///< of bytes
#else
  decltype(hn::SetTableIndices(Four(), kVertexOrder[0])) order_;
#endif
  hn::Vec<Four> origin_[3], shear_[2];
};
#endif

/// On which sides of the edges of four triangles the ray passes.
struct LeafSides {
  uint32_t open;          ///< the line may pass through the triangle: bits by triangle
  uint32_t inside;        ///< it surely does
  hn::Vec<Four> side[3];  ///< by the corner across the edge
  hn::Vec<Four> error;    ///< at most
};

/// For four triangles, given by corner.
HWY_INLINE LeafSides sides_of(const ReadyRay& ray, const float* const vertices[3][4]) {
  const Four d;
  const LeafRay from(ray);
  const Corner a = from.corner(vertices[0]), b = from.corner(vertices[1]), c = from.corner(vertices[2]);
  const hn::Vec<Four> x[3] = {a.x, b.x, c.x}, y[3] = {a.y, b.y, c.y};
  const auto sides = edge_sides(x, y, LeafRay::sum(a.size, b.size, c.size), hn::Set(d, ray.shear[2]),
                                hn::Set(d, ray.shear[3]));
  return {bits_of_mask(Four(), sides.missed) ^ 15,
          bits_of_mask(Four(), sides.inside),
          {sides.side[0], sides.side[1], sides.side[2]},
          sides.error};
}

/// A ray at a node.
struct Visit {
  uint64_t bits;  ///< the node, and from bit 32 on the ray's slot among those in flight

  uint32_t node() const { return uint32_t(bits); }
  uint32_t flight() const { return uint32_t(bits >> 32); }
};

/// Triangles of the node's leaves to test the ray against.
struct MetTriangles {
  Visit visit;
  uint32_t ranks;  ///< within the node's triangles, as bits
  uint32_t last;   ///< the highest of these bits
};

/// Four of them, if the line may pass through some.
struct OpenTriangles {
  alignas(64) float side[3][4];  ///< as in LeafSides
  float error[4];
  Visit visit;
  uint32_t ranks;        ///< of the four, and of the others after them
  uint8_t open, inside;  ///< as in LeafSides
};

enum class Meets { no, yes, perhaps };

/// Where the line passes through a triangle that it surely does pass through: at the mean of the corners'
/// depths, weighted by the sides.
HWY_INLINE Meets meets_within(const ReadyRay& ray, const float* const corners[3], const OpenTriangles& found,
                              uint32_t i) {
  const uint32_t axis = ray.exit[3];
  const float begin = ray.limits[2], end = ray.limits[3], padding = ray.origin[3];
  const float z[3] = {corners[0][axis] - ray.origin[2], corners[1][axis] - ray.origin[2],
                      corners[2][axis] - ray.origin[2]};
  const float least = min_of(min_of(z[0], z[1]), z[2]), most = max_of(max_of(z[0], z[1]), z[2]);
  if (begin <= least && most <= end) return Meets::yes;
  const float u = found.side[0][i], v = found.side[1][i], w = found.side[2][i];
  const float sum = (u + v) + w;
  if (!(magnitude(sum) > 16 * found.error[i])) return Meets::perhaps;
  // Weights first, which are 0 to 1: sides times depths may be too small or too large for a float.
  const float inverse = 1 / sum;
  const float z_mean = ((u * inverse) * z[0] + (v * inverse) * z[1]) + (w * inverse) * z[2];
  const float error = 8 * (found.error[i] * magnitude(inverse)) * (most - least) + padding;
  if (z_mean + error < begin - 2 * padding || end + 2 * padding < z_mean - error) return Meets::no;
  if (begin <= z_mean - error && z_mean + error <= end) return Meets::yes;
  return Meets::perhaps;
}

/// Does one of these triangles block the ray? `number`: its index in the batch.
template <class Holes>
HWY_INLINE bool meets_open(const TrianglesField& field, const Holes& holes, const SegmentBatch& batch,
                           uint32_t number, const ReadyRay& ray, const OpenTriangles& found) {
  const BvhNode& node = field.nodes[found.visit.node()];
  TriangleRay exact;
  bool prepared = false;
  uint32_t ranks = found.ranks, open = found.open;
  for (uint32_t i = 0; open != 0; ++i, open >>= 1, ranks &= ranks - 1) {
    if ((open & 1) == 0) continue;
    const uint32_t triangle = node.first_triangle + lowest_bit(ranks);
    const float* corners[3];
    for (uint32_t k = 0; k < 3; ++k)
      corners[k] = field.vertices[size_t(node.first_vertex) + field.triangles[triangle][k]];
    Meets meets = Meets::perhaps;
    if (found.inside >> i & 1) meets = meets_within(ray, corners, found, i);
    if constexpr (Holes::kAny) {
      if (meets == Meets::yes && holes.patch(triangle) != nullptr) meets = Meets::perhaps;
    }
    if (HWY_UNLIKELY(meets == Meets::perhaps)) {
      TriangleCrossing<double> crossing;
      if (!prepared) prepare_for_triangles(field, segment_of(batch, number), exact);
      prepared = true;
      if (meets_triangle(exact, corners, crossing) && holes(triangle, crossing)) return true;
    }
    if (meets == Meets::yes) return true;
  }
  return false;
}

/// Which of a node's triangles lie in the given leaf slots, as bits.
HWY_INLINE uint32_t ranks_in(const BvhNode& node, uint32_t leaves) {
  const hn::CappedTag<uint32_t, kBvhWidth> d;
  const hn::Rebind<uint8_t, decltype(d)> bytes;
  uint32_t ranks = 0;
  for (uint32_t first = 0; first < kBvhWidth; first += uint32_t(hn::Lanes(d))) {
    const auto slots = hn::PromoteTo(d, hn::LoadU(bytes, node.slots + first));
    const auto one = hn::Set(d, 1u);
    const auto each = hn::Sub(hn::Shl(one, hn::ShiftRight<5>(slots)), one);
    const auto place = hn::Shl(each, hn::And(slots, hn::Set(d, 31u)));
    const auto bit = hn::Shl(one, hn::Iota(d, first));
    const auto chosen = hn::TestBit(hn::Set(d, leaves), bit);
    ranks |= hn::GetLane(hn::SumOfLanes(d, hn::IfThenElseZero(chosen, place)));
  }
  return ranks;
}

/// Tests the first four triangles of `ranks`, or fewer if there are fewer. Returns those that the line may
/// pass through, as bits, and removes the four from `ranks`.
HWY_INLINE uint32_t test_four(const TrianglesField& field, const ReadyRay& ray, const MetTriangles& met,
                              uint32_t& ranks, OpenTriangles& found) {
  const BvhNode& node = field.nodes[met.visit.node()];
  const uint8_t* const indices = field.triangles[node.first_triangle];
  const float* before = reinterpret_cast<const float*>(field.vertices + node.first_vertex) - 1;
  // Otherwise compilers add the node's part of the address again for each vertex.
  asm("" : "+r"(before));
  const uint64_t once = (uint64_t{1} << __builtin_popcount(ranks)) - 1;
  found.ranks = ranks;
  found.visit = met.visit;
  const float* vertices[3][4];
  for (uint32_t i = 0; i < 4; ++i, ranks &= ranks - 1) {
    // If there are fewer than four, the last one is repeated.
    const uint32_t rank = lowest_bit(ranks | met.last);
    const uint8_t* const triangle = indices + 3 * size_t(rank);
    for (uint32_t k = 0; k < 3; ++k) vertices[k][i] = before + 3 * size_t(triangle[k]);
  }
  const LeafSides sides = sides_of(ray, vertices);
  for (uint32_t k = 0; k < 3; ++k) hn::Store(sides.side[k], Four(), found.side[k]);
  hn::Store(sides.error, Four(), found.error);
  const uint32_t open = sides.open & uint32_t(once);
  found.open = uint8_t(open);
  found.inside = uint8_t(sides.inside);
  return open;
}

}  // namespace nif::kernels::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
