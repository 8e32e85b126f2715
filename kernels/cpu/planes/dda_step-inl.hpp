// A step of the DDA traversal: where rays leave the cubes that they are in, and in which finest cells they
// are then.
//
// A step goes to the end of the cube, or of the box around the voxel: to the crossing (t, axis) at which the
// segment leaves it. The crossings of the other axes then give the finest cell along each of them, counted in
// the reference's order (t, then the lower axis). An estimate from below that is at most one cell too low is
// corrected by one such comparison.
//
// Compiled once for each target, so the include guard toggles.
#if defined(NIF_PLANES_DDA_STEP_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef NIF_PLANES_DDA_STEP_INL
#undef NIF_PLANES_DDA_STEP_INL
#else
#define NIF_PLANES_DDA_STEP_INL
#endif

#include "kernels/cpu/planes/lane_grid-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace nif::kernels::cpu::HWY_NAMESPACE {

/// The far planes of cubes along an axis, moved to the ends of their boxes.
template <uint32_t kAxis>
HWY_INLINE hn::Vec<Floats> extended(hn::Vec<Ints> reach, hn::Vec<Floats> plane, float voxel_size) {
  constexpr uint32_t kShift = 8 + 8 * kAxis;
  const Floats d;
  const auto voxels = hn::And(reach, hn::Set(Ints(), 15 << kShift));
  const float cells = voxel_size * (1 / static_cast<float>(1u << kShift));
  return hn::MulAdd(hn::ConvertTo(d, voxels), hn::Set(d, cells), plane);  // exact
}

/// The cubes that rays are in, and where they leave them.
struct Exits {
  hn::Vec<Floats> low[3];   ///< the first finest cell of the cube
  hn::Vec<Floats> t[3];     ///< at which the ray crosses the far plane along each axis
  hn::Vec<Floats> nearest;  ///< the least of those

  /// For cubes of the given size; boxes reach beyond voxels and bricks (LaneGrid::reach_of()).
  HWY_INLINE Exits(const LaneRays& rays, hn::Vec<Floats> size, hn::Vec<Ints> reach, float voxel_size) {
    // Of a power of two.
    const auto inverse_size = floats(hn::Sub(hn::Set(Ints(), 0x7f000000), ints(size)));
    for (uint32_t a = 0; a < 3; ++a) {
      low[a] = hn::Mul(hn::Floor(hn::Mul(rays.cell[a], inverse_size)), size);
      const auto high = hn::Add(low[a], size);
      const auto plane = a == 0   ? extended<0>(reach, high, voxel_size)
                         : a == 1 ? extended<1>(reach, high, voxel_size)
                                  : extended<2>(reach, high, voxel_size);
      t[a] = hn::Mul(hn::Sub(plane, rays.origin[a]), rays.inverse[a]);
    }
    nearest = hn::Min(hn::Min(t[0], t[1]), t[2]);
  }
};

/// The cell along one axis of a ray that has crossed all planes up to `t`, which is its crossing of another
/// axis, or of a lower axis if `later`.
HWY_INLINE hn::Vec<Floats> cell_at(hn::Vec<Floats> t, hn::Mask<Floats> later, const LaneRays& rays,
                                   uint32_t axis) {
  const Floats d;
  const auto reached = hn::MulAdd(t, rays.direction[axis], rays.origin[axis]);
  const auto estimate = hn::Floor(hn::Sub(reached, hn::Set(d, kEstimateSlack)));
  const auto before = hn::Max(estimate, rays.cell[axis]);
  const auto plane = hn::Add(before, hn::Set(d, 1.0f));
  const auto crossing = hn::Mul(hn::Sub(plane, rays.origin[axis]), rays.inverse[axis]);
  // In the reference's order the crossing of a lower axis at the same t comes first.
  const auto crossed = hn::AndNot(hn::And(later, hn::Eq(crossing, t)), hn::Le(crossing, t));
  return hn::IfThenElse(crossed, plane, before);
}

/// The cells of rays after `nearest`, the least of their exits.
struct NextCells {
  hn::Vec<Floats> cell[3];

  HWY_INLINE NextCells(const LaneRays& rays, const hn::Vec<Floats> (&exits)[3], hn::Vec<Floats> nearest) {
    auto later = hn::FirstN(Floats(), 0);
    for (uint32_t a = 0; a < 3; ++a) {
      cell[a] = cell_at(nearest, later, rays, a);
      later = hn::Or(later, hn::Eq(exits[a], nearest));
    }
  }
};

}  // namespace nif::kernels::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
