// Chooses the kernel for an object, by its encoding and the device's instruction set.
#pragma once

#include <memory>
#include <memory_resource>

#include "formats/nif/reader.hpp"
#include "kernels/cpu/shared_copies.hpp"
#include "kernels/cpu/top_level/ray_stream.hpp"
#include "kernels/reference/object_kernel.hpp"

namespace nif::runtime {

using kernels::KernelPointer;
using kernels::cpu::SharedCopies;

/// Instruction sets that a device may use; `scalar` is the reference.
enum class Isa { scalar, sse4, avx2, avx512, neon, wasm };
const char* name_of(Isa isa);  ///< as in isa=NAME
/// Does this build have kernels for it, and can this machine run them?
bool available(Isa isa);
Isa best_isa();

/// The kind of kernels that a device uses.
struct KernelChoice {
  Isa isa = best_isa();
  bool least_memory = false;  ///< the smallest tables, at the cost of a little time
  bool decodes = true;        ///< small objects with triangles are decoded; not with `least_memory`
};

/// Whether an asset's objects are few enough to be decoded: together they must stay in the cache.
bool may_decode(const format::AssetView& asset);

/// The view's memory and the asset's shared copies must outlive the kernel.
kernels::KernelPointer make_kernel(const format::ObjectView& object, const KernelChoice& choice,
                                   std::pmr::memory_resource* memory, SharedCopies& copies);

/// A kernel of triangles that ObjectKernel::move() will move. The field's memory must outlive it or the first move().
kernels::KernelPointer make_moving_kernel(const kernels::TrianglesField& field, const KernelChoice& choice,
                                          std::pmr::memory_resource* memory, SharedCopies& copies);

/// The same, as a copy of such a kernel of the same field and choice: faster, because nothing is decoded. It has to be
/// moved before it answers.
kernels::KernelPointer copy_moving_kernel(const kernels::ObjectKernel& kernel,
                                          const kernels::TrianglesField& field, const KernelChoice& choice,
                                          std::pmr::memory_resource* memory, SharedCopies& copies);

/// What the instruction set has for streams of rays; null for the reference.
const kernels::cpu::StreamFunctions* stream_functions(Isa isa);

}  // namespace nif::runtime
