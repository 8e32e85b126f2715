// Instruction sets that there are SIMD kernels for.
#pragma once

namespace nif::kernels::cpu {

/// Of a family from narrow to wide.
enum class Isa { sse4, avx2, avx512, neon, wasm };

/// Whether this build has kernels for it and this machine can run them.
bool available(Isa isa);

/// Extensions that the `segment` kernel uses where the machine has them: VNNI with AVX2's vectors, and all
/// that Highway's target AVX3_DL asks for.
bool has_avx_vnni();
bool has_avx3_dl();

}  // namespace nif::kernels::cpu
