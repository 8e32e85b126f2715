// What all SIMD kernels are built from besides their field.
#pragma once

#include "kernels/cpu/isa.hpp"
#include "kernels/cpu/shared_copies.hpp"
#include "kernels/cpu/triangles/decoded_tree.hpp"
#include "kernels/packed/traversal_grid.hpp"
#include "kernels/reference/object_kernel.hpp"

namespace nif::kernels::cpu {

struct KernelOptions {
  Isa isa;                                          ///< must be available()
  std::pmr::memory_resource* memory;                ///< must outlive the kernel
  SharedCopies& copies;                             ///< of the object's asset; must outlive the kernel
  size_t most_without_bricks = kMostWithoutBricks;  ///< as for TraversalGrid
  size_t most_decoded = kMostDecoded;               ///< as for decode()
  bool moves = false;                               ///< ObjectKernel::move() will be called
};

}  // namespace nif::kernels::cpu
