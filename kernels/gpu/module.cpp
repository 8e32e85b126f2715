// The kernels' entry points: what clang makes a code object of for each AMD target, and nvcc for each NVIDIA
// one. Each takes one structure.
#include "kernels/gpu/pipeline_kernels.hpp"

using namespace nif::kernels;
using namespace nif::kernels::gpu;

#define NIF_SCENE_KERNEL(suffix, kinds, details)                                 \
  NIF_KERNEL(kSceneThreads, 1) nif_scene_##suffix(NIF_ARGUMENT SceneWork work) { \
    scene_answer<kinds, details>(DeviceThread(), work);                          \
  }
#define NIF_PIPELINE_KERNEL(threads, blocks, name, ...)                             \
  NIF_KERNEL(threads, blocks) nif_pipeline_##name(NIF_ARGUMENT PipelineWork work) { \
    __VA_ARGS__(DeviceThread(), work);                                              \
  }

NIF_SCENE_KERNEL(segment, kPairSegment, false)
NIF_SCENE_KERNEL(segment_details, kPairSegment, true)
NIF_SCENE_KERNEL(bvh, kBvhObject, false)
NIF_SCENE_KERNEL(bvh_details, kBvhObject, true)
NIF_SCENE_KERNEL(bvh_single, kSingleBvh, false)  // for measurements alone
NIF_SCENE_KERNEL(any, kAnyKind, false)
NIF_SCENE_KERNEL(any_details, kAnyKind, true)

NIF_PIPELINE_KERNEL(kBlockThreads, 1, walk_segment, pipeline_walk<kSegments, false>)
NIF_PIPELINE_KERNEL(kBlockThreads, 1, walk_segment_details, pipeline_walk<kSegments, true>)
NIF_PIPELINE_KERNEL(kBlockThreads, 1, walk_any, pipeline_walk<kAnyKind, false>)
NIF_PIPELINE_KERNEL(kBlockThreads, 1, walk_any_details, pipeline_walk<kAnyKind, true>)
NIF_PIPELINE_KERNEL(kBlockThreads, 1, offsets, pipeline_offsets)
NIF_PIPELINE_KERNEL(kBlockThreads, 1, order, pipeline_order)
NIF_PIPELINE_KERNEL(kBlockThreads, 6, segment_2, pipeline_segments<DeviceMatrix, 2>)
NIF_PIPELINE_KERNEL(kBlockThreads, 1, segment_any, pipeline_segments<DeviceMatrix, 0>)
NIF_PIPELINE_KERNEL(kSceneThreads, 1, alone, pipeline_alone)

#define NIF_HALF_KERNEL(kind, name, tiles, blocks)       \
  NIF_PIPELINE_KERNEL(kHalfThreads, blocks, half_##name, \
                      pipeline_halves<DeviceHalfMatrix, SphericalKind::kind, tiles>)
NIF_HALF_KERNEL(outer, outer_64, kHalfTiles, 2)
NIF_HALF_KERNEL(inner, inner_64, kHalfTiles, 2)
NIF_HALF_KERNEL(outer, outer_96, kMostHalfTiles, 1)
NIF_HALF_KERNEL(inner, inner_96, kMostHalfTiles, 1)

NIF_KERNEL(kBlockThreads, 1) nif_pack_bits(NIF_ARGUMENT PackWork work) { pack_bits(DeviceThread(), work); }
