#include "bake/report.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

namespace nif::bake {

nlohmann::ordered_json to_json(const SetAccuracies& sets) {
  nlohmann::ordered_json json = nlohmann::ordered_json::object();
  for (RaySet set : kRaySets) {
    const Accuracy& accuracy = sets[size_t(set)];
    if (accuracy.rays == 0) continue;
    json[std::string(name_of(set))] = {{"rays", accuracy.rays},
                                       {"error", accuracy.error()},
                                       {"leak", accuracy.rate(accuracy.leak)},
                                       {"spurious", accuracy.rate(accuracy.spurious)},
                                       {"certain", accuracy.rate(accuracy.certain)},
                                       {"certain_wrong", accuracy.certain_wrong},
                                       {"brier", accuracy.brier()}};
  }
  return json;
}

namespace {

/// The number that someone wrote down for it: 0.005, not 0.00499999988824.
double decimal(float value) { return std::stod(fmt::format("{}", value)); }

/// The hyperparameters of `spherical`, all of them.
nlohmann::ordered_json to_json(const SphericalOptions::Outer& field) {
  return {{"resolution", field.resolution},
          {"features", field.features},
          {"width", field.width},
          {"layers", field.hidden_layers},
          {"batch", field.batch}};
}

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

/// Numbers are the file's own. Nodes stand after those above them.
nlohmann::ordered_json hierarchy(const mesh::Scene& scene, const BakeResult& result) {
  nlohmann::ordered_json nodes = nlohmann::ordered_json::array(), instances = nodes;
  for (const mesh::Node& node : scene.nodes) {
    nlohmann::ordered_json& described = nodes.emplace_back(nlohmann::ordered_json{{"node", node.number}});
    if (!node.name.empty()) described["name"] = node.name;
    if (node.parent != mesh::kNoNode) described["parent"] = scene.nodes[node.parent].number;
  }
  for (const uint32_t instance : result.placed) {
    const uint32_t node = scene.instances[instance].node;
    instances.push_back(node == mesh::kNoNode ? nlohmann::ordered_json()
                                              : nlohmann::ordered_json(scene.nodes[node].number));
  }
  return {{"nodes", std::move(nodes)}, {"instances", std::move(instances)}};
}

std::string dump(const nlohmann::ordered_json& json) {
  return json.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

}  // namespace

std::string source_hash_text(uint64_t hash) { return fmt::format("xxh3-64:{:016x}", hash); }

uint64_t hierarchy_bytes(const mesh::Scene& scene, const BakeResult& result) {
  return scene.nodes.empty() ? 0 : dump({{"hierarchy", hierarchy(scene, result)}}).size();
}

std::string make_metadata(const mesh::Scene& scene, const BakeOptions& options, const BakeResult& result) {
  nlohmann::ordered_json mix = nlohmann::ordered_json::object();
  const Mix weights = resolve(options).mix;
  for (RaySet set : kRaySets) {
    if (weights[size_t(set)] > 0) mix[std::string(name_of(set))] = weights[size_t(set)];
  }
  nlohmann::ordered_json chosen{{"encoding", name_of(options.encoding)}};
  if (options.encoding != EncodingOption::bvh) {
    chosen["preset"] = name_of(options.preset);
    if (options.encoding == EncodingOption::spherical && options.spherical.given)
      chosen["rays_from"] = options.spherical.given->name;
    else
      chosen["mix"] = mix;
    if (options.encoding == EncodingOption::spherical) chosen["spherical"] = to_json(options.spherical);
    if (options.resolution) chosen["resolution"] = *options.resolution;
    if (options.effort) chosen["effort"] = *options.effort;
  }
  if (options.max_bytes) chosen["max_bytes"] = *options.max_bytes;
  if (options.max_error) chosen["max_error"] = *options.max_error;
  nlohmann::ordered_json json{{"tool", {{"name", "nifkit"}, {"version", NIF_VERSION_STRING}}},
                              {"seed", options.seed},
                              {"options", std::move(chosen)},
                              {"source", {{"hash", source_hash_text(scene.source_hash)}}},
                              {"accuracy", to_json(result.sets)}};
  nlohmann::ordered_json objects = nlohmann::ordered_json::array();
  for (size_t i = 0; i < result.objects.size(); ++i) {
    const ObjectReport& report = result.objects[i];
    const format::Object& object = result.asset.objects[i];
    nlohmann::ordered_json& described =
        objects.emplace_back(nlohmann::ordered_json{{"name", object.name},
                                                    {"encoding", report.encoding},
                                                    {"reason", report.reason},
                                                    {"triangles", report.triangles},
                                                    {"bounds", {object.aabb_min, object.aabb_max}},
                                                    {"bias", object.bias},
                                                    {"closed_components", report.closed_components},
                                                    {"open_components", report.open_components}});
    if (object.is<format::SegmentData>()) {
      described["voxels"] = report.voxels;
      described["training_rays"] = report.training_rays;
    }
    if (object.is<format::SphericalData>()) {
      described["networks"] = object.as<format::SphericalData>().network;
      described["training_rays"] = report.training_rays;
      if (object.primary) described["primary_rays"] = report.primary_rays;
    }
    described["accuracy"] = to_json(report.sets);
  }
  json["objects"] = std::move(objects);
  if (!scene.nodes.empty()) json["hierarchy"] = hierarchy(scene, result);
  return dump(json);
}

}  // namespace nif::bake
