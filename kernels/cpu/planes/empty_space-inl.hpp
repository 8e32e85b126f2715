// Empty-space skipping before rays get a lane: lines from outside begin over empty voxels, and many meet
// nothing else.
//
// Compiled once for each target, so the include guard toggles.
#if defined(NIF_PLANES_EMPTY_SPACE_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef NIF_PLANES_EMPTY_SPACE_INL
#undef NIF_PLANES_EMPTY_SPACE_INL
#else
#define NIF_PLANES_EMPTY_SPACE_INL
#endif

#include "kernels/cpu/planes/dda_step-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace nif::kernels::cpu::HWY_NAMESPACE {

/// How often rays skip, and how many of a vector must skip for that. A third time gains nothing
/// (docs/results/cpu-kernels.md).
constexpr uint32_t kFirstSkips = 2;
constexpr uint32_t kLanesToSkip = kLanes / 2;

/// Advances rays from their entry into the grid over empty voxels, as long as most of the given lanes' rays
/// pass such voxels. Returns the lanes that continue.
template <bool kInOrder>
HWY_INLINE uint32_t skip_empty_space(const LaneGrid& grid, LaneRays& rays, hn::Mask<Floats> lanes) {
  const Floats d;
  const Ints di;
  for (uint32_t i = 0; i < kFirstSkips; ++i) {
    const auto skips = hn::And(lanes, hn::RebindMask(d, is_kind(rays.word, kEmptyVoxel)));
    if (uint32_t(__builtin_popcount(bits_of(skips))) < kLanesToSkip) break;
    const auto size = grid.sizes_of(rays.word, hn::Set(d, grid.voxel_size()));
    const Exits exits(rays, size, grid.reach_of(rays.word, rays.info), grid.voxel_size());
    const auto seen = hn::And(hn::ShiftRight<4 - kSeenShift>(rays.word), hn::Set(di, kSeenSides));
    rays.info = hn::Or(rays.info, bits_if(skips, seen));
    const auto leaves_cube = hn::Lt(exits.nearest, rays.leave);
    // A blocked ray continues, and ends where it is.
    const auto blocked = hn::RebindMask(d, is_blocked(with_end<kInOrder>(rays.info, leaves_cube)));
    lanes = hn::AndNot(hn::AndNot(hn::Or(leaves_cube, blocked), skips), lanes);
    const auto moves = hn::AndNot(blocked, hn::And(leaves_cube, skips));
    const NextCells next(rays, exits.t, exits.nearest);
    for (uint32_t a = 0; a < 3; ++a) rays.cell[a] = hn::IfThenElse(moves, next.cell[a], rays.cell[a]);
    rays.now = hn::IfThenElse(moves, hn::Max(exits.nearest, rays.now), rays.now);
    const auto word = grid.words_at(rays.cell, rays.info, lanes);
    rays.word = hn::IfThenElse(hn::RebindMask(di, moves), word, rays.word);
  }
  return bits_of(lanes);
}

}  // namespace nif::kernels::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
