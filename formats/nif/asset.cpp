// From the view of a loaded file back to an asset that owns its memory. `nif validate` writes that again
// to see whether the bytes are the same. Each encoding is asked through one visit.
#include "formats/nif/asset.hpp"

#include "formats/nif/writer.hpp"

namespace nif::format {

kernels::AnyField field_of(const Asset& asset, const Object& object) {
  return visit_encoding(object.content, [&](const auto& data, auto encoding) -> kernels::AnyField {
    return decltype(encoding)::field(data, asset, object.bounds());
  });
}

Asset to_asset(const AssetView& view) {
  Asset asset;
  asset.metadata = view.metadata;
  asset.places_nothing = view.places_nothing;
  for_each_encoding([&](auto encoding) {
    using Encoding = decltype(encoding);
    static_cast<typename Encoding::Shared&>(asset) = Encoding::to_shared(view);
  });
  for (const ObjectView& from : view.objects) {
    Object& object = asset.objects.emplace_back();
    object.name = from.name;
    object.aabb_min = from.aabb_min;
    object.aabb_max = from.aabb_max;
    object.bias = from.bias;
    object.triangles = from.triangles;
    visit_encoding(from.content, [&](const auto& content, auto encoding) {
      object.content = decltype(encoding)::to_data(content);
    });
  }
  for (const PrimaryView& from : view.primaries) asset.objects[from.object].primary = to_primary(from);
  for (const SourceTrianglesView& from : view.source_triangles)
    asset.objects[from.object].source_triangles = to_source_triangles(from);
  for (const ColorsView& from : view.colors) asset.objects[from.object].colors = to_colors(from);
  for (const InstanceView& from : view.instances)
    asset.instances.push_back({std::string(from.name), from.object, from.transform, from.remainder});
  return asset;
}

}  // namespace nif::format
