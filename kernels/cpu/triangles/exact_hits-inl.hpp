// Candidates: triangles that may be the first that a ray meets. Keeps them by their depths in single precision, then
// finds the first in double precision: one candidate in a lane, with the
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

#include "kernels/cpu/triangles/rays-inl.hpp"
#include "kernels/reference/batch.hpp"
#include "kernels/reference/triangles/triangles_hit.hpp"

HWY_BEFORE_NAMESPACE();
namespace nif::kernels::cpu::HWY_NAMESPACE {

/// A triangle, and its corners in object space.
struct TriangleCorners {
  uint32_t triangle;  ///< of the object
  float corners[3][3];
};

/// By the longest axis of the direction: the axes in the order of TriangleRay.
constexpr uint8_t kAxisOrder[3][3] = {{1, 2, 0}, {2, 0, 1}, {0, 1, 2}};

/// Candidates of several rays; those of a ray follow each other.
struct HitCandidates {
  static constexpr uint32_t kRoom = 256;
  alignas(64) uint32_t rays[kRoom + 16];  ///< numbers in the batch
  uint32_t triangles[kRoom + 16];
  uint32_t axes[kRoom + 16];        ///< the longest of the ray's direction
  float extents[kRoom + 16];        ///< of the fields that the rays ask
  float corners[3][3][kRoom + 16];  ///< by corner and axis, in the order of TriangleRay
  uint32_t count;

