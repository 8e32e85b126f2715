// Lists the kernels by name, for everything that is done with each: entry points (module.cpp), the emulator's
// table, and what the GPU module loads from a driver.
#pragma once

#include "kernels/gpu/gpu_encodings.hpp"

/// KERNEL(name, kinds, blocks): nif_scene_NAME and nif_scene_NAME_details, for scenes of these kinds of
/// objects; kernels for fewer kinds come first. `blocks`: minimum resident blocks per NVIDIA multiprocessor,
/// for the kernel without details. With 16 blocks of 64 threads, some of a thread's registers spill to
/// memory, and on an H200 rays are a tenth (segment) to a quarter (bvh) faster.
#define NIF_SCENE_KERNELS(KERNEL)   \
  KERNEL(segment, kPairSegment, 16) \
  KERNEL(bvh, kBvhObject, 16)       \
  KERNEL(any, kAnyKind, 8)          \
  KERNEL(holes, kEveryKind, 1)

/// KERNEL(name, kinds, blocks): nif_pipeline_traverse_NAME and nif_pipeline_traverse_NAME_details, likewise.
#define NIF_TRAVERSAL_KERNELS(KERNEL) \
  KERNEL(segment, kSegments, 6)       \
  KERNEL(any, kAnyKind, 1)            \
  KERNEL(holes, kEveryKind, 1)

/// STAGE(number, name, threads, blocks, inner, function): the kernel nif_pipeline_NAME answers the items of a
/// stage's lists. `threads`: block size; `blocks`: minimum resident blocks per NVIDIA multiprocessor;
/// `inner`: the networks as which it is measured; the function may name Matrix and HalfMatrix, those of the
/// target. The last stage is for items without such a kernel: one thread answers each.
#define NIF_PIPELINE_STAGES(STAGE) \
  NIF_NETWORK_STAGES(STAGE)        \
  STAGE(kAlone, alone, kSceneThreads, 1, false, pipeline_alone)

namespace nif::kernels::gpu {

/// What answers the items of a list: one kernel each.
enum Stage : uint32_t {
#define NIF_STAGE(number, ...) number,
  NIF_PIPELINE_STAGES(NIF_STAGE)
#undef NIF_STAGE
      kStages
};

}  // namespace nif::kernels::gpu
