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
#define NIF_EMULATED(name, Work, ...)                                                                  \
  {                                                                                                    \
    name, bind_kernel<Work, [](const Thread& thread, const Work& work) { __VA_ARGS__(thread, work); }> \
  }

constexpr EmulatedKernel kKernels[] = {
    NIF_EMULATED("nif_scene_segment", SceneWork, scene_answer<kPairSegment, false>),
    NIF_EMULATED("nif_scene_segment_details", SceneWork, scene_answer<kPairSegment, true>),
    NIF_EMULATED("nif_scene_bvh", SceneWork, scene_answer<kBvhObject, false>),
    NIF_EMULATED("nif_scene_bvh_details", SceneWork, scene_answer<kBvhObject, true>),
    NIF_EMULATED("nif_scene_bvh_single", SceneWork, scene_answer<kSingleBvh, false>),
    NIF_EMULATED("nif_scene_any", SceneWork, scene_answer<kAnyKind, false>),
    NIF_EMULATED("nif_scene_any_details", SceneWork, scene_answer<kAnyKind, true>),
    NIF_EMULATED("nif_pipeline_walk_segment", PipelineWork, pipeline_walk<kSegments, false>),
    NIF_EMULATED("nif_pipeline_walk_segment_details", PipelineWork, pipeline_walk<kSegments, true>),
    NIF_EMULATED("nif_pipeline_walk_any", PipelineWork, pipeline_walk<kAnyKind, false>),
    NIF_EMULATED("nif_pipeline_walk_any_details", PipelineWork, pipeline_walk<kAnyKind, true>),
    NIF_EMULATED("nif_pipeline_offsets", PipelineWork, pipeline_offsets),
    NIF_EMULATED("nif_pipeline_order", PipelineWork, pipeline_order),
    NIF_EMULATED("nif_pipeline_alone", PipelineWork, pipeline_alone),
    NIF_EMULATED("nif_pack_bits", PackWork, pack_bits),
};

/// Those of networks, for one make of matrix instructions.
template <class Matrix, class HalfMatrix>
constexpr EmulatedKernel kNetworks[] = {
    NIF_EMULATED("nif_pipeline_segment_2", PipelineWork, pipeline_segments<Matrix, 2>),
    NIF_EMULATED("nif_pipeline_segment_any", PipelineWork, pipeline_segments<Matrix, 0>),
    NIF_EMULATED("nif_pipeline_half_outer_64", PipelineWork,
                 pipeline_halves<HalfMatrix, SphericalKind::outer, kHalfTiles>),
    NIF_EMULATED("nif_pipeline_half_inner_64", PipelineWork,
                 pipeline_halves<HalfMatrix, SphericalKind::inner, kHalfTiles>),
    NIF_EMULATED("nif_pipeline_half_outer_96", PipelineWork,
                 pipeline_halves<HalfMatrix, SphericalKind::outer, kMostHalfTiles>),
    NIF_EMULATED("nif_pipeline_half_inner_96", PipelineWork,
                 pipeline_halves<HalfMatrix, SphericalKind::inner, kMostHalfTiles>),
};

const EmulatedKernel* find(std::span<const EmulatedKernel> kernels, std::string_view name) {
  const auto at = std::find_if(kernels.begin(), kernels.end(),
                               [&](const EmulatedKernel& kernel) { return kernel.name == name; });
  return at == kernels.end() ? nullptr : &*at;
}

std::span<const EmulatedKernel> networks(MatrixKind kind) {
  switch (kind) {
    case MatrixKind::wmma:
      return kNetworks<WmmaMatrix, WmmaHalfMatrix>;
    case MatrixKind::imma:
      return kNetworks<ImmaMatrix, MmaHalfMatrix>;
    case MatrixKind::mfma16:
      return kNetworks<Mfma16Matrix, MfmaHalfMatrix>;
    case MatrixKind::mfma32:
      return kNetworks<Mfma32Matrix, MfmaHalfMatrix>;
    case MatrixKind::dot32:
    case MatrixKind::dot64:
      break;
  }
  return kNetworks<DotMatrix, DotHalfMatrix>;
}

}  // namespace

const EmulatedKernel* find_emulated_kernel(std::string_view name, MatrixKind kind) {
  const EmulatedKernel* kernel = find(kKernels, name);
  return kernel ? kernel : find(networks(kind), name);
}

}  // namespace nif::test
