// Checks the metadata of a file by the schema in docs/metadata.md. Readers never trust the metadata; people
// and tools read it.
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "formats/base/json_text.hpp"
#include "formats/validate/validate.hpp"

namespace nif::validate {
namespace {

using Json = nlohmann::json;

enum class Kind : uint8_t {
  object,
  array,
  text,
  flag,    ///< true or false
  count,   ///< a whole number, at least 0
  number,  ///< finite
  share,   ///< a number from 0 to 1
};

bool is_of(const Json& value, Kind kind) {
  switch (kind) {
    case Kind::object:
      return value.is_object();
    case Kind::array:
      return value.is_array();
    case Kind::text:
      return value.is_string();
    case Kind::flag:
      return value.is_boolean();
    case Kind::count:
      return value.is_number_unsigned();
    case Kind::number:
      return value.is_number() && std::isfinite(value.get<double>());
    case Kind::share:
      return value.is_number() && value.get<double>() >= 0 && value.get<double>() <= 1;
  }
  return false;
}

const char* text_of(Kind kind) {
  constexpr const char* kTexts[] = {
      "an object",           "an array", "a text", "true or false", "a whole number from 0 on", "a number",
      "a number from 0 to 1"};
  return kTexts[size_t(kind)];
}

struct Member {
  const char* name;
  Kind kind;
  bool required;
};

class MetadataCheck {
 public:
  MetadataCheck(const format::AssetView& asset, Findings& findings)
      : asset_(asset), placed_(asset.placed_count()), findings_(findings) {}

  void run() {
    const Json root = parse(asset_.metadata);
    if (!root.is_object()) return findings_.add(Advice::metadata_not_json, kPlace);
    const Json* tool = member(root, "tool");
    const Json* tool_name = tool ? member(*tool, "name") : nullptr;
    if (!tool_name || *tool_name != "nifkit") return;  // of another program, with its own schema
    constexpr Member kMembers[] = {{"tool", Kind::object, true},       {"seed", Kind::count, true},
                                   {"options", Kind::object, true},    {"source", Kind::object, true},
                                   {"accuracy", Kind::object, true},   {"objects", Kind::array, true},
                                   {"hierarchy", Kind::object, false}, {"merge", Kind::object, false},
                                   {"choice", Kind::object, false},    {"alpha", Kind::object, false}};
    check(root, "", kMembers);
    constexpr Member kTool[] = {{"name", Kind::text, true}, {"version", Kind::text, true}};
    check(*tool, "/tool", kTool);
    if (const Json* options = member(root, "options")) check_options(*options);
    constexpr Member kSource[] = {{"hash", Kind::text, true}};
    if (const Json* source = member(root, "source")) {
      check(*source, "/source", kSource);
      if (const Json* hash = member(*source, "hash"); hash && hash->is_string() && !is_hash(*hash))
        wrong("/source/hash", "xxh3-64: and 16 digits from 0 to 9 and a to f");
    }
    if (const Json* accuracy = member(root, "accuracy")) check_accuracy(*accuracy, "/accuracy");
    if (const Json* objects = member(root, "objects")) check_objects(*objects);
    if (const Json* hierarchy = member(root, "hierarchy")) check_hierarchy(*hierarchy);
    if (const Json* merge = member(root, "merge")) check_merge(*merge);
    if (const Json* choice = member(root, "choice")) check_choice(*choice);
    if (const Json* alpha = member(root, "alpha")) check_alpha(*alpha);
  }

 private:
  static constexpr const char* kPlace = "section META";

  /// Null if it is not JSON, starts with a byte order mark, is nested too deep, or an object has two members
  /// of one name.
  static Json parse(std::string_view text) {
    if (text.starts_with("\xef\xbb\xbf") || too_deep_at(text) != text.npos) return nullptr;
    std::vector<std::set<std::string>> open;
    bool twice = false;
    Json root = Json::parse(
        text,
        [&](int, Json::parse_event_t event, Json& parsed) {
          if (event == Json::parse_event_t::object_start) open.emplace_back();
          if (event == Json::parse_event_t::object_end) open.pop_back();
          if (event == Json::parse_event_t::key && !open.back().insert(parsed.get<std::string>()).second)
            twice = true;
          return true;
        },
        false);
    return twice ? Json() : root;
  }

