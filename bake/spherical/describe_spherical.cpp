// Describes `spherical` objects in the report of a bake, in the metadata and for `nif info`: their bytes
// beside those that the paper states.
#include "bake/spherical/describe_spherical.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "bake/bake.hpp"
#include "bake/spherical/spherical_encoder.hpp"

namespace nif::bake {
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
/// whatever its length; and 28 R^2 for a pair in training.
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

/// The decimal number that a user wrote for it: 0.005, not 0.00499999988824.
double decimal(float value) { return std::stod(fmt::format("{}", value)); }

nlohmann::ordered_json to_json(const SphericalOptions::Outer& field) {
  return {{"resolution", field.resolution},
          {"features", field.features},
          {"width", field.width},
          {"layers", field.hidden_layers},
          {"batch", field.batch}};
}

}  // namespace

nlohmann::ordered_json to_json(const SphericalBakeOptions& options) {
  const SphericalOptions& fields = options.fields;
  const auto precision = [](bool half) { return half ? "half" : "single"; };
  nlohmann::ordered_json json{
      {"outer", to_json(fields.outer)},
      {"inner",
       {{"resolution", fields.inner.resolution},
        {"features", fields.inner.features},
        {"distance_resolution", fields.inner.distance_resolution},
        {"distance_features", fields.inner.distance_features},
        {"width", fields.inner.width},
        {"layers", fields.inner.hidden_layers},
        {"batch", fields.inner.batch}}},
      {"grids", precision(fields.half_grids)},
      {"networks", precision(fields.half_networks)},
      {"shared_network", options.shared_network},
      {"slope", decimal(fields.slope)},
      {"latent_reach", decimal(fields.latent_reach)},
      {"weights", fields.he_weights ? "he" : "xavier"},
      {"loss", fields.loss == SphericalLoss::squared ? "l2" : "cross-entropy"},
      {"learning_rate", decimal(fields.learning_rate)},
      {"beta1", decimal(fields.beta1)},
      {"beta2", decimal(fields.beta2)},
      {"epsilon", decimal(fields.epsilon)},
      {"rays", options.given ? nlohmann::ordered_json() : nlohmann::ordered_json(options.rays)},
      {"passes", options.given ? 1 : options.passes}};
  if (options.given && options.given->draw_primary) json["primary"] = to_json(fields.primary);
  return json;
}

void add_report(const SphericalBaking::Report& report, nlohmann::ordered_json& json) {
  if (report.primary_rays) json["primary_rays"] = report.primary_rays;
}

void add_metadata(const SphericalBaking::Report& report, const ObjectReport& all,
                  const format::Object& object, nlohmann::ordered_json& json) {
  json["networks"] = object.spherical->network;
  json["training_rays"] = all.training_rays;
  if (object.primary) json["primary_rays"] = report.primary_rays;
}

void describe(const format::SphericalView& view, nlohmann::ordered_json& json,
              nlohmann::ordered_json& bytes) {
  const kernels::SphericalField& field = view.field;
  json["network"] = view.network;
  nlohmann::ordered_json outer = describe(field.outer_position, field.outer),
                         inner = describe(field.inner_position, field.inner);
  inner["distance_resolution"] = field.distance.resolution;
  inner["distance_features"] = field.distance.features;
  const GridBytes grids = grid_bytes(field);
  const PaperBytes paper = paper_bytes(field);
  bytes["outer_grids"] = grids.outer;
  bytes["inner_grids"] = grids.inner + grids.distance;
  bytes["outer_network"] = bytes_of(field.outer);
  bytes["inner_network"] = bytes_of(field.inner);
  json.update(nlohmann::ordered_json{{"outer", std::move(outer)},
                                     {"inner", std::move(inner)},
                                     {"grid_precision", field.distance.values.half ? "half" : "single"},
                                     {"paper",
                                      {{"outer_grids", paper.outer},
                                       {"inner_grids", paper.inner},
                                       {"training_outer_grids", paper.training_outer},
                                       {"training_inner_grids", paper.training_inner}}}});
}

std::string summary(const format::SphericalView& view) { return fmt::format("networks {}", view.network); }

std::vector<std::string> details(const format::SphericalView& view) {
  const kernels::SphericalField& field = view.field;
  const GridBytes grids = grid_bytes(field);
  const PaperBytes paper = paper_bytes(field);
  const auto line = [](const char* which, const kernels::SphericalGrid& grid,
                       const kernels::SphericalNetwork& network, uint64_t grid_bytes, const char* formula,
                       uint64_t stated, uint64_t training) {
    return fmt::format(
        "{}     grids {} x {} x {}, {} bytes (the paper's {}, without the {} floats of a latent vector: "
        "{}; in training 28 R^2: {}); network {} to {} x {}, {} bytes",
        which, grid.resolution, grid.resolution, grid.features, grid_bytes, formula, grid.features, stated,
        training, network.inputs, network.hidden_layers, network.width, bytes_of(network));
  };
  return {line("outer", field.outer_position, field.outer, grids.outer, "4 R^2", paper.outer,
               paper.training_outer),
          line("inner", field.inner_position, field.inner, grids.inner + grids.distance, "4 R^2 + 2 R",
               paper.inner, paper.training_inner)};
}

nlohmann::ordered_json to_json(const format::PrimaryView& primary) {
  nlohmann::ordered_json json = describe(primary.field.position, primary.field.network);
  json["grid_precision"] = primary.field.position.values.half ? "half" : "single";
  json["margin"] = primary.field.margin;
  json["bytes"] = {{"grids", primary.grid_bytes}, {"network", primary.network_bytes}};
  return json;
}

std::string summary(const format::PrimaryView& primary) {
  const kernels::SphericalGrid& grid = primary.field.position;
  const kernels::SphericalNetwork& network = primary.field.network;
  return fmt::format("grids {} x {} x {}, {} bytes; network {} to {} x {} to {}, {} bytes; margin {:.4f}",
                     grid.resolution, grid.resolution, grid.features, primary.grid_bytes, network.inputs,
                     network.hidden_layers, network.width, network.outputs, primary.network_bytes,
                     primary.field.margin);
}

}  // namespace nif::bake
