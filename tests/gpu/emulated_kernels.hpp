// The kernels that the GPU module starts, by name, for the emulator.
#pragma once

#include <cstring>

#include "kernels/hip/emulator.hpp"
#include "kernels/hip/scene_kernels.hpp"

namespace nif::test {

/// A kernel for any thread.
struct EmulatedKernel {
  const char* name;
  void (*run)(const kernels::hip::EmulatedThread& thread, const kernels::hip::SceneArrays& scene,
              const kernels::hip::SceneQuery& query);
};

template <uint32_t kKinds, bool kDetails>
void run_scene(const kernels::hip::EmulatedThread& thread, const kernels::hip::SceneArrays& scene,
               const kernels::hip::SceneQuery& query) {
  kernels::hip::scene_answer<kKinds, kDetails>(thread, scene, query);
}

/// Null where there is none of that name.
inline const EmulatedKernel* find_emulated_kernel(const char* name) {
  using namespace kernels::hip;
  static constexpr EmulatedKernel kKernels[] = {
      {"nif_scene_segment", run_scene<kPairSegment, false>},
      {"nif_scene_segment_details", run_scene<kPairSegment, true>},
      {"nif_scene_bvh", run_scene<kBvhObject, false>},
      {"nif_scene_bvh_details", run_scene<kBvhObject, true>},
      {"nif_scene_any", run_scene<kAnyKind, false>},
      {"nif_scene_any_details", run_scene<kAnyKind, true>},
  };
  for (const EmulatedKernel& kernel : kKernels)
    if (std::strcmp(kernel.name, name) == 0) return &kernel;
  return nullptr;
}

}  // namespace nif::test
