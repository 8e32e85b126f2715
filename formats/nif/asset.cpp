// Turns the view of a loaded file back into an asset that owns its memory. `nif validate` writes that again
// to see whether the bytes are the same.
#include "formats/nif/asset.hpp"

#include "formats/nif/writer.hpp"

namespace nif::format {

namespace {

// A part's field, and a part as its data. Some take more than the part.
template <class Data>
auto field_in(const Asset&, const Object&, const Data& data) {
  return field_of(data);
}
kernels::NetworkField field_in(const Asset& asset, const Object& object, const NetworkData& data) {
  return field_of(data, asset.mlps.at(data.mlp), field_of(*object.planes));
}
kernels::SphericalField field_in(const Asset& asset, const Object& object, const SphericalData& data) {
  return field_of(data.grids, asset.spherical_networks.at(data.network), object.bounds());
}
kernels::HolesField field_in(const Asset& asset, const Object&, const HolesData& data) {
  return field_of(data, asset.alpha_maps);
}
template <class View>
auto data_in(const ObjectView&, const View& view) {
  return to_data(view);
}
NetworkData data_in(const ObjectView& object, const NetworkView& view) {
  return to_data(view, object.planes->field);
}

}  // namespace

kernels::AnyField field_of(const Asset& asset, const Object& object) {
  return with_all_parts([&]<class... Part>(Part...) {
    std::tuple<std::optional<FieldOf<Part>>...> fields;
    const auto make = [&](auto& field, const auto& data) {
      if (data) field = field_in(asset, object, *data);
      return field ? &*field : nullptr;
    };
    return kernels::join_parts<FieldOf<Part>...>(
        make(std::get<std::optional<FieldOf<Part>>>(fields), Part::of(object))...);
  });
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
  for (const kernels::AlphaMap& from : view.alpha_maps) add_copy(from, asset.alpha_maps);
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
    for_each_part([&](auto part) {
      if (part.of(from)) part.of(object) = data_in(from, *part.of(from));
    });
  }
  for (const PrimaryView& from : view.primaries) asset.objects[from.object].primary = to_primary(from);
  for (const NumbersView& from : view.numbers)
    asset.objects[from.object].numbers[from.kind] = to_numbers(from);
  for (const ColorsView& from : view.colors) asset.objects[from.object].colors = to_colors(from);
  for (const SkinView& from : view.skins) asset.objects[from.object].skin = to_skin(from);
  for (const InstanceView& from : view.instances)
    asset.instances.push_back({std::string(from.name), from.object, from.transform, from.remainder, from.user,
                               from.mask, from.flags, from.parent});
  return asset;
}

}  // namespace nif::format