  static bool is_hash(const std::string& text) {
    constexpr std::string_view kStart = "xxh3-64:";
    return text.starts_with(kStart) && text.size() == kStart.size() + 16 &&
           text.find_first_not_of("0123456789abcdef", kStart.size()) == text.npos;
  }

  static std::string place_of(const std::string& path) {
    return path.empty() ? kPlace : std::string(kPlace) + ", " + path;
  }

  /// Null if there is none; check() has already reported objects and arrays of another kind.
  static const Json* member(const Json& json, const char* name) {
    const auto found = json.is_object() ? json.find(name) : json.end();
    return found == json.end() ? nullptr : &*found;
  }

  void wrong(const std::string& path, const std::string& should) {
    findings_.add(Advice::metadata_value, place_of(path), "is not " + should);
  }

  template <size_t N>
  void check(const Json& json, const std::string& path, const Member (&members)[N]) {
    for (const Member& one : members) {
      const Json* value = member(json, one.name);
      if (!value && one.required && json.is_object())
        findings_.add(Advice::metadata_key_missing, place_of(path),
                      std::string("the member '") + one.name + "' is missing");
      if (value && !is_of(*value, one.kind)) wrong(path + "/" + one.name, text_of(one.kind));
    }
  }

  void check_options(const Json& options) {
    constexpr Member kOptions[] = {{"encoding", Kind::text, true},
                                   {"preset", Kind::text, false},
                                   {"mix", Kind::object, false},
                                   {"resolution", Kind::count, false},
                                   {"rays_from", Kind::text, false},
                                   {"effort", Kind::number, false},
                                   {"spherical", Kind::object, false},
                                   {"uncoded", Kind::flag, false},
                                   {"source_triangles", Kind::flag, false},
                                   {"deforms", Kind::flag, false},
                                   {"colors", Kind::flag, false},
                                   {"max_bytes", Kind::count, false},
                                   {"prefer", Kind::text, false},
                                   {"max_error", Kind::share, false},
                                   {"max_leak", Kind::share, false},
                                   {"max_spurious", Kind::share, false}};
    check(options, "/options", kOptions);
    if (const Json* mix = member(options, "mix"); mix && mix->is_object())
      for (const auto& [set, share] : mix->items())
        if (!is_of(share, Kind::share)) wrong("/options/mix/" + set, text_of(Kind::share));
  }

  /// Accuracy figures by ray set.
  void check_accuracy(const Json& accuracy, const std::string& path) {
    if (!accuracy.is_object()) return;
    constexpr Member kFigures[] = {
        {"rays", Kind::count, true},     {"error", Kind::share, true},   {"leak", Kind::share, true},
        {"spurious", Kind::share, true}, {"certain", Kind::share, true}, {"certain_wrong", Kind::count, true},
        {"brier", Kind::share, true},    {"worst", Kind::object, false}, {"hits", Kind::object, false}};
    for (const auto& [set, figures] : accuracy.items()) {
      const std::string at = path + "/" + set;
      if (!figures.is_object()) {
        wrong(at, text_of(Kind::object));
        continue;
      }
      check(figures, at, kFigures);
      const Json* wrong_ones = member(figures, "certain_wrong");
      if (wrong_ones && is_of(*wrong_ones, Kind::count) && wrong_ones->get<uint64_t>() > 0)
        findings_.add(
            Advice::metadata_certain_wrong, place_of(at),
            "states that " + std::to_string(wrong_ones->get<uint64_t>()) + " certain answers were wrong");
      constexpr Member kWorst[] = {{"error", Kind::share, true}, {"certain", Kind::share, true}};
      if (const Json* worst = member(figures, "worst")) check(*worst, at + "/worst", kWorst);
      if (const Json* hits = member(figures, "hits")) check_hits(*hits, at + "/hits");
    }
  }

