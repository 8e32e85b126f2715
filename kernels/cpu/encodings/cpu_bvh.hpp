// `bvh` objects in SIMD: tests the eight boxes of a node, and the triangles of a leaf, at once.
#pragma once

#include "kernels/cpu/kernel_options.hpp"
#include "kernels/reference/triangles/triangles_field.hpp"

namespace nif::kernels::cpu {

/// The field's memory must outlive the kernel.
KernelPointer make_kernel(const TrianglesField& field, const KernelOptions& options);

/// A copy of a kernel that make_kernel() made of a field of triangles to be moved, without decoding them again. It has to be
/// moved before it answers.
KernelPointer copy_kernel(const ObjectKernel& kernel, std::pmr::memory_resource* memory);

}  // namespace nif::kernels::cpu
