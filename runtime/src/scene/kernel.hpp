// Chooses what answers an object: its encoding's kernel for the device's instruction set.
#pragma once

#include <memory>
#include <memory_resource>

#include "formats/nif/reader.hpp"
#include "kernels/reference/object_kernel.hpp"

namespace nif::runtime {

/// Instruction sets that a device may use; `scalar` is the reference.
enum class Isa { scalar, sse4, avx2, avx512, neon };
const char* name_of(Isa isa);  ///< as in isa=NAME
/// Whether this build has kernels for it and this machine can run them.
bool available(Isa isa);
Isa best_isa();

/// Gives a kernel's memory back to where it came from.
struct KernelDeleter {
  std::pmr::memory_resource* memory = nullptr;
  size_t bytes = 0, alignment = 0;
  void operator()(kernels::ObjectKernel* kernel) const {
    kernel->~ObjectKernel();
    memory->deallocate(kernel, bytes, alignment);
  }
};
using KernelPointer = std::unique_ptr<kernels::ObjectKernel, KernelDeleter>;

/// The view's memory must outlive the kernel.
KernelPointer make_kernel(const format::ObjectView& object, Isa isa, std::pmr::memory_resource* memory);

}  // namespace nif::runtime