  void check_hits(const Json& hits, const std::string& path) {
    constexpr Member kHits[] = {{"rays", Kind::count, true},       {"missed", Kind::share, true},
                                {"false_hits", Kind::share, true}, {"diagonals", Kind::object, false},
                                {"voxels", Kind::object, false},   {"degrees", Kind::object, false}};
    check(hits, path, kHits);
    for (const char* name : {"diagonals", "voxels", "degrees"}) {
      const Json* percentiles = member(hits, name);
      if (!percentiles || !percentiles->is_object()) continue;
      double before = 0;
      for (const char* percentile : {"median", "p90", "p95", "p99"}) {
        const Json* value = member(*percentiles, percentile);
        if (value && is_of(*value, Kind::number) && value->get<double>() >= before)
          before = value->get<double>();
        else
          wrong(path + "/" + name + "/" + percentile, "a number from 0 on, and from the one before it on");
      }
    }
  }

  void check_objects(const Json& objects) {
    if (!objects.is_array()) return;
    if (objects.size() != asset_.objects.size())
      return findings_.add(Advice::metadata_other_object, kPlace,
                           "describes " + std::to_string(objects.size()) + " objects; the file has " +
                               std::to_string(asset_.objects.size()));
    constexpr Member kObject[] = {{"name", Kind::text, true},
                                  {"encoding", Kind::text, true},
                                  {"reason", Kind::text, true},
                                  {"triangles", Kind::count, true},
                                  {"bounds", Kind::array, true},
                                  {"bias", Kind::number, true},
                                  {"closed_components", Kind::count, true},
                                  {"open_components", Kind::count, true},
                                  {"accuracy", Kind::object, true},
                                  {"training_rays", Kind::count, false},
                                  {"voxels", Kind::array, false},
                                  {"networks", Kind::count, false},
                                  {"primary_rays", Kind::count, false},
                                  {"error_limit", Kind::object, false}};
    for (size_t i = 0; i < objects.size(); ++i) {
      const std::string path = "/objects/" + std::to_string(i);
      const Json& described = objects[i];
      if (!described.is_object()) {
        wrong(path, text_of(Kind::object));
        continue;
      }
      check(described, path, kObject);
      check_described(described, asset_.objects[i], path);
      if (const Json* accuracy = member(described, "accuracy")) check_accuracy(*accuracy, path + "/accuracy");
    }
  }

  /// Does it agree with the object's record?
  void check_described(const Json& described, const format::ObjectView& object, const std::string& path) {
    const auto differs = [&](const char* name, const Json& stored) {
      const Json* value = member(described, name);
      if (value && *value != stored)
        findings_.add(Advice::metadata_other_object, place_of(path + "/" + name),
                      "is not what the object's record says");
    };
    differs("name", std::string(object.name));
    if (!object.unsupported) differs("encoding", format::encoding_of(object).name);
    differs("bounds", Json::array({object.aabb_min, object.aabb_max}));
    differs("bias", object.bias);
    if (const kernels::PlanesField* grid = format::grid_of(object)) differs("voxels", grid->voxels);
    if (object.spherical) differs("networks", object.spherical->network);
    if (const Json* limit = member(described, "error_limit"); limit && object.network) {
      const Json* threshold = member(*limit, "threshold");
      if (threshold && *threshold != object.network->field.network.calibration.threshold)
        findings_.add(Advice::metadata_other_object, place_of(path + "/error_limit/threshold"),
                      "is not what the network's record says");
    }
    constexpr uint32_t kMany = 0xffffffffu;
    if (object.triangle_count != kMany) differs("triangles", object.triangle_count);
  }

