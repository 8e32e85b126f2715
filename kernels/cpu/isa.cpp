// Tells which instruction sets can be used. One counts if the build has kernels for it and the processor
// supports it. ARM and WebAssembly have one each, so there only the build decides.
#include "kernels/cpu/isa.hpp"

// The same setting as for the kernels, because their targets must be known here.
#define HWY_WANT_AVX3_DL 1
#include "kernels/cpu/targets.hpp"

#include <hwy/detect_targets.h>

#if HWY_ARCH_X86
#include <cpuid.h>
#endif

namespace nif::kernels::cpu {

#if HWY_ARCH_X86
/// Not every compiler's __builtin_cpu_supports knows this name.
bool has_avx_vnni() {
  unsigned a, b, c, d;
  return __get_cpuid_count(7, 1, &a, &b, &c, &d) && (a & 1u << 4) != 0;
}

bool has_avx3_dl() {
  return __builtin_cpu_supports("avx512vnni") && __builtin_cpu_supports("avx512vbmi2") &&
         __builtin_cpu_supports("avx512vpopcntdq") && __builtin_cpu_supports("avx512bitalg") &&
         __builtin_cpu_supports("gfni") && __builtin_cpu_supports("vpclmulqdq");
}

const bool kSlowGathers = __builtin_cpu_is("amd") != 0;
#else
bool has_avx_vnni() { return false; }
bool has_avx3_dl() { return false; }
const bool kSlowGathers = false;
#endif

bool available(Isa isa) {
  switch (isa) {
    case Isa::sse4:
#if HWY_TARGETS & HWY_SSE4
      return __builtin_cpu_supports("sse4.2") && __builtin_cpu_supports("popcnt");
#else
      return false;
#endif
    case Isa::avx2:
#if HWY_TARGETS & HWY_AVX2
      return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") &&
             __builtin_cpu_supports("bmi2");
#else
      return false;
#endif
    case Isa::avx512:
#if HWY_TARGETS & HWY_AVX3_DL
      if (has_avx3_dl()) return true;
#endif
#if HWY_TARGETS & HWY_AVX3
      return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl") &&
             __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512bw") &&
             __builtin_cpu_supports("avx512cd");
#else
      return false;
#endif
    case Isa::neon:
#if HWY_ARCH_ARM_A64 && HWY_TARGETS & HWY_NEON
      return true;
#else
      return false;
#endif
    case Isa::wasm:
#if HWY_TARGETS & HWY_WASM
      return true;
#else
      return false;
#endif
  }
  return false;
}

}  // namespace nif::kernels::cpu
