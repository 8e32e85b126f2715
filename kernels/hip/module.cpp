// The kernels' entry points: what clang makes a code object of for each AMD target, and nvcc for each NVIDIA
// one.
#include "kernels/hip/scene_kernels.hpp"
#include "kernels/hip/spherical_half_kernels.hpp"

using namespace nif::kernels;
using namespace nif::kernels::hip;

#define NIF_SEGMENT_KERNELS(suffix, features, blocks)                                              \
  NIF_KERNEL(kWholeThreads, 1)                                                                     \
  nif_segment_whole_##suffix(NIF_ARGUMENT SegmentField field, NIF_ARGUMENT SegmentLayout layout,   \
                             NIF_ARGUMENT RayArrays rays, NIF_ARGUMENT RayList list,               \
                             NIF_ARGUMENT AnswerArrays answers) {                                  \
    segment_whole<features>(DeviceThread(), field, layout, rays, list, answers);                   \
  }                                                                                                \
  NIF_KERNEL(kBlockThreads, blocks)                                                                \
  nif_segment_network_##suffix(NIF_ARGUMENT SegmentField field, NIF_ARGUMENT SegmentLayout layout, \
                               NIF_ARGUMENT RayArrays rays, NIF_ARGUMENT OpenItems items,          \
                               NIF_ARGUMENT AnswerArrays answers) {                                \
    segment_network<DeviceMatrix, features>(DeviceThread(), field, layout, rays, items, answers);  \
  }

NIF_SEGMENT_KERNELS(2, 2, 6)    // of two features a corner, as the baker makes them
NIF_SEGMENT_KERNELS(any, 0, 1)  // of any number

NIF_KERNEL(kBlockThreads, 1)
nif_segment_walk(NIF_ARGUMENT SegmentField field, NIF_ARGUMENT RayArrays rays, NIF_ARGUMENT OpenItems items,
                 NIF_ARGUMENT AnswerArrays answers) {
  segment_walk(DeviceThread(), field, rays, items, answers);
}

NIF_KERNEL(kBvhThreads, 1)
nif_bvh(NIF_ARGUMENT BvhField field, NIF_ARGUMENT RayArrays rays, NIF_ARGUMENT RayList list,
        NIF_ARGUMENT AnswerArrays answers) {
  bvh_answer(DeviceThread(), field, rays, list, answers);
}

NIF_KERNEL(kSphericalThreads, 1)
nif_spherical(NIF_ARGUMENT SphericalField field, NIF_ARGUMENT SphericalLayout layout,
              NIF_ARGUMENT RayArrays rays, NIF_ARGUMENT RayList list, NIF_ARGUMENT AnswerArrays answers) {
  spherical_answer(DeviceThread(), field, layout, rays, list, answers);
}

NIF_KERNEL(kBlockThreads, 1)
nif_spherical_cast(NIF_ARGUMENT SphericalBounds bounds, NIF_ARGUMENT RayArrays rays,
                   NIF_ARGUMENT SphericalItems items, NIF_ARGUMENT AnswerArrays answers) {
  spherical_cast(DeviceThread(), bounds, rays, items, answers);
}

#define NIF_SPHERICAL_HALF_KERNEL(kind, width, blocks)                                                   \
  NIF_KERNEL(kHalfThreads, blocks)                                                                       \
  nif_spherical_half_##kind##_##width(                                                                   \
      NIF_ARGUMENT SphericalField field, NIF_ARGUMENT SphericalHalfLayout layout,                        \
      NIF_ARGUMENT SphericalItems items, NIF_ARGUMENT AnswerArrays answers) {                            \
    spherical_half<DeviceHalfMatrix, SphericalKind::kind, width / kTileNeurons>(DeviceThread(), field,   \
                                                                                layout, items, answers); \
  }
NIF_SPHERICAL_HALF_KERNEL(outer, 64, 2)
NIF_SPHERICAL_HALF_KERNEL(inner, 64, 2)
NIF_SPHERICAL_HALF_KERNEL(outer, 96, 1)
NIF_SPHERICAL_HALF_KERNEL(inner, 96, 1)

#define NIF_SCENE_KERNEL(suffix, kinds, details)                                      \
  NIF_KERNEL(kSceneThreads, 1)                                                        \
  nif_scene_##suffix(NIF_ARGUMENT SceneArrays scene, NIF_ARGUMENT SceneQuery query) { \
    scene_answer<kinds, details>(DeviceThread(), scene, query);                       \
  }

NIF_SCENE_KERNEL(segment, kPairSegment, false)
NIF_SCENE_KERNEL(segment_details, kPairSegment, true)
NIF_SCENE_KERNEL(bvh, kBvhObject, false)
NIF_SCENE_KERNEL(bvh_details, kBvhObject, true)
NIF_SCENE_KERNEL(any, kAnyKind, false)
NIF_SCENE_KERNEL(any_details, kAnyKind, true)
