// Counts, layers, and what the threshold favours. Bytes are listed for every part alike (bake/describe.cpp).
#include "bake/network/describe_network.hpp"

#include <fmt/format.h>

#include <cstdlib>
#include <nlohmann/json.hpp>
#include <vector>

namespace nif::bake {

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

}  // namespace nif::bake
