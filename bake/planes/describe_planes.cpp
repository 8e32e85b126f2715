// Counts of the grid. Bytes are listed for every part alike (bake/describe.cpp).
#include "bake/planes/describe_planes.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

namespace nif::bake {

void describe(const format::PlanesView& view, nlohmann::ordered_json& json, nlohmann::ordered_json&) {
  json["voxels"] = view.field.voxels;
  json["levels"] = view.field.levels;
  json["surface_voxels"] = view.field.surface_voxels;
  json["children"] = view.field.child_count;
}

std::string summary(const format::PlanesView& view) {
  const kernels::PlanesField& grid = view.field;
  return fmt::format("{} x {} x {} voxels, {} of them surface with {} children", grid.voxels[0],
                     grid.voxels[1], grid.voxels[2], grid.surface_voxels, grid.child_count);
}

}  // namespace nif::bake
