// Turns the figures of a bake into JSON. Metadata is kept short, because files are small: it has few digits,
// and only some of the figures about hits. scene_bytes() shares its code, so the two agree.
#include "bake/report.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "bake/alpha_metadata.hpp"
#include "bake/encoder.hpp"
#include "bake/merge_metadata.hpp"

namespace nif::bake {

nlohmann::ordered_json to_json(const SetAccuracies& sets) {
  nlohmann::ordered_json json = nlohmann::ordered_json::object();
  for (RaySet set : kAllRaySets) {
    const Accuracy& accuracy = sets[size_t(set)];
    if (accuracy.rays == 0) continue;
    json[std::string(name_of(set))] = {{"rays", accuracy.rays},
                                       {"error", accuracy.error()},
                                       {"leak", accuracy.rate(accuracy.leak)},
                                       {"spurious", accuracy.rate(accuracy.spurious)},
                                       {"certain", accuracy.rate(accuracy.certain)},
                                       {"certain_wrong", accuracy.certain_wrong},
                                       {"brier", accuracy.brier()}};
    if (set == RaySet::sun)
      json[std::string(name_of(set))]["worst"] = {{"error", accuracy.worst_error},
                                                  {"certain", accuracy.least_certain}};
  }
  return json;
}

namespace {

constexpr std::array<const char*, kPercentiles.size()> kPercentileKeys{"median", "p90", "p95", "p99"};

nlohmann::ordered_json hits_json(const HitFigures& hits) {
  nlohmann::ordered_json json{{"rays", hits.rays},
                              {"missed", hits.rate(hits.missed)},
                              {"false_hits", hits.rate(hits.false_hits)},
                              {"certain", hits.rate(hits.certain)},
                              {"bounds_wrong", hits.bounds_wrong},
                              {"compared", hits.compared}};
  if (hits.triangles > 0) json["triangles"] = {{"compared", hits.triangles}, {"displaced", hits.displaced}};
  if (hits.named > 0)
    json["source_triangles"] = {
        {"compared", hits.named}, {"other", hits.otherwise}, {"wrong", hits.misnamed}};
  const auto add = [&](const char* name, const std::optional<Percentiles>& percentiles) {
    for (size_t p = 0; percentiles && p < percentiles->size(); ++p)
      json[name][kPercentileKeys[p]] = (*percentiles)[p];
  };
  add("diagonals", hits.place);
  add("voxels", hits.voxels);
  add("degrees", hits.angle);
  return json;
}

/// Shortens numbers to four digits.
void shorten(nlohmann::ordered_json& json) {
  if (json.is_number_float()) json = std::stod(fmt::format("{:.4g}", json.get<double>()));
  if (json.is_object())
    for (auto& [name, value] : json.items()) shorten(value);
}

/// Removes everything but how far off hits are: files are small.
void shorten_hits(nlohmann::ordered_json& hits) {
  for (const char* name : {"certain", "bounds_wrong", "compared", "triangles", "source_triangles"})
    hits.erase(name);
  shorten(hits);
}

}  // namespace

void add_hits(const SetHitFigures& hits, nlohmann::ordered_json& sets) {
  for (auto& [name, set] : sets.items()) {
    const HitFigures& own = hits[size_t(*ray_set_named(name))];
    if (own.rays > 0) set["hits"] = hits_json(own);
  }
}

void add_calibration(const SetAccuracies& sets, bool bins, nlohmann::ordered_json& json) {
  for (auto& [name, set] : json.items()) {
    const Accuracy& accuracy = sets[size_t(*ray_set_named(name))];
    if (accuracy.uncertain() == 0) continue;
    set["calibration_error"] = accuracy.calibration_error();
    if (!bins) continue;
    set["calibration"] = nlohmann::ordered_json::array();
    for (const CalibrationBin& bin : accuracy.bins) {
      nlohmann::ordered_json& one =
          set["calibration"].emplace_back(nlohmann::ordered_json{{"rays", bin.rays}});
      if (bin.rays > 0) one["probability"] = bin.mean(), one["visible"] = bin.share();
    }
  }
}

nlohmann::ordered_json to_json(const Mix& mix) {
  nlohmann::ordered_json json = nlohmann::ordered_json::object();
  for (RaySet set : kRaySets)
    if (mix[size_t(set)] > 0) json[std::string(name_of(set))] = mix[size_t(set)];
  return json;
}

namespace {

/// Numbers are those of the file. Each node comes after those above it.
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

/// Everything about the scene except its meshes.
void add_scene(const mesh::Scene& scene, const BakeResult& result, nlohmann::ordered_json& json) {
  if (!scene.choice.empty()) {
    nlohmann::ordered_json& choice = json["choice"] = nlohmann::ordered_json::object();
    if (!scene.choice.only.empty()) choice["only"] = scene.choice.only;
    if (!scene.choice.except.empty()) choice["except"] = scene.choice.except;
  }
  if (nlohmann::ordered_json alpha = alpha_metadata(scene); !alpha.is_null())
    json["alpha"] = std::move(alpha);
  if (!scene.nodes.empty()) json["hierarchy"] = hierarchy(scene, result);
  nlohmann::ordered_json merge = merge_metadata(scene, result.placed);
  if (!merge.is_null()) json["merge"] = std::move(merge);
}

std::string dump(const nlohmann::ordered_json& json) {
  return json.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

}  // namespace

uint64_t scene_bytes(const mesh::Scene& scene, const BakeResult& result) {
  nlohmann::ordered_json json = nlohmann::ordered_json::object();
  add_scene(scene, result, json);
  return dump(json).size();
}

std::string make_metadata(const mesh::Scene& scene, const BakeOptions& options,
                          std::span<const std::unique_ptr<Encoder>> encoders, const BakeResult& result) {
  nlohmann::ordered_json chosen{{"encoding", options.encoding}};
  for (const auto& encoder : encoders) encoder->add_options(chosen);
  if (options.uncoded) chosen["uncoded"] = true;
  if (options.source_triangles) chosen["source_triangles"] = true;
  if (options.deforms) chosen["deforms"] = true;
  if (options.colors) chosen["colors"] = true;
  if (options.max_bytes) chosen["max_bytes"] = *options.max_bytes;
  if (options.prefer) chosen["prefer"] = name_of(*options.prefer);
  if (options.max_error) chosen["max_error"] = *options.max_error;
  if (options.error_limit)
    chosen[fmt::format("max_{}", name_of(options.error_limit->mistake))] = options.error_limit->rate;
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
    std::visit([&](const auto& own) { add_metadata(own, report, object, described); }, report.own);
    described["accuracy"] = to_json(report.sets);
    add_hits(report.hits, described["accuracy"]);
    for (auto& [set, accuracy] : described["accuracy"].items())
      if (accuracy.contains("hits")) shorten_hits(accuracy["hits"]);
  }
  json["objects"] = std::move(objects);
  add_scene(scene, result, json);
  return dump(json);
}

nlohmann::ordered_json to_json(const ObjectReport& object) {
  nlohmann::ordered_json json{{"name", object.name},
                              {"encoding", object.encoding},
                              {"reason", object.reason},
                              {"triangles", object.triangles},
                              {"degenerate", object.cleaned.degenerate},
                              {"duplicate", object.cleaned.duplicate},
                              {"turned", object.turned},
                              {"closed_components", object.closed_components},
                              {"open_components", object.open_components}};
  for (const auto& [encoding, cost] : object.compared) {
    nlohmann::ordered_json& compared = json["compared"][encoding];
    compared["bytes"] = cost.bytes;
    if (cost.resident > 0) compared["resident"] = cost.resident;
    if (cost.work > 0) compared["work"] = cost.work;
  }
  for (const auto& [bytes, bound] : object.bakes)
    json["bakes"].push_back({{"bytes", bytes}, {"error_bound", bound}});
  std::visit([&](const auto& own) { add_report(own, json); }, object.own);
  json["training_rays"] = object.training_rays;
  json["recoveries"] = object.recoveries;
  json["sets"] = to_json(object.sets);
  add_calibration(object.sets, false, json["sets"]);
  add_hits(object.hits, json["sets"]);
  return json;
}

}  // namespace nif::bake
