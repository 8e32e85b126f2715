// Lists every structure that the runtime and its GPU module exchange, member by member, so that two binaries
// can check that they agree on them (layout.hpp).
#pragma once

#include <type_traits>
#include <variant>

#include "gpu/layout.hpp"
#include "gpu/module.hpp"
#include "kernels/gpu/gpu_encodings.hpp"

namespace nif::runtime {

template <class... Field>
constexpr void describe_fields(LayoutHash& hash, std::type_identity<std::variant<Field...>>) {
  (kernels::gpu::GpuEncodingOf<Field>::Encoding::describe(hash), ...);
}

/// Covers everything reachable from the arguments of GpuModule's functions.
constexpr uint64_t gpu_layout() {
  LayoutHash hash;
  hash.number(sizeof(GpuModule));
  hash.structure<GpuMessage>({&GpuMessage::text});
  hash.structure<GpuLocation>({&GpuLocation::pci_domain, &GpuLocation::pci_bus, &GpuLocation::pci_device,
                               &GpuLocation::has_luid, &GpuLocation::uuid, &GpuLocation::luid});
  hash.structure<GpuDescription>({&GpuDescription::backend, &GpuDescription::name, &GpuDescription::target,
                                  &GpuDescription::driver, &GpuDescription::memory, &GpuDescription::place,
                                  &GpuDescription::trouble});
  hash.structure<GpuSettings>({&GpuSettings::way, &GpuSettings::half});
  hash.structure<FetchedArray>({&FetchedArray::array, &FetchedArray::bytes, &FetchedArray::name});
  hash.structure<GpuPlacedObject>(
      {&GpuPlacedObject::asset, &GpuPlacedObject::object, &GpuPlacedObject::number});
  hash.structure<GpuSceneView>({&GpuSceneView::nodes, &GpuSceneView::instances, &GpuSceneView::users,
                                &GpuSceneView::objects, &GpuSceneView::node_count,
                                &GpuSceneView::instance_count, &GpuSceneView::object_count,
                                &GpuSceneView::sole, &GpuSceneView::unproven});
  hash.number(sizeof(GpuMeasure));
  hash.number(kMeasuredStages);

  using kernels::PlacedInstance;
  using kernels::TopNode;
  using kernels::WorldToObject;
  hash.structure<TopNode>({&TopNode::min, &TopNode::max, &TopNode::child, &TopNode::lanes, &TopNode::parent,
                           &TopNode::near_first});
  hash.structure<WorldToObject>(
      {&WorldToObject::inverse, &WorldToObject::translation, &WorldToObject::remainder});
  hash.structure<PlacedInstance>({&PlacedInstance::to_object, LayoutHash::part<uint32_t>() /* bit fields */,
                                  &PlacedInstance::place, &PlacedInstance::mask});
  hash.structure<NifRays>({&NifRays::struct_size, &NifRays::count, &NifRays::origin, &NifRays::origin_stride,
                           &NifRays::direction, &NifRays::direction_stride, &NifRays::tmin,
                           &NifRays::tmin_stride, &NifRays::tmax, &NifRays::tmax_stride, &NifRays::mask,
                           &NifRays::mask_stride, &NifRays::memory, &NifRays::flags, &NifRays::scratch,
                           &NifRays::scratch_bytes, &NifRays::stream});
  hash.structure<NifAnswers>({&NifAnswers::struct_size, &NifAnswers::visible, &NifAnswers::visible_bits,
                              &NifAnswers::probability, &NifAnswers::certain, &NifAnswers::logit});
  hash.structure<NifOpenRays>({&NifOpenRays::struct_size, &NifOpenRays::capacity, &NifOpenRays::rays,
                               &NifOpenRays::tmin, &NifOpenRays::tmax, &NifOpenRays::count,
                               &NifOpenRays::instance});

  hash.structure<NifHits>({&NifHits::struct_size, &NifHits::hit, &NifHits::t, &NifHits::normal,
                           &NifHits::instance, &NifHits::object, &NifHits::triangle, &NifHits::u, &NifHits::v,
                           &NifHits::certain, &NifHits::t_low, &NifHits::t_high, &NifHits::color,
                           &NifHits::user});

  using kernels::HitDetails;
  using kernels::SourceTriangles;
  using kernels::VoxelColors;
  hash.structure<SourceTriangles>({&SourceTriangles::words, &SourceTriangles::bits, &SourceTriangles::count});
  hash.structure<VoxelColors>({&VoxelColors::grid, &VoxelColors::values});
  hash.structure<HitDetails>({&HitDetails::source_triangles, &HitDetails::colors});

  hash.number(sizeof(kernels::AnyField));
  hash.number(alignof(kernels::AnyField));
  describe_fields(hash, std::type_identity<kernels::AnyField>());
  return hash.value();
}

inline constexpr uint64_t kGpuLayout = gpu_layout();

}  // namespace nif::runtime
