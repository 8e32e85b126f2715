// The loop that traversals of `bvh` objects share: groups of rays go through three phases, interleaved, so that each
// phase fills the time in which the others wait (traverse-inl.hpp says why).
//
// Compiled once for each target.
#if defined(NIF_BVH_PHASES_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef NIF_BVH_PHASES_INL
#undef NIF_BVH_PHASES_INL
#else
#define NIF_BVH_PHASES_INL
#endif

#include <hwy/highway.h>

#include <cstdint>

HWY_BEFORE_NAMESPACE();
namespace nif::kernels::cpu::HWY_NAMESPACE {

/// Groups of rays, one for each phase, and rays of a group. With 10 and more rays, small meshes get slower by
/// a tenth and large ones gain nothing (docs/results/cpu-kernels.md).
constexpr uint32_t kFlightGroups = 3;
constexpr uint32_t kFlights = 8;

/// Traversal: has test_nodes(), test_leaves() and exchange() of a group. Group: has clear() and in_flight.
template <class Traversal, class Group>
HWY_INLINE void run_phases(Traversal& traversal, Group (&groups)[kFlightGroups]) {
  for (Group& group : groups) {
    group.clear();
    traversal.exchange(group);
  }
  Group *a = groups, *b = a + 1, *c = a + 2;
  while ((a->in_flight | b->in_flight | c->in_flight) != 0) {
    traversal.test_nodes(*a);
    traversal.test_leaves(*b);
    traversal.exchange(*c);
    Group* const last = c;
    c = b;
    b = a;
    a = last;
  }
}

}  // namespace nif::kernels::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
