// What kernels need from the thread that runs them, for each compiler: clang for AMD, nvcc for NVIDIA. The
// host's counterpart is tests/gpu/emulator/emulator.hpp. This is the only file that uses compiler-specific
// names.
//
// Kernels are templates over Thread, which is a DeviceThread here and an EmulatedThread there. No header of
// HIP or CUDA is included, and no device library is linked: clang or nvcc alone compiles them.
//
// Members of Thread:
//   block(), blocks(), index(), threads()   the block, out of how many; the thread in it, out of how many
//   lane(), wave(), wave_size()             a wave runs in step: a warp of 32, or 32 or 64 lanes
//   shared()                                the block's shared memory, 16-byte aligned
//   sync(), wave_sync()                     wait for all threads of the block, or of the wave
//   ballot(b), shuffle(x, lane)             over the lanes of the wave
//   add(p, n)                               atomically adds n to *p, and returns the old value
//   dot4(sum, a, b)                         sum + a0 b0 + .. + a3 b3, signed bytes
//   dot2(sum, a, b)                         sum + a0 b0 + a1 b1, halves, if there are no matrix units
//   and matrix products, see DeviceThread.
// All threads of the block, or of the wave, that have not ended must call sync() and the functions that
// concern a wave.
#pragma once

#include <cstdint>

#include "kernels/reference/host_device.hpp"

namespace nif::kernels::gpu {

/// A word of memory that was written as bytes, or the other way round. 4-byte aligned.
typedef uint32_t Word __attribute__((may_alias));
typedef uint16_t HalfWord __attribute__((may_alias));
NIF_HOST_DEVICE inline uint32_t load_word(const void* from) { return *static_cast<const Word*>(from); }
NIF_HOST_DEVICE inline void store_word(void* to, uint32_t word) { *static_cast<Word*>(to) = word; }
/// kCount words, aligned to their total size: one load.
template <uint32_t kCount>
struct alignas(4 * kCount) [[gnu::may_alias]] AlignedWords {
  uint32_t word[kCount];
};
template <uint32_t kCount>
NIF_HOST_DEVICE inline AlignedWords<kCount> load_words(const unsigned char* from) {
  return *reinterpret_cast<const AlignedWords<kCount>*>(from);
}

/// For functions so long that nvcc would not inline them, which takes more registers. clang takes more if it
/// is forced to inline them.
#if defined(__CUDACC__)
#define NIF_LONG_INLINE __forceinline__
#else
#define NIF_LONG_INLINE inline
#endif

#if defined(__CUDACC__) || defined(__HIP__)

#if defined(__CUDACC__)
#define NIF_DEVICE __device__ __forceinline__
/// An entry point: block size, and minimum resident blocks per NVIDIA multiprocessor, which limit a thread's
/// registers.
#define NIF_KERNEL(threads, blocks) extern "C" __global__ void __launch_bounds__(threads, blocks)
/// A structure as a kernel's argument: read in place, even at indices that are not constant.
#define NIF_ARGUMENT const __grid_constant__
extern __shared__ __align__(16) unsigned char nif_shared_memory[];
#else
#define NIF_DEVICE __attribute__((device)) __attribute__((always_inline)) inline
#define NIF_KERNEL(threads, blocks) \
  extern "C" __attribute__((global)) __attribute__((amdgpu_flat_work_group_size(threads, threads))) void
#define NIF_ARGUMENT const
extern __attribute__((shared)) __attribute__((aligned(16))) unsigned char nif_shared_memory[];
#endif

/// Wave size of the device that code is being compiled for; in a compiler's host pass, any number.
#if defined(__AMDGCN_WAVEFRONT_SIZE)
inline constexpr uint32_t kDeviceWave = __AMDGCN_WAVEFRONT_SIZE;
#else
inline constexpr uint32_t kDeviceWave = 32;
#endif

#if defined(__HIP__)
template <class T, int kCount>
using Vector = T __attribute__((ext_vector_type(kCount)));
using Halves2 = Vector<_Float16, 2>;
using Halves4 = Vector<_Float16, 4>;
using Halves16 = Vector<_Float16, 16>;
#endif

class DeviceThread {
 public:
#if defined(__CUDACC__)
  NIF_DEVICE uint32_t block() const { return blockIdx.x; }
  NIF_DEVICE uint32_t blocks() const { return gridDim.x; }
  NIF_DEVICE uint32_t index() const { return threadIdx.x; }
  NIF_DEVICE uint32_t threads() const { return blockDim.x; }
  NIF_DEVICE uint32_t lane() const { return threadIdx.x % kDeviceWave; }
  NIF_DEVICE uint32_t wave() const { return __shfl_sync(~0u, threadIdx.x / kDeviceWave, 0); }
  NIF_DEVICE void sync() const { __syncthreads(); }
  NIF_DEVICE void wave_sync() const { __syncwarp(); }
  NIF_DEVICE uint64_t ballot(bool value) const { return __ballot_sync(~0u, value); }
  NIF_DEVICE uint32_t shuffle(uint32_t value, uint32_t from) const { return __shfl_sync(~0u, value, from); }
  NIF_DEVICE uint32_t add(uint32_t* to, uint32_t n) const { return atomicAdd(to, n); }
  NIF_DEVICE int32_t dot4(int32_t sum, uint32_t a, uint32_t b) const {
    return __dp4a(int32_t(a), int32_t(b), sum);
  }

