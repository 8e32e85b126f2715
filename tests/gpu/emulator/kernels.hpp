// The kernels that the GPU module starts, by name, for the emulator.
#pragma once

#include <functional>
#include <span>
#include <string_view>

#include "kernels/gpu/hit_kernels.hpp"
#include "kernels/gpu/kernel_list.hpp"
#include "kernels/gpu/open_kernels.hpp"
#include "kernels/gpu/pipeline_kernels.hpp"
#include "kernels/gpu/traverse_one_kernels.hpp"
#include "tests/gpu/emulator/emulator.hpp"
#include "tests/gpu/emulator/machine.hpp"

namespace nif::test {

using EmulatedRun = std::function<void(const kernels::gpu::EmulatedThread&)>;

/// A kernel for any thread.
struct EmulatedKernel {
  std::string_view name;
  EmulatedRun (*bind)(const void* argument);  ///< with a copy of what the kernel is given
};

/// Null where there is none of that name. What has no matrix products is the same for all kinds.
const EmulatedKernel* find_emulated_kernel(std::string_view name, MatrixKind kind);

}  // namespace nif::test
