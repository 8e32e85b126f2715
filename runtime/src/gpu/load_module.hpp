// Finds and loads the GPU module.
#pragma once

#include <string_view>

#include "gpu/module.hpp"

namespace nif::runtime {

/// Loads the module from the given file. If `file` is "", from the file that the environment variable
/// NIF_GPU_MODULE names; if that is not set, from libnif_gpu.so in the folder of this library or program, in
/// the library folder that belongs to it, or in the system's search path. The module stays loaded. Throws
/// Failure that says what is missing.
const GpuModule& load_gpu_module(std::string_view file);

}  // namespace nif::runtime
