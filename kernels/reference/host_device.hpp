// One definition of the maths for every compiler: functions marked so are compiled for the host and, where a
// GPU compiler reads them (clang for AMD, nvcc for NVIDIA), for the device too.
//
// What such a function may use: no containers, nothing that throws or allocates, and of the standard library
// only types. No array that is indexed by a variable, either, where it would cost: GPUs keep those in memory.
#pragma once

#if defined(__CUDACC__)
#define NIF_HOST_DEVICE __host__ __device__
#elif defined(__HIP__)
#define NIF_HOST_DEVICE __attribute__((host)) __attribute__((device))
#else
#define NIF_HOST_DEVICE
#endif

/// Before a loop over a short array: GPU compilers are to unroll it, because what is indexed by a variable
/// cannot stay in registers.
#if defined(__CUDACC__) || defined(__HIP__)
#define NIF_UNROLL _Pragma("unroll")
#define NIF_NO_UNROLL _Pragma("unroll 1")  ///< where unrolling would take more registers than it is worth
/// For functions that take such arrays, which a call would have in memory: compilers shy away from long ones.
#define NIF_INLINE __attribute__((always_inline)) inline
#else
#define NIF_UNROLL
#define NIF_NO_UNROLL
#define NIF_INLINE inline
#endif

/// For functions that kernels of a target compile as part of their own: called, they would be code for any
/// processor, which runs slowly while wide registers are in use.
#define NIF_PART_OF_KERNEL __attribute__((always_inline)) inline

/// The same, of what is seldom needed. WebAssembly has one target, and counts bytes.
#if defined(__wasm__)
#define NIF_RARE_PART_OF_KERNEL __attribute__((noinline)) inline
#else
#define NIF_RARE_PART_OF_KERNEL NIF_PART_OF_KERNEL
#endif

/// Defined while code for a device is being made.
#if defined(__CUDA_ARCH__) || (defined(__HIP__) && defined(__AMDGCN__))
#define NIF_ON_DEVICE
#endif
