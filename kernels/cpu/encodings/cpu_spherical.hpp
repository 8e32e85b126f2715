// The `spherical` encoding in SIMD: the same bits as kernels/reference, one ray per lane.
#pragma once

#include "kernels/cpu/kernel_options.hpp"
#include "kernels/reference/spherical/spherical_field.hpp"

namespace nif::kernels::cpu {

/// The kernel reads grids in place, and weights too, unless they are in half precision: then it uses a copy in
/// single precision. The field's memory must outlive the kernel. Two bytes before a grid in half precision must
/// be readable, as they are in a file.
KernelPointer make_kernel(const SphericalField& field, const KernelOptions& options);

}  // namespace nif::kernels::cpu
