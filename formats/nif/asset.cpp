// Turns the view of a loaded file back into an asset that owns its memory. `nif validate` writes that again
// to see whether the bytes are the same.
#include "formats/nif/asset.hpp"

#include "formats/nif/writer.hpp"

namespace nif::format {

kernels::AnyField field_of(const Asset& asset, const Object& object) {
  kernels::PlanesField planes;
  kernels::TrianglesField triangles;
  kernels::NetworkField network;
  kernels::SphericalField spherical;
  if (object.planes) planes = field_of(*object.planes);
  if (object.triangles) triangles = field_of(*object.triangles);
  if (object.network) network = field_of(*object.network, asset.mlps.at(object.network->mlp), planes);
  if (object.spherical)
    spherical = field_of(object.spherical->grids, asset.spherical_networks.at(object.spherical->network),
                         object.bounds());
  return kernels::join_parts(object.planes ? &planes : nullptr, object.triangles ? &triangles : nullptr,
                             object.network ? &network : nullptr, object.spherical ? &spherical : nullptr);
}

kernels::SegmentField field_of(const Object& object, const Mlp& mlp) {
  const kernels::PlanesField planes = field_of(*object.planes);
  return {planes, field_of(*object.network, mlp, planes)};
}

Asset to_asset(const AssetView& view) {
  Asset asset;
  asset.metadata = view.metadata;
  asset.places_nothing = view.places_nothing;
  asset.prover = view.prover;
  for (const SectionView& section : view.sections)
    if (!known_section(section.type) && (section.flags & kKeep))
      asset.kept.push_back(
          {section.type, section.flags, section.record_size, {section.bytes.begin(), section.bytes.end()}});
  for (const MlpView& from : view.mlps) asset.mlps.push_back(to_mlp(from));
  for (const SphericalNetworksView& from : view.spherical_networks)
    asset.spherical_networks.push_back(to_networks(from));
  for (const ObjectView& from : view.objects) {
    if (from.unsupported)
      throw Error(Status::unsupported_nif, "object '" + std::string(from.name) + "' " + from.unsupported);
    Object& object = asset.objects.emplace_back();
    object.name = from.name;
    object.aabb_min = from.aabb_min;
    object.aabb_max = from.aabb_max;
    object.bias = from.bias;
    object.triangle_count = from.triangle_count;
    object.level = from.level;
    object.error = from.error;
    if (from.planes) object.planes = to_data(*from.planes);
    if (from.triangles) object.triangles = to_data(*from.triangles);
    if (from.network) object.network = to_data(*from.network, from.planes->field);
    if (from.spherical) object.spherical = to_data(*from.spherical);
  }
  for (const PrimaryView& from : view.primaries) asset.objects[from.object].primary = to_primary(from);
  for (const NumbersView& from : view.numbers)
    asset.objects[from.object].numbers[from.kind] = to_numbers(from);
  for (const ColorsView& from : view.colors) asset.objects[from.object].colors = to_colors(from);
  for (const InstanceView& from : view.instances)
    asset.instances.push_back({std::string(from.name), from.object, from.transform, from.remainder, from.user,
                               from.mask, from.flags, from.parent});
  return asset;
}

}  // namespace nif::format
