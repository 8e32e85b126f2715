// Choosing kernels.
#include "kernel.hpp"

#include "kernels/reference/segment_kernel.hpp"
#include "object.hpp"

namespace nif::runtime {
namespace {

template <class Kernel, class... Arguments>
KernelPointer hold(std::pmr::memory_resource* memory, Arguments&&... arguments) {
  return {create<Kernel>(memory, std::forward<Arguments>(arguments)...),
          KernelDeleter{memory, sizeof(Kernel), alignof(Kernel)}};
}

}  // namespace

KernelPointer make_kernel(const format::ObjectView& object, const Configuration&,
                          std::pmr::memory_resource* memory) {
  return hold<kernels::ReferenceSegmentKernel>(memory, object.field);
}

}  // namespace nif::runtime
