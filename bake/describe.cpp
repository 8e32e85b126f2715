// Writes what objects of all encodings have, then visits the variant for the rest: each encoding brings
// its own describe(), summary() and details(). So a new encoding changes nothing here.
#include "bake/describe.hpp"

#include <nlohmann/json.hpp>
#include <set>

#include "bake/encodings.hpp"

namespace nif::bake {

nlohmann::ordered_json describe(const format::ObjectView& object) {
  nlohmann::ordered_json json{{"name", object.name},
                              {"encoding", format::encoding_name(object.content)},
                              {"triangles", object.triangles},
                              {"bounds", {object.aabb_min, object.aabb_max}},
                              {"bias", object.bias}};
  std::visit([&](const auto& own) { describe(own, json); }, object.content);
  return json;
}

std::string summary(const format::ObjectView& object) {
  return format::encoding_name(object.content) + std::string(", ") +
         std::visit([](const auto& own) { return summary(own); }, object.content);
}

std::vector<std::string> details(const format::AssetView& asset) {
  std::vector<std::string> lines;
  std::set<uint32_t> told;
  for (const format::ObjectView& object : asset.objects) {
    if (!told.insert(format::encoding_number(object.content)).second) continue;
    for (std::string& line : std::visit([](const auto& own) { return details(own); }, object.content))
      lines.push_back(std::move(line));
  }
  return lines;
}

}  // namespace nif::bake
