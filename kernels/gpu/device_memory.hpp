// Reading of arrays in device memory.
#pragma once

#include <cstdint>

#include "kernels/reference/host_device.hpp"

namespace nif::kernels::gpu {

/// array[i] of device memory. Where a pointer to it was itself read from there, AMD's compiler does not know
/// what it points to, and would load as if from any memory, which takes longer.
template <class T>
NIF_HOST_DEVICE inline T load_device(const T* array, uint32_t i) {
#if defined(__HIP__) && defined(NIF_ON_DEVICE)
  using Known = __attribute__((address_space(1))) const T;
  return ((Known*)array)[i];
#else
  return array[i];
#endif
}

}  // namespace nif::kernels::gpu
