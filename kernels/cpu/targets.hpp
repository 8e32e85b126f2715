// Which of Highway's targets the kernels are compiled for. Include it before <hwy/foreach_target.h>, and
// after HWY_WANT_AVX3_DL where that is defined.
#pragma once

// Vectors of unknown length cannot stand in arrays.
#define NIF_LENGTHLESS_TARGETS (HWY_SSSE3 | HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128)
// All targets are of one source, and each takes up to a minute to compile with sanitizers: there, the best of
// each width will do.
#ifndef NIF_SANITIZED
#define HWY_DISABLED_TARGETS NIF_LENGTHLESS_TARGETS
#elif defined(HWY_WANT_AVX3_DL)
#define HWY_DISABLED_TARGETS (NIF_LENGTHLESS_TARGETS | HWY_SSE4 | HWY_AVX3)
#else
#define HWY_DISABLED_TARGETS (NIF_LENGTHLESS_TARGETS | HWY_SSE4)
#endif
