// Answers are defined in IEEE arithmetic: rounding to nearest, with denormals. A caller may have set the
// processor to something else (renderers flush denormals to zero), so entry points that compute set the mode
// and restore it.
#pragma once

#if defined(__SSE__) || defined(_M_X64)
#include <xmmintrin.h>
#else
#include <cfenv>
#endif

namespace nif::runtime {

/// For its lifetime this thread computes in the default mode of IEEE 754, without traps. Mark functions that
/// compute under it NIF_COMPUTES: they are not inlined, so the compiler, which does not know about the
/// environment, cannot move their code out of it.
class FloatEnvironment {
 public:
  FloatEnvironment(const FloatEnvironment&) = delete;
  FloatEnvironment& operator=(const FloatEnvironment&) = delete;

#if defined(__SSE__) || defined(_M_X64)
  FloatEnvironment() : saved_(_mm_getcsr()) { _mm_setcsr(kDefault); }
  ~FloatEnvironment() { _mm_setcsr(saved_); }

 private:
  static constexpr unsigned kDefault = 0x1f80;  // all exceptions masked, to nearest, no FTZ, no DAZ
  unsigned saved_;
#else
  FloatEnvironment() {
    std::fegetenv(&saved_);
    std::fesetenv(FE_DFL_ENV);
  }
  ~FloatEnvironment() { std::fesetenv(&saved_); }

 private:
  std::fenv_t saved_;
#endif
};

#if defined(_MSC_VER)
#define NIF_COMPUTES __declspec(noinline)
#else
#define NIF_COMPUTES __attribute__((noinline))
#endif

}  // namespace nif::runtime
