// Describes objects: what all have in common here, and the rest by their parts. So an encoding is described
// by its parts.
#include "bake/describe.hpp"

#include <fmt/format.h>

#include <cstdlib>
#include <nlohmann/json.hpp>

#include "bake/spherical/describe_spherical.hpp"

namespace nif::bake {
namespace {

void describe(const format::PlanesView& view, nlohmann::ordered_json& json, nlohmann::ordered_json&) {
  json["voxels"] = view.field.voxels;
  json["levels"] = view.field.levels;
  json["surface_voxels"] = view.field.surface_voxels;
  json["children"] = view.field.child_count;
}

std::string summary(const format::PlanesView& view) {
  const kernels::PlanesField& grid = view.field;
  return fmt::format("{} x {} x {} voxels, {} of them surface in {} parts", grid.voxels[0], grid.voxels[1],
                     grid.voxels[2], grid.surface_voxels, grid.child_count);
}

void describe(const format::TrianglesView& view, nlohmann::ordered_json& json, nlohmann::ordered_json&) {
  json["nodes"] = view.field.node_count;
  json["vertices"] = view.field.vertex_count;
}

std::string summary(const format::TrianglesView& view) {
  return fmt::format("{} nodes", view.field.node_count);
}

void describe(const format::NetworkView& view, nlohmann::ordered_json& json, nlohmann::ordered_json&) {
  const kernels::NetworkField& field = view.field;
  std::vector<uint32_t> widths;
  for (uint32_t l = 0; l < field.network.layer_count; ++l) widths.push_back(field.network.layers[l].outputs);
  json["corners"] = field.corners;
  json["features_per_corner"] = field.features_per_corner;
  json["samples"] = field.samples;
  json["network"] = view.mlp;
  json["layers"] = widths;
  json["threshold"] = field.network.calibration.threshold;
}

std::string summary(const format::NetworkView& view) {
  const int32_t threshold = view.field.network.calibration.threshold;
  const std::string favours =
      threshold == 0
          ? ""
          : fmt::format(", favours {} by {}", threshold > 0 ? "occluded" : "visible", std::abs(threshold));
  return fmt::format("{} corners{}", view.field.corners, favours);
}

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
