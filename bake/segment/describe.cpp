// What is said of `segment` objects: in the report of a bake, in the metadata, by `nif info`.
#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "bake/bake.hpp"
#include "bake/segment/encoder.hpp"

namespace nif::bake {

void add_report(const SegmentBaking::Report& report, nlohmann::ordered_json& json) {
  add_grid(report, json);
  if (report.lean) json["lean"] = to_json(*report.lean);
}

void add_metadata(const SegmentBaking::Report& report, const ObjectReport& all, const format::Object&,
                  nlohmann::ordered_json& json) {
  json["voxels"] = report.voxels;
  json["training_rays"] = all.training_rays;
  if (report.lean) json["lean"] = to_json(*report.lean);
}

void describe(const format::SegmentView& view, nlohmann::ordered_json& json) {
  const kernels::SegmentField& field = view.field;
  std::vector<uint32_t> widths;
  for (uint32_t l = 0; l < field.network.layer_count; ++l) widths.push_back(field.network.layers[l].outputs);
  json["voxels"] = field.voxels;
  json["levels"] = field.levels;
  json["surface_voxels"] = field.surface_voxels;
  json["parts"] = field.part_count;
  json["corners"] = field.corners;
  json["features_per_corner"] = field.features_per_corner;
  json["samples"] = field.samples;
  json["network"] = view.network;
  json["layers"] = widths;
  json["threshold"] = field.network.calibration.threshold;
  json["bytes"] = {
      {"occupancy", view.occupancy.file}, {"planes", view.cells.file}, {"features", view.features.file}};
}

std::string summary(const format::SegmentView& view) {
  const kernels::SegmentField& field = view.field;
  const int32_t threshold = field.network.calibration.threshold;
  const std::string leans =
      threshold == 0
          ? ""
          : fmt::format(", leans to {} by {}", threshold > 0 ? "occluded" : "visible", std::abs(threshold));
  return fmt::format("{} x {} x {} voxels, {} of them surface in {} parts, {} corners{}", field.voxels[0],
                     field.voxels[1], field.voxels[2], field.surface_voxels, field.part_count, field.corners,
                     leans);
}

}  // namespace nif::bake
