// The `segment` encoding in SIMD: the same bits as kernels/reference, many rays at a time.
#pragma once

#include "kernels/cpu/kernel_options.hpp"
#include "kernels/reference/network/network_field.hpp"

namespace nif::kernels::cpu {

/// The field must outlive the kernel if that reads_field().
KernelPointer make_kernel(const SegmentField& field, const KernelOptions& options);

}  // namespace nif::kernels::cpu
