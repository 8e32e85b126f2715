// Counts of the tree. Bytes are listed for every part alike (bake/describe.cpp).
#include "bake/triangles/describe_triangles.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

namespace nif::bake {

void describe(const format::TrianglesView& view, nlohmann::ordered_json& json, nlohmann::ordered_json&) {
  json["nodes"] = view.field.node_count;
  json["vertices"] = view.field.vertex_count;
}

std::string summary(const format::TrianglesView& view) {
  return fmt::format("{} nodes", view.field.node_count);
}

}  // namespace nif::bake