  bool has_room(uint32_t more) const { return count + more <= kRoom; }
  /// Requires room.
  HWY_INLINE void add(uint32_t ray, uint32_t axis, float extent, const DecodedLeaf& leaf, uint32_t lane) {
    rays[count] = ray;
    extents[count] = extent;
    triangles[count] = leaf.triangles[lane];
    axes[count] = axis;
    const uint8_t* const order = kAxisOrder[axis];
    for (uint32_t i = 0; i < 3; ++i)
      for (uint32_t k = 0; k < 3; ++k) corners[k][i][count] = leaf.corners[k][order[i]][lane];
    ++count;
  }
  /// Fills the lanes after the last candidate, for vectors that are read whole. Requires one.
  void repeat_last(uint32_t more) {
    for (uint32_t i = count; i < count + more; ++i) {
      rays[i] = rays[count - 1];
      axes[i] = axes[count - 1];
      extents[i] = extents[count - 1];
    }
  }
};

/// What the reference finds about triangles, one in a lane.
template <class V>
struct ExactTest {
  hn::Mask<hn::DFromV<V>> met;    ///< by the ray
  hn::Mask<hn::DFromV<V>> close;  ///< the reference must decide
  V t, second, third;             ///< where it is met, the latter as the weights of these corners
};

/// As meets_triangle(), which leaves triangles that appear narrow, or that are passed beside, to passes_close(): of these
/// only what needs no correction. `x`, `y`, `z`: the corners, sheared. The others are as in TriangleRay.
template <class V>
HWY_INLINE ExactTest<V> test_exactly(const V (&x)[3], const V (&y)[3], const V (&z)[3], V error, V length,
                                     V tmin, V tmax) {
  const hn::DFromV<V> d;
  const V side[3] = {hn::Sub(hn::Mul(x[2], y[1]), hn::Mul(y[2], x[1])),
                     hn::Sub(hn::Mul(x[0], y[2]), hn::Mul(y[0], x[2])),
                     hn::Sub(hn::Mul(x[1], y[0]), hn::Mul(y[1], x[0]))};
  const auto least = [&](const V* v) HWY_ATTR { return hn::Min(hn::Min(v[0], v[1]), v[2]); };
  const auto most = [&](const V* v) HWY_ATTR { return hn::Max(hn::Max(v[0], v[1]), v[2]); };
  const V lowest = least(side), highest = most(side), apart = hn::Min(hn::Neg(lowest), highest);
  const V width = hn::Sub(most(x), least(x)), height = hn::Sub(most(y), least(y)),
          larger = hn::Max(height, width);
  const auto surely = hn::Gt(apart, hn::Mul(hn::Mul(hn::Set(d, kSurelyApart<double>), error), error));
  const auto enough =
      hn::Gt(apart, hn::Mul(hn::Mul(hn::Set(d, 4.0), error),
                            hn::Add(hn::Add(width, height), hn::Mul(hn::Set(d, 8.0), error))));
  const auto missed = hn::Or(surely, enough);
  const V sum = hn::Add(hn::Add(side[0], side[1]), side[2]);
  const auto narrow = hn::Lt(hn::Abs(sum), hn::Mul(hn::Mul(hn::Set(d, double{kEdgeOn}), larger), larger));
  const auto sum_of = [&](const V* by, const V* v, V first) HWY_ATTR {
    return hn::Add(hn::Add(first, hn::Mul(by[1], v[1])), hn::Mul(by[2], v[2]));
  };
  const V second = hn::Div(side[1], sum), third = hn::Div(side[2], sum);
  auto close = hn::Gt(apart, hn::Zero(d));  // passed beside
  V depth = hn::Div(sum_of(side, z, hn::Mul(side[0], z[0])), sum);
  if (HWY_UNLIKELY(!hn::AllFalse(d, narrow))) {
    const V weights[3] = {hn::Div(side[0], sum), second, third};
    const auto mean = [&](const V* v) HWY_ATTR {
      return sum_of(weights, v, hn::Add(hn::Zero(d), hn::Mul(weights[0], v[0])));  // -0 becomes 0
    };
    const auto off = hn::Max(hn::Abs(mean(x)), hn::Abs(mean(y)));
    const auto near = hn::Le(off, hn::Mul(hn::Set(d, double{kPointNear}), error));
    close = hn::Or(close, hn::AndNot(near, narrow));
    depth = hn::IfThenElse(narrow, mean(z), depth);
  }
  close = hn::AndNot(missed, close);
  const V t = hn::Div(depth, length);
  const auto in_range = hn::And(hn::Le(tmin, t), hn::Le(t, tmax));
  const auto met = hn::And(in_range, hn::AndNot(hn::Or(missed, close), hn::Ne(sum, hn::Zero(d))));
  return {met, close, t, second, third};
}

/// What is known of a candidate in each lane.
struct CandidateHits {
  alignas(64) double t[kDoubles];
  alignas(64) float hit_t[kDoubles], u[kDoubles], v[kDoubles];  ///< as in Hit
  alignas(64) float normal[3][kDoubles];
  uint32_t met, close;  ///< lanes as bits; close: the reference must decide
  bool in_order;        ///< the candidates are of rays that follow each other, as neighbouring pixels do
};

HWY_NOINLINE inline void test_candidates(const SegmentBatch& batch, const HitCandidates& candidates,
                                         uint32_t first, CandidateHits& hits) {
  const Doubles d;
  const FewFloats df;
  const FewInts di;
  using D = hn::Vec<Doubles>;
  const auto wide = [&](auto v) HWY_ATTR { return hn::PromoteTo(d, v); };
  const auto words = [&](const uint32_t* column)
                         HWY_ATTR { return hn::LoadU(di, reinterpret_cast<const int32_t*>(column + first)); };
  const auto ray = words(candidates.rays);
  const uint32_t first_ray = candidates.rays[first];
  hits.in_order = hn::AllTrue(di, hn::Eq(ray, hn::Iota(di, int32_t(first_ray))));
  const auto of_batch = [&](const float* column) HWY_ATTR {
    return hits.in_order ? hn::LoadU(df, column + first_ray) : gather(df, column, ray);
  };
  // As in prepare_for_triangles().
  const auto axis_z = words(candidates.axes), zero = hn::Zero(di), one = hn::Set(di, 1), two = hn::Set(di, 2);
  const auto next = [&](auto axis)
                        HWY_ATTR { return hn::IfThenElse(hn::Eq(axis, two), zero, hn::Add(axis, one)); };
  const auto axis_x = next(axis_z), axis_y = next(axis_x);
  const decltype(ray) axis[3] = {axis_x, axis_y, axis_z};
  const uint32_t first_axis = candidates.axes[first];
  const bool in_rows = hits.in_order && hn::AllTrue(di, hn::Eq(axis_z, hn::Set(di, int32_t(first_axis))));
  D origin[3], direction[3];
  auto far = hn::LoadU(df, candidates.extents + first);
  for (uint32_t i = 0; i < 3; ++i) {
    auto start = hn::Zero(df), along = start;
    if (in_rows) {
      const uint32_t row = kAxisOrder[first_axis][i];
      start = hn::LoadU(df, batch.origin[row] + first_ray);
      along = hn::LoadU(df, batch.direction[row] + first_ray);
    } else {
      const auto at = hn::Add(hn::Mul(axis[i], hn::Set(di, int32_t(kBatchRoom))), ray);
      start = gather(df, batch.origin[0], at);
      along = gather(df, batch.direction[0], at);
    }
    far = hn::Max(hn::Abs(start), far);
    origin[i] = wide(start);
    direction[i] = wide(along);
  }
  const D length = direction[2];
  const D shear_x = hn::Div(direction[0], length), shear_y = hn::Div(direction[1], length);
  const D error = hn::Mul(wide(far), hn::Set(d, kShearError<double>));
  D corner[3][3], x[3], y[3], z[3];
  for (uint32_t k = 0; k < 3; ++k) {
    for (uint32_t i = 0; i < 3; ++i) corner[k][i] = wide(hn::LoadU(df, candidates.corners[k][i] + first));
    z[k] = hn::Sub(corner[k][2], origin[2]);
    x[k] = hn::Sub(hn::Sub(corner[k][0], origin[0]), hn::Mul(shear_x, z[k]));
    y[k] = hn::Sub(hn::Sub(corner[k][1], origin[1]), hn::Mul(shear_y, z[k]));
  }

  const ExactTest<D> test =
      test_exactly(x, y, z, error, length, wide(of_batch(batch.tmin)), wide(of_batch(batch.tmax)));
  hits.close = bits_of_mask(d, test.close);
  hits.met = bits_of_mask(d, test.met);
  hn::Store(test.t, d, hits.t);

  // As in hit_at(). The normal's components have the order of `axis`, which is cyclic.
  const auto store = [&](D v, float* to) HWY_ATTR { hn::Store(hn::DemoteTo(df, v), df, to); };
  store(test.t, hits.hit_t);
  store(test.second, hits.u);
  store(test.third, hits.v);
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
    const D of_first = normal[(a + 2) % 3], of_second = normal[(a + 1) % 3], of_third = normal[a];
    const D own = hn::IfThenElse(third_d, of_third, hn::IfThenElse(second_d, of_second, of_first));
    store(hn::IfThenElseZero(has_normal, hn::Div(own, largest)), hits.normal[a]);
  }
}