  /// c (16 x 8, four per lane) += a (16 x 32) b (32 x 8).
  NIF_DEVICE void mma_16x8x32(const uint32_t (&a)[4], const uint32_t (&b)[2], int32_t (&c)[4]) const {
    asm("mma.sync.aligned.m16n8k32.row.col.s32.s8.s8.s32 {%0, %1, %2, %3}, {%4, %5, %6, %7}, {%8, %9}, "
        "{%0, %1, %2, %3};"
        : "+r"(c[0]), "+r"(c[1]), "+r"(c[2]), "+r"(c[3])
        : "r"(a[0]), "r"(a[1]), "r"(a[2]), "r"(a[3]), "r"(b[0]), "r"(b[1]));
  }
  /// c (16 x 8, four per lane) += a (16 x 16) b (16 x 8), of halves.
  NIF_DEVICE void mma_16x8x16(const uint32_t (&a)[4], const uint32_t (&b)[2], float (&c)[4]) const {
    asm("mma.sync.aligned.m16n8k16.row.col.f32.f16.f16.f32 {%0, %1, %2, %3}, {%4, %5, %6, %7}, {%8, %9}, "
        "{%0, %1, %2, %3};"
        : "+f"(c[0]), "+f"(c[1]), "+f"(c[2]), "+f"(c[3])
        : "r"(a[0]), "r"(a[1]), "r"(a[2]), "r"(a[3]), "r"(b[0]), "r"(b[1]));
  }
#else
  NIF_DEVICE uint32_t block() const { return __builtin_amdgcn_workgroup_id_x(); }
  NIF_DEVICE uint32_t blocks() const { return __builtin_amdgcn_grid_size_x() / threads(); }
  NIF_DEVICE uint32_t index() const { return __builtin_amdgcn_workitem_id_x(); }
  NIF_DEVICE uint32_t threads() const { return __builtin_amdgcn_workgroup_size_x(); }
  NIF_DEVICE uint32_t lane() const { return index() % kDeviceWave; }
  NIF_DEVICE uint32_t wave() const {
    return uint32_t(__builtin_amdgcn_readfirstlane(int(index() / kDeviceWave)));
  }
  NIF_DEVICE void sync() const {
    __builtin_amdgcn_fence(__ATOMIC_RELEASE, "workgroup");
    __builtin_amdgcn_s_barrier();
    __builtin_amdgcn_fence(__ATOMIC_ACQUIRE, "workgroup");
  }
  NIF_DEVICE void wave_sync() const {
    __builtin_amdgcn_fence(__ATOMIC_RELEASE, "wavefront");
    __builtin_amdgcn_wave_barrier();
    __builtin_amdgcn_fence(__ATOMIC_ACQUIRE, "wavefront");
  }
  NIF_DEVICE uint32_t shuffle(uint32_t value, uint32_t from) const {
    return uint32_t(__builtin_amdgcn_ds_bpermute(int(4 * from), int(value)));
  }
  NIF_DEVICE uint32_t add(uint32_t* to, uint32_t n) const {
    return __hip_atomic_fetch_add(to, n, __ATOMIC_RELAXED, __HIP_MEMORY_SCOPE_AGENT);
  }
  NIF_DEVICE uint64_t ballot(bool value) const {
#if __has_builtin(__builtin_amdgcn_ballot_w32)
    if constexpr (kDeviceWave == 32) return __builtin_amdgcn_ballot_w32(value);
    return __builtin_amdgcn_ballot_w64(value);
#else
    return __builtin_amdgcn_uicmp(uint32_t(value), 0u, 33);  // 33: not equal
#endif
  }
  NIF_DEVICE int32_t dot4(int32_t sum, uint32_t a, uint32_t b) const {
#if defined(__gfx1100__)
    return __builtin_amdgcn_sudot4(true, int(a), true, int(b), sum, false);
#elif defined(__AMDGCN__)
    return __builtin_amdgcn_sdot4(int(a), int(b), sum, false);
#else
    return sum + int32_t(a ^ b);  // never run: this is the compiler's host pass
#endif
  }

#if defined(__gfx1100__)
  /// c (16 x 16, eight per lane) += a (16 x 16) b (16 x 16).
  NIF_DEVICE void wmma_16x16x16(const uint32_t (&a)[4], const uint32_t (&b)[4], int32_t (&c)[8]) const {
    Vector<int, 4> va, vb;
    Vector<int, 8> vc;
    for (int i = 0; i < 4; ++i) va[i] = int(a[i]), vb[i] = int(b[i]);
    for (int i = 0; i < 8; ++i) vc[i] = c[i];
    vc = __builtin_amdgcn_wmma_i32_16x16x16_iu8_w32(true, va, true, vb, vc, false);
    for (int i = 0; i < 8; ++i) c[i] = vc[i];
  }
  /// The value of lane() ^ 16.
  NIF_DEVICE uint32_t swap_16(uint32_t value) const {
    return __builtin_amdgcn_permlanex16(value, value, 0x76543210, 0xfedcba98, false, false);
  }
  /// The same for halves, with sums in single precision.
  NIF_DEVICE void wmma_16x16x16(const uint32_t (&a)[8], const uint32_t (&b)[8], float (&c)[8]) const {
    Vector<uint32_t, 8> va, vb;
    Vector<float, 8> vc;
    for (int i = 0; i < 8; ++i) va[i] = a[i], vb[i] = b[i], vc[i] = c[i];
    vc = __builtin_amdgcn_wmma_f32_16x16x16_f16_w32(__builtin_bit_cast(Halves16, va),
                                                    __builtin_bit_cast(Halves16, vb), vc);
    for (int i = 0; i < 8; ++i) c[i] = vc[i];
  }
#endif
#if defined(__gfx90a__)
  /// c (16 x 16, four per lane) += a (16 x 16) b (16 x 16).
  NIF_DEVICE void mfma_16x16x16(uint32_t a, uint32_t b, int32_t (&c)[4]) const {
    Vector<int, 4> vc = {c[0], c[1], c[2], c[3]};
    vc = __builtin_amdgcn_mfma_i32_16x16x16i8(int(a), int(b), vc, 0, 0, 0);
    for (int i = 0; i < 4; ++i) c[i] = vc[i];
  }
#endif
#if defined(__gfx942__)
  /// c (16 x 16, four per lane) += a (16 x 32) b (32 x 16).
  NIF_DEVICE void mfma_16x16x32(uint64_t a, uint64_t b, int32_t (&c)[4]) const {
    Vector<int, 4> vc = {c[0], c[1], c[2], c[3]};
    vc = __builtin_amdgcn_mfma_i32_16x16x32_i8(long(a), long(b), vc, 0, 0, 0);
    for (int i = 0; i < 4; ++i) c[i] = vc[i];
  }
#endif
#if defined(__gfx90a__) || defined(__gfx942__)
  /// c (16 x 16, four per lane) += a (16 x 16) b (16 x 16), of halves.
  NIF_DEVICE void mfma_16x16x16(uint64_t a, uint64_t b, float (&c)[4]) const {
    Vector<float, 4> vc = {c[0], c[1], c[2], c[3]};
    vc = __builtin_amdgcn_mfma_f32_16x16x16f16(__builtin_bit_cast(Halves4, a), __builtin_bit_cast(Halves4, b),
                                               vc, 0, 0, 0);
    for (int i = 0; i < 4; ++i) c[i] = vc[i];
  }
#endif
#if defined(__AMDGCN__)
  NIF_DEVICE float dot2(float sum, uint32_t a, uint32_t b) const {
    return __builtin_amdgcn_fdot2(__builtin_bit_cast(Halves2, a), __builtin_bit_cast(Halves2, b), sum, false);
  }
#endif
#endif

  NIF_DEVICE static constexpr uint32_t wave_size() { return kDeviceWave; }
  NIF_DEVICE unsigned char* shared() const { return nif_shared_memory; }
};

#endif

}  // namespace nif::kernels::gpu
