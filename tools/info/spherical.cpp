#include "tools/info/spherical.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

namespace nif::tools {
namespace {

struct GridBytes {
  uint64_t outer, inner, distance;
};
struct NetworkBytes {
  uint64_t outer, inner;
};

uint64_t angle_values(const kernels::SphericalGrid& grid) {
  return uint64_t{grid.resolution} * grid.resolution * grid.features;
}

GridBytes grid_bytes(const kernels::SphericalField& field) {
  const uint64_t size = field.distance.values.half ? 2 : 4;
  return {2 * size * angle_values(field.outer_position), 2 * size * angle_values(field.inner_position),
          size * field.distance.resolution * field.distance.features};
}

uint64_t bytes_of(const kernels::SphericalNetwork& network) {
  return (network.weights.half ? 2 : 4) * kernels::spherical_weights(network);
}

/// Bytes by the formulas of the paper, for grids of these resolutions: 4 R^2 for a pair of grids over angles,
/// and 2 R for the one over the distance, which count one float of half precision for each latent vector,
/// however many it has; and 28 R^2 for a pair in training.
struct PaperBytes {
  uint64_t outer, inner, training_outer, training_inner;
};
PaperBytes paper_bytes(const kernels::SphericalField& field) {
  const uint64_t outer = uint64_t{field.outer_position.resolution} * field.outer_position.resolution,
                 inner = uint64_t{field.inner_position.resolution} * field.inner_position.resolution;
  return {4 * outer, 4 * inner + 2 * uint64_t{field.distance.resolution}, 28 * outer, 28 * inner};
}

nlohmann::ordered_json describe(const kernels::SphericalGrid& grid,
                                const kernels::SphericalNetwork& network) {
  return {{"resolution", grid.resolution},   {"features", grid.features},
          {"inputs", network.inputs},        {"width", network.width},
          {"layers", network.hidden_layers}, {"network_precision", network.weights.half ? "half" : "single"}};
}

}  // namespace

nlohmann::ordered_json describe_spherical(const format::SphericalView& object) {
  const kernels::SphericalField& field = object.field;
  nlohmann::ordered_json outer = describe(field.outer_position, field.outer),
                         inner = describe(field.inner_position, field.inner);
  inner["distance_resolution"] = field.distance.resolution;
  inner["distance_features"] = field.distance.features;
  const GridBytes grids = grid_bytes(field);
  const PaperBytes paper = paper_bytes(field);
  return {{"outer", std::move(outer)},
          {"inner", std::move(inner)},
          {"grid_precision", field.distance.values.half ? "half" : "single"},
          {"bytes",
           {{"grids", object.grid_bytes},
            {"outer_grids", grids.outer},
            {"inner_grids", grids.inner + grids.distance},
            {"outer_network", bytes_of(field.outer)},
            {"inner_network", bytes_of(field.inner)}}},
          {"paper",
           {{"outer_grids", paper.outer},
            {"inner_grids", paper.inner},
            {"training_outer_grids", paper.training_outer},
            {"training_inner_grids", paper.training_inner}}}};
}

nlohmann::ordered_json describe_primary(const format::PrimaryView& primary) {
  nlohmann::ordered_json json = describe(primary.field.position, primary.field.network);
  json["grid_precision"] = primary.field.position.values.half ? "half" : "single";
  json["margin"] = primary.field.margin;
  json["bytes"] = {{"grids", primary.grid_bytes}, {"network", primary.network_bytes}};
  return json;
}

void print_spherical(const format::AssetView& view) {
  if (!view.primaries.empty()) {
    const format::PrimaryView& primary = view.primaries.front();
    const kernels::SphericalGrid& grid = primary.field.position;
    const kernels::SphericalNetwork& network = primary.field.network;
    fmt::print(
        "primary   grids {} x {} x {}, {} bytes; network {} to {} x {} to {}, {} bytes; margin {:.4f}\n",
        grid.resolution, grid.resolution, grid.features, primary.grid_bytes, network.inputs,
        network.hidden_layers, network.width, network.outputs, primary.network_bytes, primary.field.margin);
  }
  const auto object = std::find_if(view.objects.begin(), view.objects.end(), [](const auto& candidate) {
    return candidate.template is<format::SphericalView>();
  });
  if (object == view.objects.end()) return;
  const kernels::SphericalField& field = object->as<format::SphericalView>().field;
  const GridBytes grids = grid_bytes(field);
  const PaperBytes paper = paper_bytes(field);
  const auto line = [](const char* which, const kernels::SphericalGrid& grid,
                       const kernels::SphericalNetwork& network, uint64_t grid_bytes, const char* formula,
                       uint64_t stated, uint64_t training) {
    fmt::print(
        "{}     grids {} x {} x {}, {} bytes (the paper's {}, without the {} floats of a latent vector: "
        "{}; in training 28 R^2: {}); network {} to {} x {}, {} bytes\n",
        which, grid.resolution, grid.resolution, grid.features, grid_bytes, formula, grid.features, stated,
        training, network.inputs, network.hidden_layers, network.width, bytes_of(network));
  };
  line("outer", field.outer_position, field.outer, grids.outer, "4 R^2", paper.outer, paper.training_outer);
  line("inner", field.inner_position, field.inner, grids.inner + grids.distance, "4 R^2 + 2 R", paper.inner,
       paper.training_inner);
}

}  // namespace nif::tools
