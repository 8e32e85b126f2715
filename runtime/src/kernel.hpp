// Chooses what answers an object: its encoding's kernel for the device's instruction set.
#pragma once

#include <memory>
#include <memory_resource>

#include "device.hpp"
#include "formats/nif/reader.hpp"
#include "kernels/object_kernel.hpp"

namespace nif::runtime {

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
KernelPointer make_kernel(const format::ObjectView& object, const Configuration& configuration,
                          std::pmr::memory_resource* memory);

}  // namespace nif::runtime
