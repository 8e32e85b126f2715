// The encodings that there are SIMD kernels for: a line each. Every file has make_kernel() of its field.
#pragma once

#include <concepts>

#include "kernels/cpu/encodings/bvh.hpp"
#include "kernels/cpu/encodings/exact.hpp"
#include "kernels/cpu/encodings/proof.hpp"
#include "kernels/cpu/encodings/segment.hpp"
#include "kernels/cpu/encodings/spherical.hpp"
#include "kernels/reference/encodings.hpp"

namespace nif::kernels::cpu {

/// Null where the object cannot be held in the form that the SIMD kernel reads: the reference then answers.
/// The field's memory must outlive the kernel where that reads_field(). A template, as query() of AnyField
/// is.
template <std::same_as<AnyField> Any>
KernelPointer make_kernel(const Any& field, const KernelOptions& options) {
  return std::visit([&](const auto& own) { return make_kernel(own, options); }, field);
}

}  // namespace nif::kernels::cpu
