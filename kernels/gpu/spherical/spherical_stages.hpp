// The pipeline's stages for the `spherical` encoding: items from coordinates, and their networks in half
// precision.
#pragma once

#include "kernels/gpu/pipeline_work.hpp"
#include "kernels/gpu/spherical/half_kernels.hpp"

namespace nif::kernels::gpu {

inline constexpr uint32_t kItemCoordinates = 5;
static_assert(kItemCoordinates <= kItemWords);

/// Finds the network for a ray. Returns false if there is one: then `item`, of the second sort for the inner
/// network, has the ray's coordinates.
NIF_HOST_DEVICE NIF_INLINE bool traverse_spherical_item(const SceneObject& object, const Segment& ray,
                                                        uint32_t* column, OpenItem& item,
                                                        ObjectAnswer& answer) {
  const SphericalRay spherical = prepare_spherical(*static_cast<const SphericalField*>(object.field), ray);
  if (spherical.kind == SphericalKind::none) {
    answer = {kCertainLogit, spherical.certain};
    return true;
  }
  const bool inner = spherical.kind == SphericalKind::inner;
  const SphericalCoordinates& at = spherical.at;
  item.list = object.lists[inner];
  item.about = 0;
  item.words = inner ? kItemCoordinates : kItemCoordinates - 1;
  column[0] = bits_as<uint32_t>(at.position_theta);
  column[kBlockThreads] = bits_as<uint32_t>(at.position_phi);
  column[2 * kBlockThreads] = bits_as<uint32_t>(at.direction_theta);
  column[3 * kBlockThreads] = bits_as<uint32_t>(at.direction_phi);
  column[4 * kBlockThreads] = bits_as<uint32_t>(at.distance);
  return false;
}

/// Evaluates the networks of `spherical` objects in half precision, the outer or the inner ones. Any number
/// of blocks of kHalfThreads.
template <class Matrix, SphericalKind kKind, uint32_t kTiles, class Thread>
NIF_HOST_DEVICE void pipeline_halves(const Thread& thread, const PipelineWork& work) {
  constexpr bool kOuter = kKind == SphericalKind::outer;
  const auto layout_of = [&](uint32_t list) -> const HalfNetworkLayout& {
    const auto& layout = work.lists[list].layout_as<SphericalHalfLayout>();
    return kOuter ? layout.outer : layout.inner;
  };
  const auto field_of = [&](uint32_t list) -> const SphericalField& {
    return *static_cast<const SphericalField*>(work.lists[list].field);
  };
  const auto begin = [&](uint32_t list) {
    load_half_network(thread, kOuter ? field_of(list).outer : field_of(list).inner, layout_of(list));
  };
  const uint32_t wave = thread.wave_size(), first = thread.wave() * wave;
  for_each_tile<kHalfThreads>(thread, work, begin, [&](const PipelineTile& tile) {
    if (first >= tile.count) return;
    const HalfNetworkLayout& layout = layout_of(tile.list);
    const SphericalField& field = field_of(tile.list);
    const SphericalNetwork& network = kOuter ? field.outer : field.inner;
    unsigned char* const rows = thread.shared() + layout.inputs_offset + first * layout.first_stride;
    const bool present = thread.lane() < tile.count - first;
    const uint32_t item = present ? tile.item(work.memory, first + thread.lane()) : 0;
    if (present) {
      const auto coordinate = [&](uint32_t i) {
        return bits_as<float>(work.memory.words[size_t(i) * work.memory.capacity + item]);
      };
      const SphericalRay ray{
          kKind,
          false,
          0,
          {coordinate(0), coordinate(1), coordinate(2), coordinate(3), kOuter ? 0.0f : coordinate(4)}};
      put_half_inputs(field, ray, network.inputs, rows + thread.lane() * layout.first_stride);
    }
    if (work.inputs_alone) return;
    const float output = evaluate_half_wave<Matrix, kTiles>(thread, network, layout, field.slope, rows);
    if (present) deliver(work, item, spherical_logit(output));
  });
}

}  // namespace nif::kernels::gpu
