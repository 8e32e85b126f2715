// Lets every compiler share one definition of the maths: functions marked so are compiled for the host and,
// if a GPU compiler reads them (clang for AMD, nvcc for NVIDIA), for the device too.
//
// Such a function may not use containers, throw or allocate, and may use only types of the standard library.
// It should not index an array by a variable where speed matters: GPUs keep such arrays in memory.
#pragma once

#if defined(__CUDACC__)
#define NIF_HOST_DEVICE __host__ __device__
#elif defined(__HIP__)
#define NIF_HOST_DEVICE __attribute__((host)) __attribute__((device))
#else
#define NIF_HOST_DEVICE
#endif

/// Put this before a loop over a short array. GPU compilers must unroll it, because an array that is indexed
/// by a variable cannot stay in registers.
#if defined(__CUDACC__) || defined(__HIP__)
#define NIF_UNROLL _Pragma("unroll")
#define NIF_NO_UNROLL _Pragma("unroll 1")  ///< if unrolling would take more registers than it is worth
/// For functions that take such arrays, which a call would force into memory: compilers do not inline long
/// functions by themselves.
#define NIF_INLINE __attribute__((always_inline)) inline
#else
#define NIF_UNROLL
#define NIF_NO_UNROLL
#define NIF_INLINE inline
#endif

/// For functions that each target's kernels must inline: a call would run code compiled for a generic
/// processor, which is slow while wide registers are in use.
#define NIF_PART_OF_KERNEL __attribute__((always_inline)) inline

/// The same for rarely executed code. WebAssembly has a single target, and there code size matters.
#if defined(__wasm__)
#define NIF_RARE_PART_OF_KERNEL __attribute__((noinline)) inline
#else
#define NIF_RARE_PART_OF_KERNEL NIF_PART_OF_KERNEL
#endif

/// Defined when compiling device code.
#if defined(__CUDA_ARCH__) || (defined(__HIP__) && defined(__AMDGCN__))
#define NIF_ON_DEVICE
#endif
