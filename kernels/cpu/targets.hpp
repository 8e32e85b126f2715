// Selects the Highway targets that the kernels are compiled for. Include it before <hwy/foreach_target.h>,
// and after HWY_WANT_AVX3_DL if that is defined.
#pragma once

// Arrays cannot hold vectors of unknown length.
#define NIF_LENGTHLESS_TARGETS (HWY_SSSE3 | HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128)
// All targets come from one source, and each takes up to a minute to compile with sanitizers: there, the best
// target of each width is enough.
#ifndef NIF_SANITIZED
#define HWY_DISABLED_TARGETS NIF_LENGTHLESS_TARGETS
#elif defined(HWY_WANT_AVX3_DL)
#define HWY_DISABLED_TARGETS (NIF_LENGTHLESS_TARGETS | HWY_SSE4 | HWY_AVX3)
#else
#define HWY_DISABLED_TARGETS (NIF_LENGTHLESS_TARGETS | HWY_SSE4)
#endif

// A single target, as the fuzzer is compiled: the same for all kernels, and this machine's best. Highway
// itself would require __AVXVNNI__, which is another extension than AVX-512's.
#ifdef HWY_COMPILE_ONLY_STATIC
#if defined(__AVX512VNNI__) && defined(__AVX512VBMI2__) && defined(__AVX512VPOPCNTDQ__) && \
    defined(__AVX512BITALG__) && defined(__GFNI__) && defined(__VPCLMULQDQ__)
#ifdef HWY_WANT_AVX3_DL
#define HWY_BASELINE_TARGETS HWY_AVX3_DL
#else
#define HWY_BASELINE_TARGETS HWY_AVX3
#endif
#elif defined(__AVX2__) && defined(__FMA__) && defined(__BMI2__)
#define HWY_BASELINE_TARGETS HWY_AVX2
#endif
#endif
