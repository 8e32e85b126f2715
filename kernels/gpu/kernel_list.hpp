// The kernels by name, for all that is done with each: entry points (module.cpp), the emulator's table, and
// what the GPU module asks a driver for.
#pragma once

#include "kernels/gpu/encodings.hpp"

/// KERNEL(name, kinds, blocks): nif_scene_NAME and nif_scene_NAME_details, for scenes of these kinds of
/// objects; those for fewer kinds first. `blocks` that an NVIDIA multiprocessor has room for at least, of the
/// kernel without details: with 16 of 64 threads, some of a thread's numbers are in memory in place of
/// registers, and on an H200 rays are a tenth (segment) to a quarter (bvh) faster.
#define NIF_SCENE_KERNELS(KERNEL)   \
  KERNEL(segment, kPairSegment, 16) \
  KERNEL(bvh, kBvhObject, 16)       \
  KERNEL(any, kAnyKind, 8)

/// KERNEL(name, kinds, blocks): nif_pipeline_walk_NAME and nif_pipeline_walk_NAME_details likewise.
#define NIF_WALK_KERNELS(KERNEL) \
  KERNEL(segment, kSegments, 6)  \
  KERNEL(any, kAnyKind, 1)

/// STAGE(number, name, threads, blocks, inner, function): the kernel nif_pipeline_NAME answers the items of a
/// stage's lists. `threads` of a block; `blocks` that an NVIDIA multiprocessor has room for at least;
/// `inner`: as which networks it is measured; the function may name Matrix and HalfMatrix, those of the
/// target. The last stage is for items without such a kernel: a thread asks each.
#define NIF_PIPELINE_STAGES(STAGE) \
  NIF_NETWORK_STAGES(STAGE)        \
  STAGE(kAlone, alone, kSceneThreads, 1, false, pipeline_alone)

namespace nif::kernels::gpu {

/// What answers the items of a list: a kernel for each.
enum Stage : uint32_t {
#define NIF_STAGE(number, ...) number,
  NIF_PIPELINE_STAGES(NIF_STAGE)
#undef NIF_STAGE
      kStages
};

}  // namespace nif::kernels::gpu
