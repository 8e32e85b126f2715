// What crosses from the runtime to its GPU module and back, member by member (layout.hpp).
#pragma once

#include "gpu/layout.hpp"
#include "gpu/module.hpp"

namespace nif::runtime {

/// Everything that is reached from the arguments of GpuModule's functions.
constexpr uint64_t gpu_layout() {
  LayoutHash hash;
  hash.number(sizeof(GpuModule));
  hash.structure<GpuMessage>({&GpuMessage::text});
  hash.structure<GpuCard>(
      {&GpuCard::name, &GpuCard::target, &GpuCard::driver, &GpuCard::memory, &GpuCard::trouble});
  hash.structure<GpuSettings>({&GpuSettings::way, &GpuSettings::half});
  hash.structure<GpuObjectView>({&GpuObjectView::logit_scale, &GpuObjectView::reach_scale,
                                 &GpuObjectView::segment, &GpuObjectView::bvh, &GpuObjectView::spherical});
  hash.structure<GpuPlacedObject>({&GpuPlacedObject::asset, &GpuPlacedObject::object});
  hash.structure<GpuSceneView>({&GpuSceneView::nodes, &GpuSceneView::instances, &GpuSceneView::objects,
                                &GpuSceneView::node_count, &GpuSceneView::instance_count,
                                &GpuSceneView::object_count});
  hash.number(sizeof(GpuMeasure));
  hash.number(kMeasuredStages);

  using kernels::PlacedInstance;
  using kernels::TopNode;
  using kernels::WorldToObject;
  hash.structure<TopNode>({&TopNode::min, &TopNode::max, &TopNode::child, &TopNode::lanes, &TopNode::parent});
  hash.structure<WorldToObject>({&WorldToObject::inverse, &WorldToObject::translation});
  hash.structure<PlacedInstance>(
      {&PlacedInstance::to_object, LayoutHash::part<uint32_t>() /* bit fields */, &PlacedInstance::place});
  hash.structure<NifQuery>({&NifQuery::struct_size,   &NifQuery::count,       &NifQuery::origin,
                            &NifQuery::origin_stride, &NifQuery::direction,   &NifQuery::direction_stride,
                            &NifQuery::tmin,          &NifQuery::tmin_stride, &NifQuery::tmax,
                            &NifQuery::tmax_stride,   &NifQuery::visible,     &NifQuery::visible_bits,
                            &NifQuery::probability,   &NifQuery::certain,     &NifQuery::logit,
                            &NifQuery::memory,        &NifQuery::reserved,    &NifQuery::scratch,
                            &NifQuery::scratch_bytes, &NifQuery::stream});

  using kernels::SegmentField;
  using Layer = kernels::Network::Layer;
  hash.structure<Layer>({&Layer::inputs, &Layer::outputs, &Layer::shift, &Layer::weights, &Layer::biases});
  hash.structure<kernels::Network>(
      {&kernels::Network::layer_count, &kernels::Network::layers, &kernels::Network::logit_scale});
  hash.structure<kernels::BrickStates>({&kernels::BrickStates::surface, &kernels::BrickStates::aux});
  hash.structure<SegmentField>(
      {&SegmentField::origin, &SegmentField::voxels_per_unit, &SegmentField::voxels, &SegmentField::bricks,
       &SegmentField::brick_table, &SegmentField::brick_states, &SegmentField::brick_corners,
       &SegmentField::corner_base, &SegmentField::mixed_bricks, &SegmentField::features,
       &SegmentField::corners, &SegmentField::features_per_corner, &SegmentField::samples,
       &SegmentField::length_scale, &SegmentField::network});

  using kernels::SphericalField;
  using kernels::SphericalGrid;
  using kernels::SphericalNetwork;
  using Bounds = kernels::SphericalBounds;
  using Values = kernels::SphericalValues;
  hash.structure<Values>({&Values::data, &Values::half});
  hash.structure<SphericalGrid>(
      {&SphericalGrid::values, &SphericalGrid::resolution, &SphericalGrid::features});
  hash.structure<SphericalNetwork>({&SphericalNetwork::weights, &SphericalNetwork::inputs,
                                    &SphericalNetwork::width, &SphericalNetwork::hidden_layers,
                                    &SphericalNetwork::outputs});
  hash.structure<Bounds>({&Bounds::low, &Bounds::high, &Bounds::centre, &Bounds::distance_scale,
                          &Bounds::margin, &Bounds::extent, &Bounds::reach_scale});
  hash.structure<SphericalField>({LayoutHash::part<Bounds>(), &SphericalField::outer_position,
                                  &SphericalField::outer_direction, &SphericalField::inner_position,
                                  &SphericalField::inner_direction, &SphericalField::distance,
                                  &SphericalField::outer, &SphericalField::inner, &SphericalField::slope});

  using kernels::BvhField;
  using kernels::BvhNode;
  hash.structure<BvhNode>({&BvhNode::frame, &BvhNode::first_node, &BvhNode::first_triangle,
                           &BvhNode::first_vertex, &BvhNode::slots, &BvhNode::low, &BvhNode::high});
  hash.structure<BvhField>({&BvhField::nodes, &BvhField::vertices, &BvhField::triangles,
                            &BvhField::node_count, &BvhField::vertex_count, &BvhField::triangle_count,
                            &BvhField::extent});
  return hash.value();
}

inline constexpr uint64_t kGpuLayout = gpu_layout();

}  // namespace nif::runtime
