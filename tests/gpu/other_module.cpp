// A GPU module of another version, for tests: its table has another layout than the library's.
#include "gpu/crossing.hpp"

extern "C" NIF_API const nif::runtime::GpuModule* nif_gpu_module(void) {
  static const nif::runtime::GpuModule module = [] {
    nif::runtime::GpuModule table{};
    table.version = nif::runtime::kGpuModuleVersion;
    table.layout = nif::runtime::kGpuLayout ^ 1;
    return table;
  }();
  return &module;
}
