// Most of the table is made by macros from the GPU module's own lists of kernels, so a kernel that is
// added there is emulated, too. A few that are in no list stand here by name.
#include "tests/gpu/emulator/kernels.hpp"

#include <algorithm>
#include <iterator>

namespace nif::test {
namespace {

using namespace kernels::gpu;
using kernels::SphericalKind;
using Thread = EmulatedThread;

/// kRun(thread, work) is the kernel.
template <class Work, auto kRun>
EmulatedRun bind_kernel(const void* argument) {
  return [work = *static_cast<const Work*>(argument)](const Thread& thread) { kRun(thread, work); };
}
#define NIF_EMULATED(name, Work, ...) \
  {name, bind_kernel<Work, [](const Thread& thread, const Work& work) { __VA_ARGS__(thread, work); }>},
#define NIF_SCENE(name, kinds, blocks)                                    \
  NIF_EMULATED("nif_scene_" #name, SceneWork, scene_answer<kinds, false>) \
  NIF_EMULATED("nif_scene_" #name "_details", SceneWork, scene_answer<kinds, true>)
#define NIF_TRAVERSE(name, kinds, blocks)                                                     \
  NIF_EMULATED("nif_pipeline_traverse_" #name, PipelineWork, pipeline_traverse<kinds, false>) \
  NIF_EMULATED("nif_pipeline_traverse_" #name "_details", PipelineWork, pipeline_traverse<kinds, true>)
#define NIF_STAGE(number, name, threads, blocks, inner, ...) \
  NIF_EMULATED("nif_pipeline_" #name, PipelineWork, __VA_ARGS__)

constexpr EmulatedKernel kKernels[] = {
    NIF_SCENE_KERNELS(NIF_SCENE)                                                                  //
    NIF_TRAVERSAL_KERNELS(NIF_TRAVERSE)                                                           //
    NIF_EMULATED("nif_scene_bvh_single", SceneWork, scene_answer<kSingleBvh, false>)              //
    NIF_EMULATED("nif_scene_open", OpenWork, scene_open<kAnyKind>)                                //
    NIF_EMULATED("nif_scene_open_holes", OpenWork, scene_open<kEveryKind>)                        //
    NIF_EMULATED("nif_scene_hits", HitWork, scene_hits<kAnyKind>)                                 //
    NIF_EMULATED("nif_scene_hits_holes", HitWork, scene_hits<kEveryKind>)                         //
    NIF_EMULATED("nif_pipeline_traverse_one", PipelineWork, pipeline_traverse_one<false>)         //
    NIF_EMULATED("nif_pipeline_traverse_one_details", PipelineWork, pipeline_traverse_one<true>)  //
    NIF_EMULATED("nif_pipeline_offsets", PipelineWork, pipeline_offsets)                          //
    NIF_EMULATED("nif_pipeline_order", PipelineWork, pipeline_order)                              //
    NIF_EMULATED("nif_pack_bits", PackWork, pack_bits)};

/// Those of stages, for one make of matrix instructions.
template <class Matrix, class HalfMatrix>
constexpr EmulatedKernel kStageKernels[] = {NIF_PIPELINE_STAGES(NIF_STAGE)};

const EmulatedKernel* find(std::span<const EmulatedKernel> kernels, std::string_view name) {
  const auto at = std::find_if(kernels.begin(), kernels.end(),
                               [&](const EmulatedKernel& kernel) { return kernel.name == name; });
  return at == kernels.end() ? nullptr : &*at;
}

std::span<const EmulatedKernel> stages(MatrixKind kind) {
  switch (kind) {
    case MatrixKind::wmma:
      return kStageKernels<WmmaMatrix, WmmaHalfMatrix>;
    case MatrixKind::imma:
      return kStageKernels<ImmaMatrix, MmaHalfMatrix>;
    case MatrixKind::mfma16:
      return kStageKernels<Mfma16Matrix, MfmaHalfMatrix>;
    case MatrixKind::mfma32:
      return kStageKernels<Mfma32Matrix, MfmaHalfMatrix>;
    case MatrixKind::dot32:
    case MatrixKind::dot64:
      break;
  }
  return kStageKernels<DotMatrix, DotHalfMatrix>;
}

}  // namespace

const EmulatedKernel* find_emulated_kernel(std::string_view name, MatrixKind kind) {
  const EmulatedKernel* kernel = find(kKernels, name);
  return kernel ? kernel : find(stages(kind), name);
}

}  // namespace nif::test
