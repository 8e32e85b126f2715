// Finding and loading the GPU module.
#pragma once

#include <string_view>

#include "gpu/module.hpp"

namespace nif::runtime {

/// The module in the given file; for "" in the file that the environment variable NIF_GPU_MODULE names; where
/// there is none, libnif_gpu.so beside this library or program, in the folder for libraries that belongs to
/// it, or where the system looks for libraries. It stays loaded. Throws Failure that says what is missing.
const GpuModule& load_gpu_module(std::string_view file);

}  // namespace nif::runtime
