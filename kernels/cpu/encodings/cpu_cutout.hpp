// `cutout` objects in SIMD: triangles as those of `bvh`, of which some have holes.
#pragma once

#include "kernels/cpu/kernel_options.hpp"
#include "kernels/reference/encodings/reference_cutout.hpp"

namespace nif::kernels::cpu {

/// The field's memory must outlive the kernel.
KernelPointer make_kernel(const CutoutField& field, const KernelOptions& options);

}  // namespace nif::kernels::cpu
