// Picks a kernel's version for an instruction set. For sources that are compiled for each target: include it
// once, after <hwy/highway.h>.
#pragma once

#include "kernels/cpu/isa.hpp"

#if HWY_TARGETS & HWY_SSE4
#define NIF_IF_SSE4(function) N_SSE4::function
#else
#define NIF_IF_SSE4(function) nullptr
#endif
#if HWY_TARGETS & HWY_AVX2
#define NIF_IF_AVX2(function) N_AVX2::function
#else
#define NIF_IF_AVX2(function) nullptr
#endif
#if HWY_TARGETS & HWY_AVX3
#define NIF_IF_AVX512(function) N_AVX3::function
#else
#define NIF_IF_AVX512(function) nullptr
#endif
#if HWY_ARCH_ARM_A64 && HWY_TARGETS & HWY_NEON
#define NIF_IF_NEON(function) N_NEON::function
#else
#define NIF_IF_NEON(function) nullptr
#endif
#if HWY_TARGETS & HWY_WASM
#define NIF_IF_WASM(function) N_WASM::function
#else
#define NIF_IF_WASM(function) nullptr
#endif

/// A pointer to the version of `function` for the instruction set, which must be available().
#define NIF_KERNEL_FOR(Pointer, function, isa)                                                   \
  ::nif::kernels::cpu::choose_kernel<Pointer>(isa, NIF_IF_SSE4(function), NIF_IF_AVX2(function), \
                                              NIF_IF_AVX512(function), NIF_IF_NEON(function),    \
                                              NIF_IF_WASM(function))

namespace nif::kernels::cpu {

template <class Pointer>
Pointer choose_kernel(Isa isa, Pointer sse4, Pointer avx2, Pointer avx512, Pointer neon, Pointer wasm) {
  switch (isa) {
    case Isa::sse4:
      return sse4;
    case Isa::avx2:
      return avx2;
    case Isa::avx512:
      return avx512;
    case Isa::neon:
      return neon;
    case Isa::wasm:
      return wasm;
  }
  return nullptr;
}

}  // namespace nif::kernels::cpu
