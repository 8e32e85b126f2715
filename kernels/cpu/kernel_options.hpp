// What all SIMD kernels are made from besides their field.
#pragma once

#include "kernels/cpu/isa.hpp"
#include "kernels/cpu/shared_copies.hpp"
#include "kernels/reference/object_kernel.hpp"

namespace nif::kernels::cpu {

struct KernelOptions {
  Isa isa;                            ///< available()
  std::pmr::memory_resource* memory;  ///< must outlive the kernel
  SharedCopies& copies;               ///< of the object's asset; must outlive the kernel
};

}  // namespace nif::kernels::cpu
