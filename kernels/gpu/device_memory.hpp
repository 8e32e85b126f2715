// Reads arrays in device memory.
#pragma once

#include <cstdint>

#include "kernels/reference/host_device.hpp"

namespace nif::kernels::gpu {

/// array[i] of device memory. If the pointer itself was read from device memory, AMD's compiler does not know
/// where it points, and would use a slower, generic load.
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
