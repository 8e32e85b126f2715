// Names the instruction sets that have SIMD kernels.
#pragma once

namespace nif::kernels::cpu {

/// Within a family, from narrow to wide.
enum class Isa { sse4, avx2, avx512, neon, wasm };

/// Whether this build has kernels for it and this machine can run them.
bool available(Isa isa);

/// Extensions that the `segment` kernel uses if the machine has them: VNNI with AVX2's vectors, and
/// everything that Highway's target AVX3_DL requires.
bool has_avx_vnni();
bool has_avx3_dl();

/// Whether a gather takes longer here than a load for each lane, as on AMD's processors: a variable, because kernels ask at
/// each gather. False before the program's variables are initialised.
extern const bool kSlowGathers;

}  // namespace nif::kernels::cpu
