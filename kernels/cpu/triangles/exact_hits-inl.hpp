// Finds which of a ray's candidates is the first that it meets, in double precision: one candidate in a lane, with the
// reference's operations in the reference's order, so that all bits are the same. What the reference tests closely
// (passes_close()) is left to it.
//
// Compiled once for each target.
#if defined(NIF_BVH_EXACT_HITS_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef NIF_BVH_EXACT_HITS_INL
#undef NIF_BVH_EXACT_HITS_INL
#else
#define NIF_BVH_EXACT_HITS_INL
#endif

#include <hwy/highway.h>

#include "kernels/cpu/lanes-inl.hpp"
#include "kernels/cpu/triangles/decoded_tree.hpp"
#include "kernels/reference/batch.hpp"
#include "kernels/reference/triangles/triangles_hit.hpp"

HWY_BEFORE_NAMESPACE();
namespace nif::kernels::cpu::HWY_NAMESPACE {

/// Triangles that may be the first that a ray meets.
constexpr uint32_t kCandidates = 8;

/// Candidates of many rays; those of a ray follow each other.
struct HitCandidates {
  static constexpr uint32_t kRoom = kBatchRays;
  alignas(64) uint32_t rays[kRoom + 16];
  uint32_t places[kRoom + 16];  ///< leaf times kBvhLeafTriangles, plus the place within the leaf
  uint32_t count;

  bool is_full() const { return count > kRoom - kCandidates; }
  HWY_INLINE void add(uint32_t ray, uint32_t place) {
    rays[count] = ray;
    places[count++] = place;
  }
};

/// The corners of a triangle.
struct LeafCorners {
  float corners[3][3];
  const float* vertices[3] = {corners[0], corners[1], corners[2]};