/// A candidate as the reference decides about it. Returns false if it is not met.
HWY_NOINLINE inline bool hit_by_reference(const SegmentBatch& batch, const HitCandidates& candidates,
                                          uint32_t i, bool certain, double& t, Hit& hit) {
  float corners[3][3];
  for (uint32_t k = 0; k < 3; ++k)
    for (uint32_t a = 0; a < 3; ++a)
      corners[k][kAxisOrder[candidates.axes[i]][a]] = candidates.corners[k][a][i];
  const float* const vertices[3] = {corners[0], corners[1], corners[2]};
  TriangleRay exact;
  TriangleCrossing<double> crossing;
  prepare_for_triangles({.extent = candidates.extents[i]}, segment_of(batch, candidates.rays[i]), exact);
  if (!meets_triangle(exact, vertices, crossing)) return false;
  t = crossing.t;
  hit = hit_at(crossing, candidates.triangles[i], vertices, certain);
  return true;
}

/// Writes those of `lanes`, as set_hit() does. The candidates are in order.
HWY_INLINE void set_hits(const CandidateHits& found, uint32_t lanes, const AnswerBatch& answers,
                         const HitCandidates& candidates, uint32_t first, HitBatch& hits) {
  const FewFloats df;
  const FewInts di;
  const uint32_t ray = candidates.rays[first];
  const auto chosen = mask_of_few(lanes);
  const auto put = [&](hn::Vec<FewFloats> of, float* column)
                       HWY_ATTR { hn::BlendedStore(of, chosen, df, column + ray); };
  const auto t = hn::Load(df, found.hit_t);
  const auto certain = hn::RebindMask(
      df, hn::Ne(hn::PromoteTo(di, hn::LoadU(hn::Rebind<uint8_t, Doubles>(), answers.certain + ray)),
                 hn::Zero(di)));
  put(t, hits.t);
  put(hn::IfThenElse(certain, t, hn::Set(df, -kNoHit)), hits.low);
  put(hn::IfThenElse(certain, t, hn::Set(df, kNoHit)), hits.high);
  put(hn::Load(df, found.u), hits.u);
  put(hn::Load(df, found.v), hits.v);
  for (uint32_t a = 0; a < 3; ++a) put(hn::Load(df, found.normal[a]), hits.normal[a]);
  hn::BlendedStore(hn::LoadU(di, reinterpret_cast<const int32_t*>(candidates.triangles + first)),
                   hn::RebindMask(di, chosen), di, reinterpret_cast<int32_t*>(hits.triangle + ray));
}

