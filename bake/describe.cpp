// Describes objects: what all have in common here, and the rest by their parts
// (bake/planes/describe_planes.hpp and so on). So an encoding is described by its parts.
#include "bake/describe.hpp"

#include <nlohmann/json.hpp>

#include "bake/bake_encodings.hpp"  // and with it how each part is described

namespace nif::bake {
namespace {

const char* encoding_name(const format::ObjectView& object) {
  return object.unsupported ? "unsupported" : format::encoding_of(object).name;
}

}  // namespace

nlohmann::ordered_json describe(const format::ObjectView& object) {
  nlohmann::ordered_json json{{"name", object.name},
                              {"encoding", encoding_name(object)},
                              {"triangles", object.triangle_count},
                              {"bounds", {object.aabb_min, object.aabb_max}},
                              {"bias", object.bias}};
  nlohmann::ordered_json bytes;
  format::for_each_part([&](auto part) {
    const auto* view = part.of(object);
    if (!view) return;
    for (const format::PartBytes& one : view->parts()) bytes[one.name] = one.bytes;
    describe(*view, json, bytes);
  });
  json["bytes"] = std::move(bytes);
  return json;
}

std::string summary(const format::ObjectView& object) {
  if (object.unsupported) return std::string("unsupported: it ") + object.unsupported;
  std::string text = encoding_name(object);
  format::for_each_part([&](auto part) {
    if (part.of(object)) text += ", " + summary(*part.of(object));
  });
  return text;
}

std::vector<std::string> details(const format::AssetView& asset) {
  for (const format::ObjectView& object : asset.objects)
    if (object.spherical) return details(*object.spherical);
  return {};
}

}  // namespace nif::bake