  LeafCorners(const DecodedLeaf& leaf, uint32_t i) {
    for (uint32_t k = 0; k < 3; ++k)
      for (uint32_t a = 0; a < 3; ++a) corners[k][a] = leaf.corners[k][a][i];
  }
  LeafCorners(const LeafCorners&) = delete;
  LeafCorners& operator=(const LeafCorners&) = delete;
};

/// In a vector.
using Doubles = hn::CappedTag<double, 8>;
constexpr uint32_t kDoubles = uint32_t(hn::MaxLanes(Doubles()));

/// What is known of as many candidates as there are lanes.
struct CandidateHits {
  alignas(64) double t[kDoubles];
  alignas(64) float hit_t[kDoubles], u[kDoubles], v[kDoubles];  ///< as in Hit
  alignas(64) float normal[3][kDoubles];
  uint32_t met, close;  ///< lanes as bits; close: the reference must decide
};

HWY_NOINLINE inline void test_candidates(const TrianglesField& field, const DecodedLeaf* leaves,
                                         const SegmentBatch& batch, const uint32_t* rays,
                                         const uint32_t* places, CandidateHits& hits) {
  const Doubles d;
  const hn::Rebind<float, Doubles> df;
  const hn::Rebind<int32_t, Doubles> di;
  using D = hn::Vec<Doubles>;
  const auto wide = [&](auto v) HWY_ATTR { return hn::PromoteTo(d, v); };
  const auto ray = hn::LoadU(di, reinterpret_cast<const int32_t*>(rays));
  const auto place = hn::LoadU(di, reinterpret_cast<const int32_t*>(places));
  const auto of_batch = [&](const float* column) HWY_ATTR { return hn::GatherIndex(df, column, ray); };
  // As in prepare_for_triangles().
  const auto size0 = hn::Abs(of_batch(batch.direction[0])), size1 = hn::Abs(of_batch(batch.direction[1]));
  const auto size2 = hn::Abs(of_batch(batch.direction[2]));
  const auto second = hn::Gt(size1, size0), third = hn::Gt(size2, hn::Max(size0, size1));
  const auto zero = hn::Zero(di), one = hn::Set(di, 1), two = hn::Set(di, 2);
  const auto axis_z =
      hn::IfThenElse(hn::RebindMask(di, third), two, hn::IfThenElse(hn::RebindMask(di, second), one, zero));
  const auto next = [&](auto axis)
                        HWY_ATTR { return hn::IfThenElse(hn::Eq(axis, two), zero, hn::Add(axis, one)); };
  const auto axis_x = next(axis_z), axis_y = next(axis_x);
  const decltype(ray) axis[3] = {axis_x, axis_y, axis_z};
  D origin[3], direction[3];
  auto far = hn::Set(df, field.extent);
  for (uint32_t i = 0; i < 3; ++i) {
    const auto at = hn::Add(hn::Mul(axis[i], hn::Set(di, int32_t(kBatchRoom))), ray);
    const auto start = hn::GatherIndex(df, batch.origin[0], at);
    far = hn::Max(hn::Abs(start), far);
    origin[i] = wide(start);
    direction[i] = wide(hn::GatherIndex(df, batch.direction[0], at));
  }
  const D length = direction[2];
  const D shear_x = hn::Div(direction[0], length), shear_y = hn::Div(direction[1], length);
  const D error = hn::Mul(wide(far), hn::Set(d, kShearError<double>));
  D corner[3][3], x[3], y[3], z[3];
  constexpr int32_t kWords = sizeof(DecodedLeaf) / sizeof(float);
  const auto leaf = hn::Add(hn::Mul(hn::ShiftRight<2>(place), hn::Set(di, kWords)),
                            hn::And(place, hn::Set(di, int32_t(kBvhLeafTriangles - 1))));
  for (uint32_t k = 0; k < 3; ++k) {
    for (uint32_t i = 0; i < 3; ++i) {
      const auto at = hn::Add(hn::Add(leaf, hn::ShiftLeft<2>(axis[i])), hn::Set(di, int32_t(k * 12)));
      corner[k][i] = wide(hn::GatherIndex(df, leaves->corners[0][0], at));
    }
    z[k] = hn::Sub(corner[k][2], origin[2]);
    x[k] = hn::Sub(hn::Sub(corner[k][0], origin[0]), hn::Mul(shear_x, z[k]));
    y[k] = hn::Sub(hn::Sub(corner[k][1], origin[1]), hn::Mul(shear_y, z[k]));
  }

  // As in meets_triangle().
  const D side[3] = {hn::Sub(hn::Mul(x[2], y[1]), hn::Mul(y[2], x[1])),
                     hn::Sub(hn::Mul(x[0], y[2]), hn::Mul(y[0], x[2])),
                     hn::Sub(hn::Mul(x[1], y[0]), hn::Mul(y[1], x[0]))};
  const auto least = [&](const D* v) HWY_ATTR { return hn::Min(hn::Min(v[0], v[1]), v[2]); };
  const auto most = [&](const D* v) HWY_ATTR { return hn::Max(hn::Max(v[0], v[1]), v[2]); };
  const D apart = hn::Min(hn::Neg(least(side)), most(side));
  const D width = hn::Sub(most(x), least(x)), height = hn::Sub(most(y), least(y)),
          larger = hn::Max(height, width);
  const auto surely = hn::Gt(apart, hn::Mul(hn::Mul(hn::Set(d, kSurelyApart<double>), error), error));
  const auto enough =
      hn::Gt(apart, hn::Mul(hn::Mul(hn::Set(d, 4.0), error),
                            hn::Add(hn::Add(width, height), hn::Mul(hn::Set(d, 8.0), error))));
  const D sum = hn::Add(hn::Add(side[0], side[1]), side[2]);
  const auto edge_on = hn::Lt(hn::Abs(sum), hn::Mul(hn::Mul(hn::Set(d, double{kEdgeOn}), larger), larger));
  const auto close = hn::Or(hn::Gt(apart, hn::Zero(d)), edge_on);
  const D depth =
      hn::Div(hn::Add(hn::Add(hn::Mul(side[0], z[0]), hn::Mul(side[1], z[1])), hn::Mul(side[2], z[2])), sum);
  const D t = hn::Div(depth, length);
  const auto in_range = hn::And(hn::Le(wide(of_batch(batch.tmin)), t), hn::Le(t, wide(of_batch(batch.tmax))));
  const auto bits = [&](auto mask) HWY_ATTR {
    uint8_t bytes[8] = {};
    hn::StoreMaskBits(d, mask, bytes);
    return uint32_t(bytes[0]);
  };
  const uint32_t missed = bits(hn::Or(surely, enough));
  hits.close = bits(close) & ~missed;
  hits.met = bits(hn::And(in_range, hn::Ne(sum, hn::Zero(d)))) & ~(missed | hits.close);
  hn::Store(t, d, hits.t);

  // As in hit_at(). The normal's components have the order of `axis`, which is cyclic.
  const auto store = [&](D v, float* to) HWY_ATTR { hn::Store(hn::DemoteTo(df, v), df, to); };
  store(t, hits.hit_t);
  store(hn::Div(side[1], sum), hits.u);
  store(hn::Div(side[2], sum), hits.v);
  D normal[3], largest = hn::Zero(d);
  for (uint32_t i = 0; i < 3; ++i) {
    const uint32_t j = (i + 1) % 3, k = (i + 2) % 3;
    const auto edge = [&](uint32_t e, uint32_t a) HWY_ATTR { return hn::Sub(corner[e][a], corner[0][a]); };
    normal[i] = hn::Sub(hn::Mul(edge(1, j), edge(2, k)), hn::Mul(edge(1, k), edge(2, j)));
    largest = hn::Max(hn::Abs(normal[i]), largest);
  }
  const auto has_normal = hn::Gt(largest, hn::Zero(d));
  // Back in the order of axes.
  const auto second_d = hn::RebindMask(d, hn::Eq(wide(axis_z), hn::Set(d, 1.0)));
  const auto third_d = hn::RebindMask(d, hn::Eq(wide(axis_z), hn::Set(d, 2.0)));
  for (uint32_t a = 0; a < 3; ++a) {
    // The longest axis is 0: x comes second in the order (1, 2, 0), and so on.
    const D first = normal[(a + 2) % 3], of_second = normal[(a + 1) % 3], of_third = normal[a];
    const D own = hn::IfThenElse(third_d, of_third, hn::IfThenElse(second_d, of_second, first));
    store(hn::IfThenElseZero(has_normal, hn::Div(own, largest)), hits.normal[a]);
  }
}

/// Writes the first hit of each ray that has candidates, and forgets them.
HWY_NOINLINE inline void finish_hits(const TrianglesField& field, const DecodedLeaf* leaves,
                                     const SegmentBatch& batch, const AnswerBatch& answers,
                                     HitCandidates& candidates, HitBatch& hits) {
  const uint32_t count = candidates.count;
  candidates.count = 0;
  // Lanes after the last repeat one.
  for (uint32_t i = count; i < count + kDoubles; ++i) {
    candidates.rays[i] = count == 0 ? 0 : candidates.rays[0];
    candidates.places[i] = count == 0 ? 0 : candidates.places[0];
  }
  uint32_t last_ray = kBatchRays;
  double nearest = 0;
  for (uint32_t first = 0; first < count; first += kDoubles) {
    CandidateHits found;
    test_candidates(field, leaves, batch, candidates.rays + first, candidates.places + first, found);
    uint32_t present = count - first < kDoubles ? (1u << (count - first)) - 1 : (1u << kDoubles) - 1;
    for (present &= found.met | found.close; present != 0; present &= present - 1) {
      const uint32_t lane = lowest_bit(present);
      const uint32_t ray = candidates.rays[first + lane], place = candidates.places[first + lane];
      const DecodedLeaf& leaf = leaves[place / kBvhLeafTriangles];
      const uint32_t triangle = leaf.triangles[place % kBvhLeafTriangles];
      const bool certain = answers.certain[ray] != 0;
      double t = found.t[lane];
      Hit hit;
      if (HWY_UNLIKELY((found.close >> lane & 1) != 0)) {
        const LeafCorners corners(leaf, place % kBvhLeafTriangles);
        TriangleRay exact;
        TriangleCrossing<double> crossing;
        prepare_for_triangles(field, segment_of(batch, ray), exact);
        if (!meets_triangle(exact, corners.vertices, crossing)) continue;
        t = crossing.t;
        hit = hit_at(crossing, triangle, corners.vertices, certain);
      } else {
        hit.t = found.hit_t[lane];
        if (certain) hit.low = hit.high = hit.t;
        for (uint32_t a = 0; a < 3; ++a) hit.normal[a] = found.normal[a][lane];
        hit.triangle = triangle;
        hit.u = found.u[lane];
        hit.v = found.v[lane];
      }
      if (ray == last_ray && !(t < nearest || (t == nearest && triangle < hits.triangle[ray]))) continue;
      last_ray = ray;
      nearest = t;
      set_hit(hits, ray, hit);
    }
  }
}

}  // namespace nif::kernels::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