/// Writes the first hit of each ray that has candidates, and forgets them.
HWY_NOINLINE inline void finish_hits(const SegmentBatch& batch, const AnswerBatch& answers,
                                     HitCandidates& candidates, HitBatch& hits) {
  const uint32_t count = candidates.count;
  if (count == 0) return;
  candidates.repeat_last(kDoubles - 1);
  candidates.count = 0;
  uint32_t last_ray = kBatchRays;
  double nearest = 0;
  for (uint32_t first = 0; first < count; first += kDoubles) {
    CandidateHits found;
    test_candidates(batch, candidates, first, found);
    uint32_t present = count - first < kDoubles ? (1u << (count - first)) - 1 : (1u << kDoubles) - 1;
    present &= found.met | found.close;
    if (found.in_order && found.close == 0 && candidates.rays[first] != last_ray) {
      set_hits(found, present, answers, candidates, first, hits);
      constexpr uint32_t kLast = kDoubles - 1;
      if ((present >> kLast & 1) != 0) last_ray = candidates.rays[first + kLast], nearest = found.t[kLast];
      continue;
    }
    for (; present != 0; present &= present - 1) {
      const uint32_t lane = lowest_bit(present), i = first + lane, ray = candidates.rays[i];
      const bool certain = answers.certain[ray] != 0;
      double t = found.t[lane];
      Hit hit;
      if (HWY_UNLIKELY((found.close >> lane & 1) != 0)) {
        if (!hit_by_reference(batch, candidates, i, certain, t, hit)) continue;
      } else {
        hit.t = found.hit_t[lane];
        if (certain) hit.low = hit.high = hit.t;
        for (uint32_t a = 0; a < 3; ++a) hit.normal[a] = found.normal[a][lane];
        hit.triangle = candidates.triangles[i];
        hit.u = found.u[lane];
        hit.v = found.v[lane];
      }
      if (ray == last_ray && !(t < nearest || (t == nearest && hit.triangle < hits.triangle[ray]))) continue;
      last_ray = ray;
      nearest = t;
      set_hit(hits, ray, hit);
    }
  }
}

/// A ray's triangles that may be the first that it meets. Place: what tells a traversal where a triangle is.
template <class Place>
struct RayCandidates {
  static constexpr uint32_t kMost = 8;
  float low[kMost];  ///< depths in the direction of the ray, at least
  Place places[kMost];
  uint32_t count;
  float bound;  ///< the first hit is at this depth or before

  HWY_INLINE void clear() {
    count = 0;
    bound = kNoHit;
  }
  /// Requires room.
  HWY_INLINE void add(float at_least, Place place) {
    low[count] = at_least;
    places[count++] = place;
  }
  /// Drops candidates behind the bound. Returns false if none is: there is no room.
  bool make_room() {
    uint32_t kept = 0;
    for (uint32_t k = 0; k < count; ++k) {
      low[kept] = low[k];
      places[kept] = places[k];
      kept += low[k] <= bound;
    }
    count = kept;
    return count < kMost;
  }
};

/// Keeps only the first that the ray meets. Corners: corners(place) tells a TriangleCorners.
template <class Place, class Corners>
HWY_NOINLINE void keep_first(const TrianglesField& field, const Segment& segment, const Corners& corners,
                             RayCandidates<Place>& candidates) {
  TriangleRay exact;
  prepare_for_triangles(field, segment, exact);
  NearestTriangle nearest;
  uint32_t first = 0;
  for (uint32_t k = 0; k < candidates.count; ++k) {
    const TriangleCorners triangle = corners(candidates.places[k]);
    const float* const vertices[3] = {triangle.corners[0], triangle.corners[1], triangle.corners[2]};
    TriangleCrossing<double> crossing;
    if (!meets_triangle(exact, vertices, crossing) || !nearest.is_beaten_by(crossing.t, triangle.triangle))
      continue;
    nearest.crossing = crossing;
    nearest.triangle = triangle.triangle;
    first = k;
  }
  candidates.count = nearest.triangle != kNoTriangle;
  candidates.low[0] = candidates.low[first];
  candidates.places[0] = candidates.places[first];
}

/// Boxes that the ray enters after this depth hold no first hit.
HWY_INLINE void shorten(ReadyRay& ray, float depth) {
  // Boxes count t in units in which the direction's longest component is 1 to 2.
  const float t = next_above(next_above(depth * magnitude(ray.inverse[ray.exit[3]])));
  ray.limits[1] = min_of(t, ray.limits[1]);
}

}  // namespace nif::kernels::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
