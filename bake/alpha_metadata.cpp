// Writes the "alpha" entry of the metadata, and reads it back when a program must read the same mesh file in the same
// way again. The text may contain anything, so every entry is checked.
#include "bake/alpha_metadata.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <string>

#include "formats/base/json_text.hpp"
#include "formats/base/status.hpp"

namespace nif::bake {
namespace {

using Blend = mesh::AlphaOptions::Blend;
using nlohmann::ordered_json;

constexpr std::array<std::string_view, 3> kBlends{"cutoff", "opaque", "ignore"},
    kRules{"mask", "blend", "glass"};

}  // namespace

std::string_view name_of(Blend blend) { return kBlends[size_t(blend)]; }

Blend blend_named(std::string_view name, std::string_view what) {
  for (size_t i = 0; i < kBlends.size(); ++i)
    if (kBlends[i] == name) return Blend(i);
  throw Error(Status::usage, fmt::format("{} '{}' is not one of {}", what, name, fmt::join(kBlends, ", ")));
}

ordered_json alpha_metadata(const mesh::Scene& scene) {
  if (scene.see_through.empty()) return {};
  ordered_json materials = ordered_json::array();
  for (const mesh::MaterialAlpha& material : scene.see_through) {
    ordered_json& described = materials.emplace_back(
        ordered_json{{"name", material.name}, {"rule", kRules[size_t(material.rule)]}});
    if (material.cutoff > 0) described["cutoff"] = material.cutoff;
    described["solid"] = material.solid;
    described["cut"] = material.cut;
    described["clear"] = material.clear;
    if (material.filled != 0) described["filled"] = material.filled;
  }
  ordered_json alpha{{"cutoff", scene.alpha.cutoff},
                     {"blend", name_of(scene.alpha.blend)},
                     {"glass", scene.alpha.opaque_glass ? "opaque" : "ignore"}};
  if (scene.alpha.resolution != 0) alpha["resolution"] = scene.alpha.resolution;
  alpha["materials"] = std::move(materials);
  return alpha;
}

mesh::AlphaOptions alpha_options_of(std::string_view metadata) {
  mesh::AlphaOptions options;
  const auto root = parse_untrusted<nlohmann::json>(metadata);
  if (!root.is_object() || !root.contains("alpha")) return options;
  const nlohmann::json& alpha = root.at("alpha");
  const auto refuse = [](const char* name) {
    throw Error(Status::mesh_mismatch,
                fmt::format("its metadata does not say how alpha was read: '{}' is missing or wrong", name));
  };
  const auto text = [&](const char* name) -> std::string {
    if (!alpha.is_object() || !alpha.contains(name) || !alpha.at(name).is_string()) refuse(name);
    return alpha.at(name).get<std::string>();
  };
  options.read = true;
  const std::string blend = text("blend"), glass = text("glass");
  const auto known = std::ranges::find(kBlends, blend);
  if (known == kBlends.end()) refuse("blend");
  options.blend = Blend(known - kBlends.begin());
  if (glass != "opaque" && glass != "ignore") refuse("glass");
  options.opaque_glass = glass == "opaque";
  if (!alpha.contains("cutoff") || !alpha.at("cutoff").is_number()) refuse("cutoff");
  options.cutoff = alpha.at("cutoff").get<double>();
  if (alpha.contains("resolution")) {
    const nlohmann::json& resolution = alpha.at("resolution");
    if (!resolution.is_number_unsigned() || resolution == 0 || resolution > mesh::AlphaMap::kMostSide)
      refuse("resolution");
    options.resolution = resolution.get<uint32_t>();
  }
  return options;
}

}  // namespace nif::bake
