// The kernels' entry points. clang compiles this to a code object for each AMD target, and nvcc for each
// NVIDIA target. Each entry point takes one structure.
#include "kernels/gpu/hit_kernels.hpp"
#include "kernels/gpu/kernel_list.hpp"
#include "kernels/gpu/open_kernels.hpp"
#include "kernels/gpu/pipeline_kernels.hpp"
#include "kernels/gpu/traverse_one_kernels.hpp"

using namespace nif::kernels;
using namespace nif::kernels::gpu;
using Matrix = DeviceMatrix;
using HalfMatrix = DeviceHalfMatrix;

#define NIF_ENTRY(threads, blocks, name, Work, ...) \
  NIF_KERNEL(threads, blocks) name(NIF_ARGUMENT Work work) { __VA_ARGS__(DeviceThread(), work); }

#define NIF_SCENE(name, kinds, blocks)                                                      \
  NIF_ENTRY(kSceneThreads, blocks, nif_scene_##name, SceneWork, scene_answer<kinds, false>) \
  NIF_ENTRY(kSceneThreads, 1, nif_scene_##name##_details, SceneWork, scene_answer<kinds, true>)
#define NIF_TRAVERSE(name, kinds, blocks)                                           \
  NIF_ENTRY(kBlockThreads, blocks, nif_pipeline_traverse_##name, PipelineWork,      \
            pipeline_traverse<kinds, false>)                                        \
  NIF_ENTRY(kBlockThreads, 1, nif_pipeline_traverse_##name##_details, PipelineWork, \
            pipeline_traverse<kinds, true>)
#define NIF_STAGE(number, name, threads, blocks, inner, ...) \
  NIF_ENTRY(threads, blocks, nif_pipeline_##name, PipelineWork, __VA_ARGS__)

NIF_SCENE_KERNELS(NIF_SCENE)
NIF_TRAVERSAL_KERNELS(NIF_TRAVERSE)
NIF_PIPELINE_STAGES(NIF_STAGE)
NIF_ENTRY(kSceneThreads, 16, nif_scene_bvh_single, SceneWork,
          scene_answer<kSingleBvh, false>)  // for measurements
NIF_ENTRY(kSceneThreads, 1, nif_scene_open, OpenWork, scene_open<kAnyKind>)
NIF_ENTRY(kSceneThreads, 1, nif_scene_open_holes, OpenWork, scene_open<kEveryKind>)
NIF_ENTRY(kSceneThreads, 8, nif_scene_hits, HitWork, scene_hits<kAnyKind>)
NIF_ENTRY(kSceneThreads, 1, nif_scene_hits_holes, HitWork, scene_hits<kEveryKind>)
NIF_ENTRY(kBlockThreads, 6, nif_pipeline_traverse_one, PipelineWork, pipeline_traverse_one<false>)
NIF_ENTRY(kBlockThreads, 1, nif_pipeline_traverse_one_details, PipelineWork, pipeline_traverse_one<true>)
NIF_ENTRY(kBlockThreads, 1, nif_pipeline_offsets, PipelineWork, pipeline_offsets)
NIF_ENTRY(kBlockThreads, 1, nif_pipeline_order, PipelineWork, pipeline_order)
NIF_ENTRY(kBlockThreads, 1, nif_pack_bits, PackWork, pack_bits)
