// Reads study.json back with care: values are checked, and a study with another key is refused. Between two
// sizes, families are compared by linear interpolation in logarithms of bytes, errors and speeds.
#include "tools/study/study.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "formats/base/json_text.hpp"
#include "formats/base/quantities.hpp"
#include "formats/base/status.hpp"

namespace nif::tools {
namespace {

using Json = nlohmann::ordered_json;

Json to_json(const StudyKey& key) {
  return {{"mesh", key.mesh},           {"hash", key.hash},
          {"triangles", key.triangles}, {"version", key.version},
          {"processor", key.processor}, {"quick", key.quick},
          {"seed", key.seed},           {"rays", key.rays}};
}

Json to_json(const RivalPoint& point) {
  Json json{{"family", point.family}, {"size", point.size}};
  if (!point.measured()) {
    json["left_out"] = point.left_out;
    return json;
  }
  json["bytes"] = {{"file", point.file_bytes}, {"resident", point.resident_bytes}};
  json["seconds"] = point.seconds;
  for (const auto& [name, set] : point.sets) {
    Json& one = json["sets"][name];
    one = {{"rays", set.rays},
           {"error", set.error()},
           {"leak", set.leak},
           {"spurious", set.spurious},
           {"certain", set.certain}};
    if (set.ratio) one["speed"] = {{"mrays_per_s", *set.mrays_per_s}, {"ratio", *set.ratio}};
  }
  json["view"] = {{"wrong", point.view_wrong}, {"picture", point.picture}, {"errors", point.errors}};
  return json;
}

/// A file name within the study's own folder, and nothing else.
std::string file_name(const Json& json) {
  const auto name = json.get<std::string>();
  if (name.empty() || name.find('/') != std::string::npos || name.starts_with('.'))
    throw Error(Status::checkpoint_refused, "");
  return name;
}

double share(const Json& json) {
  const auto value = json.get<double>();
  if (!(value >= 0 && value <= 1)) throw Error(Status::checkpoint_refused, "");
  return value;
}

double positive(const Json& json) {
  const auto value = json.get<double>();
  if (!(value > 0 && value < 1e30)) throw Error(Status::checkpoint_refused, "");
  return value;
}

RivalPoint to_point(const Json& json) {
  RivalPoint point;
  point.family = json.at("family").get<std::string>();
  point.size = json.at("size").get<std::string>();
  if (json.contains("left_out")) {
    point.left_out = json["left_out"].get<std::string>();
    if (point.left_out.empty()) throw Error(Status::checkpoint_refused, "");
    return point;
  }
  point.file_bytes = uint64_t(json.at("bytes").at("file").get<uint64_t>());
  point.resident_bytes = uint64_t(positive(json.at("bytes").at("resident")));
  point.seconds = json.at("seconds").get<double>();
  for (const auto& [name, one] : json.at("sets").items()) {
    RivalSet& set = point.sets[name];
    set.rays = one.at("rays").get<uint64_t>();
    set.leak = share(one.at("leak"));
    set.spurious = share(one.at("spurious"));
    set.certain = share(one.at("certain"));
    if (!one.contains("speed")) continue;
    set.mrays_per_s = positive(one["speed"].at("mrays_per_s"));
    set.ratio = positive(one["speed"].at("ratio"));
  }
  point.view_wrong = share(json.at("view").at("wrong"));
  point.picture = file_name(json.at("view").at("picture"));
  point.errors = file_name(json.at("view").at("errors"));
  return point;
}

/// A value of one size, or one interpolated between two.
std::optional<double> between(std::optional<double> below, std::optional<double> above, double share) {
  constexpr double kLeast = 1e-7;  // an error of 0 has no logarithm
  if (!below || !above) return std::nullopt;
  if (share <= 0) return below;
  return std::exp(std::log(std::max(*below, kLeast)) * (1 - share) +
                  std::log(std::max(*above, kLeast)) * share);
}

}  // namespace

double RivalPoint::error() const {
  double sum = 0;
  for (const auto& [name, set] : sets) sum += set.error();
  return sets.empty() ? 0 : sum / double(sets.size());
}

std::optional<double> RivalPoint::ratio(const std::string& set) const {
  const auto found = sets.find(set);
  return found == sets.end() ? std::nullopt : found->second.ratio;
}

const RivalPoint* Study::find(const std::string& family, const std::string& size) const {
  const auto found = std::ranges::find_if(
      points, [&](const RivalPoint& point) { return point.family == family && point.size == size; });
  return found == points.end() ? nullptr : &*found;
}

nlohmann::ordered_json to_json(const Study& study) {
  Json json{{"schema", kStudySchema}, {"study", to_json(study.key)}, {"points", Json::array()}};
  json["study"]["meshes"] = study.meshes;
  json["study"]["instances"] = study.instances;
  for (const RivalPoint& point : study.points) json["points"].push_back(to_json(point));
  json["at_equal_bytes"] = Json::array();
  for (const double bytes : kBudgets) {
    Json families = Json::object();
    for (const std::string& family : families_of(study)) {
      const std::optional<AtBytes> at = at_bytes(study, family, bytes);
      if (!at) continue;
      Json& one = families[family];
      one["error"] = at->error;
      const std::pair<const char*, std::optional<double>> ratios[] = {
          {"outer-lines", at->outer}, {"inner-surface", at->inner}, {"sun", at->sun}};
      for (const auto& [name, ratio] : ratios)
        if (ratio) one["ratio"][name] = *ratio;
      one["largest"] = at->largest;
    }
    json["at_equal_bytes"].push_back({{"resident", bytes}, {"families", std::move(families)}});
  }
  return json;
}

Study read_study(const std::string& path, const std::string& text, const StudyKey& key) {
  Study study;
  study.key = key;
  Json kept;
  try {
    const Json json = parse_untrusted<Json>(text);
    if (json.at("schema") != kStudySchema) throw Error(Status::checkpoint_refused, "");
    kept = json.at("study");
    if (!kept.is_object()) throw Error(Status::checkpoint_refused, "");
    for (const Json& point : json.at("points")) study.points.push_back(to_point(point));
  } catch (const nlohmann::json::exception&) {
    throw Error(
        Status::checkpoint_refused,
        path + ": is not a file of nif study, or is damaged; choose another folder, or remove the file");
  } catch (const Error&) {
    throw Error(
        Status::checkpoint_refused,
        path + ": is not a file of nif study, or is damaged; choose another folder, or remove the file");
  }
  const Json now = to_json(key);
  for (const auto& [name, value] : now.items()) {
    if (kept.contains(name) && kept[name] == value) continue;
    throw Error(
        Status::checkpoint_refused,
        fmt::format("{}: a study of another kind: its {} is {}, and now it is {}; choose another folder, "
                    "or remove the file",
                    path, name, kept.contains(name) ? kept[name].dump() : "not stated", value.dump()));
  }
  return study;
}

std::vector<std::string> families_of(const Study& study) {
  std::vector<std::string> families;
  for (const RivalPoint& point : study.points)
    if (std::ranges::find(families, point.family) == families.end()) families.push_back(point.family);
  return families;
}

std::string flattened_note(const Study& study) {
  if (study.instances == 1) return "";
  return fmt::format("{} are studied as one mesh of {}; nif bench compares a scene with its instances",
                     count_of(study.instances, "instance"), count_of(study.key.triangles, "triangle"));
}

bool is_simplified(const std::string& family) {
  return family.starts_with("OpenMesh: ") || family.starts_with("meshoptimizer: ");
}

std::optional<AtBytes> at_bytes(const Study& study, const std::string& family, double bytes) {
  const RivalPoint *below = nullptr, *above = nullptr;
  for (const RivalPoint& point : study.points) {
    if (point.family != family || !point.measured()) continue;
    const auto own = double(point.resident_bytes);
    if (own <= bytes && (!below || point.resident_bytes > below->resident_bytes)) below = &point;
    if (own > bytes && (!above || point.resident_bytes < above->resident_bytes)) above = &point;
  }
  if (!below) return std::nullopt;
  const bool largest = !above;
  if (largest) above = below;
  const double low = std::log(double(below->resident_bytes)), high = std::log(double(above->resident_bytes)),
               share = largest ? 0 : (std::log(bytes) - low) / (high - low);
  const auto ratio = [&](const char* set) { return between(below->ratio(set), above->ratio(set), share); };
  return AtBytes{*between(below->error(), above->error(), share), ratio("outer-lines"),
                 ratio("inner-surface"), ratio("sun"), largest};
}

}  // namespace nif::tools
