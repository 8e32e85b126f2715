// Chooses the kernel for an object, and finds which instruction sets this machine has.
#include "scene/kernel.hpp"

#include <stdexcept>

#include "kernels/cpu/triangles/decoded_tree.hpp"
#include "kernels/reference/kernel.hpp"
#include "kernels/reference/reference_encodings.hpp"
#ifdef NIF_HAS_SIMD
#include "kernels/cpu/cpu_encodings.hpp"
#endif

namespace nif::runtime {
namespace {

constexpr const char* kIsaNames[] = {"scalar", "sse4", "avx2", "avx512", "neon", "wasm"};

}  // namespace

const char* name_of(Isa isa) { return kIsaNames[size_t(isa)]; }

bool available(Isa isa) {
#ifdef NIF_WITHOUT_REFERENCE
  if (isa == Isa::scalar) return false;
#else
  if (isa == Isa::scalar) return true;
#endif
#ifdef NIF_HAS_SIMD
  return kernels::cpu::available(kernels::cpu::Isa(int(isa) - 1));
#else
  return false;
#endif
}

Isa best_isa() {
  for (const Isa isa : {Isa::avx512, Isa::avx2, Isa::sse4, Isa::neon, Isa::wasm})
    if (available(isa)) return isa;
  return Isa::scalar;
}

const kernels::cpu::StreamFunctions* stream_functions(Isa isa) {
#ifdef NIF_HAS_SIMD
  if (isa != Isa::scalar) return &kernels::cpu::stream_functions(kernels::cpu::Isa(int(isa) - 1));
#endif
  (void)isa;
  return nullptr;
}

bool may_decode([[maybe_unused]] const format::AssetView& asset) {
#ifdef NIF_DECODES
  uint64_t triangles = 0;
  for (const format::ObjectView& object : asset.objects) {
    const uint64_t own = object.triangles ? object.triangles->field.triangle_count : 0;
    if (kernels::cpu::least_decoded_bytes(own) <= kernels::cpu::kMostDecoded) triangles += own;
  }
  return triangles <= kernels::cpu::kMostTrianglesDecoded;
#else
  return false;
#endif
}

KernelPointer make_kernel(const format::ObjectView& object, const KernelChoice& choice,
                          std::pmr::memory_resource* memory, SharedCopies& copies) {
  const kernels::AnyField field = field_of(object);
#ifdef NIF_HAS_SIMD
  if (choice.isa != Isa::scalar) {
    kernels::cpu::KernelOptions options{kernels::cpu::Isa(int(choice.isa) - 1), memory, copies};
    if (choice.least_memory) options.most_without_bricks = 0;
    if (choice.least_memory || !choice.decodes) options.most_decoded = 0;
    if (KernelPointer kernel = kernels::cpu::make_kernel(field, options)) return kernel;
  }
#else
  (void)choice;
  (void)copies;
#endif
#ifdef NIF_WITHOUT_REFERENCE  // for WebAssembly, where every byte is downloaded
  throw std::logic_error("there is no kernel for this object");
#else
  return std::visit(
      [&]<class Field>(const Field& own) {
        return kernels::hold_kernel<kernels::ReferenceKernel<Field> >(memory, own);
      },
      field);
#endif
}

KernelPointer make_moving_kernel(const kernels::TrianglesField& field, const KernelChoice& choice,
                                 std::pmr::memory_resource* memory, SharedCopies& copies) {
#ifdef NIF_HAS_SIMD
  if (choice.isa != Isa::scalar) {
    kernels::cpu::KernelOptions options{kernels::cpu::Isa(int(choice.isa) - 1), memory, copies};
    // Decoded whatever else the asset has: its boxes move in a third of the time.
    if (choice.least_memory) options.most_decoded = 0;
    options.moves = true;
    return kernels::cpu::make_kernel(field, options);
  }
#else
  (void)choice;
  (void)copies;
#endif
#ifdef NIF_WITHOUT_REFERENCE
  throw std::logic_error("there is no kernel for this object");
#else
  return kernels::hold_kernel<kernels::ReferenceKernel<kernels::TrianglesField> >(memory, field);
#endif
}

KernelPointer copy_moving_kernel([[maybe_unused]] const kernels::ObjectKernel& kernel,
                                 const kernels::TrianglesField& field, const KernelChoice& choice,
                                 std::pmr::memory_resource* memory, SharedCopies& copies) {
#if defined(NIF_HAS_SIMD) && !defined(NIF_WITHOUT_BENDING)
  if (choice.isa != Isa::scalar) return kernels::cpu::copy_kernel(kernel, memory);
#endif
  return make_moving_kernel(field, choice, memory, copies);
}

}  // namespace nif::runtime
