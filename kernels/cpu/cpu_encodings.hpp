// The encodings that have SIMD kernels, one line each. Every file defines make_kernel() for its field.
#pragma once

#include <concepts>

#include "kernels/cpu/encodings/cpu_bvh.hpp"
#include "kernels/cpu/encodings/cpu_cutout.hpp"
#include "kernels/cpu/encodings/cpu_exact.hpp"
#include "kernels/cpu/encodings/cpu_proof.hpp"
#include "kernels/cpu/encodings/cpu_segment.hpp"
#include "kernels/cpu/encodings/cpu_spherical.hpp"
#include "kernels/reference/reference_encodings.hpp"

namespace nif::kernels::cpu {

/// Null if the SIMD kernel cannot represent the object; the reference then answers. The field's memory must
/// outlive the kernel if that reads_field(). A template for the same reason as query() of AnyField.
template <std::same_as<AnyField> Any>
KernelPointer make_kernel(const Any& field, const KernelOptions& options) {
  return std::visit([&](const auto& own) { return make_kernel(own, options); }, field);
}

}  // namespace nif::kernels::cpu
