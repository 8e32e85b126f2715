// Picks a kernel's functions for an instruction set. For sources that are compiled for each target: include
// it once, after <hwy/highway.h>.
#pragma once

#include "kernels/cpu/simd_kernel.hpp"

#if HWY_TARGETS & HWY_SSE4
#define NIF_IF_SSE4(functions) &N_SSE4::functions
#else
#define NIF_IF_SSE4(functions) nullptr
#endif
#if HWY_TARGETS & HWY_AVX2
#define NIF_IF_AVX2(functions) &N_AVX2::functions
#else
#define NIF_IF_AVX2(functions) nullptr
#endif
#if HWY_TARGETS & HWY_AVX3
#define NIF_IF_AVX512(functions) &N_AVX3::functions
#else
#define NIF_IF_AVX512(functions) nullptr
#endif
#if HWY_ARCH_ARM_A64 && HWY_TARGETS & HWY_NEON
#define NIF_IF_NEON(functions) &N_NEON::functions
#else
#define NIF_IF_NEON(functions) nullptr
#endif
#if HWY_TARGETS & HWY_WASM
#define NIF_IF_WASM(functions) &N_WASM::functions
#else
#define NIF_IF_WASM(functions) nullptr
#endif

/// The Functions that each target's namespace has under the given name, for an instruction set that is
/// available().
#define NIF_FUNCTIONS_FOR(Functions, functions, isa)                                                 \
  ::nif::kernels::cpu::functions_for<Functions>(isa, NIF_IF_SSE4(functions), NIF_IF_AVX2(functions), \
                                                NIF_IF_AVX512(functions), NIF_IF_NEON(functions),    \
                                                NIF_IF_WASM(functions))

namespace nif::kernels::cpu {

template <class Functions>
const Functions& functions_for(Isa isa, const Functions* sse4, const Functions* avx2, const Functions* avx512,
                               const Functions* neon, const Functions* wasm) {
  switch (isa) {
    case Isa::sse4:
      return *sse4;
    case Isa::avx2:
      return *avx2;
    case Isa::avx512:
      return *avx512;
    case Isa::neon:
      return *neon;
    case Isa::wasm:
      break;
  }
  return *wasm;
}

}  // namespace nif::kernels::cpu
