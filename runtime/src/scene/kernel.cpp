// Choosing kernels.
#include "scene/kernel.hpp"

#include "api/object.hpp"
#include "kernels/reference/bvh/query.hpp"
#include "kernels/reference/kernel.hpp"
#include "kernels/reference/segment/query.hpp"
#include "kernels/reference/spherical/query.hpp"
#ifdef NIF_HAS_SIMD
#include "kernels/cpu/bvh/kernel.hpp"
#include "kernels/cpu/segment/kernel.hpp"
#include "kernels/cpu/spherical/kernel.hpp"
#endif

namespace nif::runtime {
namespace {

template <class Kernel, class... Arguments>
KernelPointer hold(std::pmr::memory_resource* memory, Arguments&&... arguments) {
  return {create<Kernel>(memory, std::forward<Arguments>(arguments)...),
          KernelDeleter{memory, sizeof(Kernel), alignof(Kernel)}};
}

#ifdef NIF_HAS_SIMD
/// What an object may take in memory to be faster: a hundredth of Embree's compact BVH, some 38 bytes a
/// triangle.
size_t ample_bytes(const format::ObjectView& object) { return size_t{object.triangles} * 3 / 8; }
#endif

constexpr const char* kIsaNames[] = {"scalar", "sse4", "avx2", "avx512", "neon"};

}  // namespace

const char* name_of(Isa isa) { return kIsaNames[size_t(isa)]; }

bool available(Isa isa) {
  if (isa == Isa::scalar) return true;
#ifdef NIF_HAS_SIMD
  return kernels::cpu::available(kernels::cpu::Isa(int(isa) - 1));
#else
  return false;
#endif
}

Isa best_isa() {
  for (const Isa isa : {Isa::avx512, Isa::avx2, Isa::sse4, Isa::neon})
    if (available(isa)) return isa;
  return Isa::scalar;
}

KernelPointer make_kernel(const format::ObjectView& object, Isa isa, std::pmr::memory_resource* memory) {
#ifdef NIF_HAS_SIMD
  if (object.encoding == format::kBvh && isa != Isa::scalar)
    return hold<kernels::cpu::SimdBvhKernel>(memory, object.bvh, kernels::cpu::Isa(int(isa) - 1));
  if (object.encoding == format::kSpherical && isa != Isa::scalar)
    return hold<kernels::cpu::SimdSphericalKernel>(memory, *object.spherical, kernels::cpu::Isa(int(isa) - 1),
                                                   memory);
  if (object.encoding == format::kSegment && isa != Isa::scalar &&
      kernels::cpu::WalkGrid::can_hold(object.field))
    return hold<kernels::cpu::SimdSegmentKernel>(memory, object.field, ample_bytes(object),
                                                 kernels::cpu::Isa(int(isa) - 1), memory);
#else
  (void)isa;
#endif
  if (object.encoding == format::kBvh) return hold<kernels::ReferenceKernel<BvhField>>(memory, object.bvh);
  if (object.encoding == format::kSpherical)
    return hold<kernels::ReferenceKernel<SphericalField>>(memory, *object.spherical);
  return hold<kernels::ReferenceKernel<SegmentField>>(memory, object.field);
}

}  // namespace nif::runtime
