// Sets up a vector of rays of a batch for traversal: transforms them to grid space, mirrors them, and clips
// them to the grid.
//
// Compiled once for each target, so the include guard toggles.
#if defined(NIF_PLANES_RAY_SETUP_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef NIF_PLANES_RAY_SETUP_INL
#undef NIF_PLANES_RAY_SETUP_INL
#else
#define NIF_PLANES_RAY_SETUP_INL
#endif

#include "kernels/cpu/planes/ray_lanes-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace nif::kernels::cpu::HWY_NAMESPACE {

/// kInOrder: as for the traversal's log.
template <bool kInOrder>
struct RaySetup {
  LaneRays rays;             ///< without their words
  hn::Vec<Ints> flags;       ///< RayFlags
  hn::Mask<Floats> present;  ///< lanes with a ray
  hn::Mask<Floats> easy;     ///< lanes with a ray that is not left to the reference
  hn::Mask<Floats> meets;    ///< lanes with a ray that meets the grid

  /// Of the batch's rays from `first` on.
  HWY_INLINE RaySetup(const PlanesField& field, const SegmentBatch& batch, uint32_t first) {
    transform(field, batch, first);
    clip(first);
    enter();
  }

 private:
  /// To grid space; finds hard rays and axes without movement.
  HWY_INLINE void transform(const PlanesField& field, const SegmentBatch& batch, uint32_t first) {
    const Floats d;
    rays.now = hn::Load(d, batch.tmin + first);
    rays.leave = hn::Load(d, batch.tmax + first);
    present = hn::FirstN(d, batch.count - first);
    const auto scale = hn::Set(d, field.cells_per_unit);
    // Everything that is not finite, or far away, fails one of these.
    easy = hn::And(present, hn::Le(rays.now, rays.leave));
    auto steepest = hn::Zero(d), steepest_outside = hn::Zero(d);
    for (uint32_t a = 0; a < 3; ++a) {
      rays.origin[a] =
          hn::Mul(hn::Sub(hn::Load(d, batch.origin[a] + first), hn::Set(d, field.origin[a])), scale);
      const auto outside = hn::Load(d, batch.direction[a] + first);
      rays.direction[a] = hn::Mul(outside, scale);
      steepest_outside = hn::Max(steepest_outside, hn::Abs(outside));
      easy = hn::And(easy, hn::Le(hn::Abs(rays.origin[a]), hn::Set(d, kCertainReach)));
      easy = hn::And(easy, hn::Le(hn::Abs(rays.direction[a]), hn::Set(d, kMaxDirection)));
      steepest = hn::Max(steepest, hn::Abs(rays.direction[a]));
    }
    easy = hn::And(easy, hn::Ge(hn::Min(steepest, steepest_outside), hn::Set(d, kMinDirection)));
    // In object space, too, because other parts of an object compute there.
    easy = hn::And(easy, hn::Le(steepest_outside, hn::Set(d, kMaxDirection)));

    const auto flat_limit = hn::Mul(steepest, hn::Set(d, kFlatDirection));
    for (uint32_t a = 0; a < 3; ++a) {
      sizes[a] = hn::Set(d, float(field.voxels[a] << field.levels));
      flat[a] = hn::Lt(hn::Abs(rays.direction[a]), flat_limit);
      // Crossings along an axis without movement become infinite, except if the origin lies on the grid's far
      // face: the ray must not meet a plane there.
      easy = hn::AndNot(hn::And(flat[a], hn::Eq(rays.origin[a], sizes[a])), easy);
    }
  }

  /// Mirrors rays and clips them to the grid.
  HWY_INLINE void clip(uint32_t first) {
    const Floats d;
    const Ints di;
    const auto zero = hn::Zero(d), one = hn::Set(d, 1.0f);
    meets = easy;
    flags = hn::Zero(di);
    rays.info = hn::ShiftLeft<kRayShift>(hn::Iota(di, int32_t(first)));
    for (uint32_t a = 0; a < 3; ++a) {
      auto &origin = rays.origin[a], &direction = rays.direction[a], &inverse = rays.inverse[a];
      const auto beside = hn::And(flat[a], hn::Or(hn::Lt(origin, zero), hn::Gt(origin, sizes[a])));
      meets = hn::AndNot(beside, meets);
      negative[a] = hn::AndNot(flat[a], hn::Lt(direction, zero));
      origin = hn::IfThenElse(negative[a], hn::Neg(origin), origin);
      direction = hn::IfThenZeroElse(flat[a], hn::Abs(direction));
      inverse = hn::Div(one, direction);
      const auto low = hn::IfThenElseZero(negative[a], hn::Neg(sizes[a]));
      const auto high = hn::IfThenZeroElse(negative[a], sizes[a]);
      const auto enters = hn::Mul(hn::Sub(low, origin), inverse);
      const auto leaves = hn::Mul(hn::Sub(high, origin), inverse);
      const auto later = hn::AndNot(flat[a], hn::Gt(enters, rays.now));
      const auto sooner = hn::AndNot(flat[a], hn::Lt(leaves, rays.leave));
      rays.now = hn::IfThenElse(later, enters, rays.now);
      rays.leave = hn::IfThenElse(sooner, leaves, rays.leave);
      rays.info = hn::Or(rays.info, bits_if(negative[a], hn::Set(di, 1 << a)));
      flags = hn::Or(flags, bits_if(flat[a], hn::Set(di, kFlatAxis << a)));
      flags = hn::Or(flags, bits_if(later, hn::Set(di, kEntersGrid)));
      flags = hn::Or(flags, bits_if(sooner, hn::Set(di, kLeavesGrid)));
    }
    meets = hn::And(meets, hn::Le(rays.now, rays.leave));
    // Beyond the grid is outside. In order, the end counts when a ray reaches it.
    const auto enters_grid = hn::TestBit(flags, hn::Set(di, kEntersGrid));
    const auto leaves_grid = hn::TestBit(flags, hn::Set(di, kLeavesGrid));
    const auto outside = kInOrder ? enters_grid : hn::Or(enters_grid, leaves_grid);
    rays.info =
        hn::Or(rays.info, hn::IfThenElseZero(outside, hn::Set(di, int32_t(kSeenOutside) << kSeenShift)));
    if constexpr (kInOrder)
      rays.info = hn::Or(rays.info, hn::IfThenElseZero(leaves_grid, hn::Set(di, kEndsOutside)));
  }

  /// Finds the first cells.
  HWY_INLINE void enter() {
    const Floats d;
    for (uint32_t a = 0; a < 3; ++a) {
      auto at = hn::Add(rays.origin[a], hn::Mul(rays.now, rays.direction[a]));
      at = hn::IfThenElse(negative[a], hn::Neg(at), at);
      const auto top = hn::Sub(sizes[a], hn::Set(d, 1.0f));  // exact
      const auto index = hn::Trunc(hn::Min(hn::Max(at, hn::Zero(d)), top));
      rays.cell[a] = hn::IfThenElse(negative[a], hn::Sub(hn::Set(d, -1.0f), index), index);
    }
  }

  hn::Mask<Floats> negative[3];  ///< directions before mirroring
  hn::Mask<Floats> flat[3];      ///< axes along which rays do not move
  hn::Vec<Floats> sizes[3];      ///< of the grid, in finest cells
};

}  // namespace nif::kernels::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