  /// Each node must come after those above it; each instance must have a node, or null.
  void check_hierarchy(const Json& hierarchy) {
    constexpr Member kHierarchy[] = {{"nodes", Kind::array, true}, {"instances", Kind::array, true}};
    check(hierarchy, "/hierarchy", kHierarchy);
    const Json *nodes = member(hierarchy, "nodes"), *instances = member(hierarchy, "instances");
    if (!nodes || !nodes->is_array() || !instances || !instances->is_array()) return;
    const auto fault = [&](const std::string& path, const std::string& what) {
      findings_.add(Advice::metadata_hierarchy, place_of("/hierarchy" + path), what);
    };
    std::map<uint64_t, bool> known;
    for (size_t i = 0; i < nodes->size(); ++i) {
      const std::string path = "/nodes/" + std::to_string(i);
      constexpr Member kNode[] = {
          {"node", Kind::count, true}, {"name", Kind::text, false}, {"parent", Kind::count, false}};
      check((*nodes)[i], "/hierarchy" + path, kNode);
      const Json *number = member((*nodes)[i], "node"), *parent = member((*nodes)[i], "parent");
      if (parent && is_of(*parent, Kind::count) && !known.contains(parent->get<uint64_t>()))
        fault(path, "its parent is not before it");
      if (number && is_of(*number, Kind::count)) known[number->get<uint64_t>()] = true;
    }
    if (instances->size() != placed_)
      return fault("/instances", "has " + std::to_string(instances->size()) + " members; the file places " +
                                     std::to_string(placed_) + " objects");
    for (size_t i = 0; i < instances->size(); ++i) {
      const Json& node = (*instances)[i];
      if (!node.is_null() && !(is_of(node, Kind::count) && known.contains(node.get<uint64_t>())))
        fault("/instances/" + std::to_string(i), "is none of the nodes");
    }
  }

  void check_merge(const Json& merge) {
    constexpr Member kMerge[] = {{"objects", Kind::array, true}};
    check(merge, "/merge", kMerge);
    const Json* objects = member(merge, "objects");
    if (!objects || !objects->is_array()) return;
    for (size_t i = 0; i < objects->size(); ++i) {
      const Json* instance = member((*objects)[i], "instance");
      if (!instance || !is_of(*instance, Kind::count) || instance->get<uint64_t>() >= placed_)
        findings_.add(Advice::metadata_merge, place_of("/merge/objects/" + std::to_string(i)),
                      "is no instance of the file");
    }
  }

  void check_choice(const Json& choice) {
    constexpr Member kChoice[] = {{"only", Kind::array, false}, {"except", Kind::array, false}};
    check(choice, "/choice", kChoice);
    for (const Member& list : kChoice)
      if (const Json* names = member(choice, list.name); names && names->is_array())
        for (size_t i = 0; i < names->size(); ++i)
          if (!(*names)[i].is_string())
            wrong("/choice/" + std::string(list.name) + "/" + std::to_string(i), text_of(Kind::text));
  }

  void check_alpha(const Json& alpha) {
    constexpr Member kAlpha[] = {{"cutoff", Kind::number, true},
                                 {"blend", Kind::text, true},
                                 {"glass", Kind::text, true},
                                 {"resolution", Kind::count, false},
                                 {"materials", Kind::array, true}};
    check(alpha, "/alpha", kAlpha);
    constexpr Member kMaterial[] = {{"name", Kind::text, true},      {"rule", Kind::text, true},
                                    {"cutoff", Kind::number, false}, {"solid", Kind::count, true},
                                    {"cut", Kind::count, true},      {"clear", Kind::count, true},
                                    {"filled", Kind::count, false}};
    if (const Json* materials = member(alpha, "materials"); materials && materials->is_array())
      for (size_t i = 0; i < materials->size(); ++i)
        check((*materials)[i], "/alpha/materials/" + std::to_string(i), kMaterial);
  }

  const format::AssetView& asset_;
  const size_t placed_;  ///< counted once, because metadata may ask for it often
  Findings& findings_;
};

}  // namespace

void check_metadata(const format::AssetView& asset, Findings& findings) {
  if (asset.metadata.empty()) return findings.add(Advice::metadata_missing, "");
  MetadataCheck(asset, findings).run();
}

}  // namespace nif::validate
