// Baking of `exact` objects: planes prove most answers, and triangles decide the others. Nothing is trained.
#pragma once

#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "bake/proof/shape.hpp"
#include "formats/nif/asset.hpp"

namespace nif::bake {

class Encoder;
struct BakeOptions;
struct ObjectReport;

struct ExactBaking {
  using Data = format::ExactData;
  struct Options {};
  struct Report : GridReport {};
  static constexpr bool kAutomatic = false;
  static constexpr bool kGrids = true;
  static constexpr bool kTrained = false;
  static constexpr const char* kHelp = "exact and fast: planes first, triangles for the rest, no training";
  static std::unique_ptr<Encoder> make(const BakeOptions& options);
};

inline void add_report(const ExactBaking::Report& report, nlohmann::ordered_json& json) {
  add_grid(report, json);
}
void add_metadata(const ExactBaking::Report& report, const ObjectReport& all, const format::Object& object,
                  nlohmann::ordered_json& json);
void describe(const format::ExactView& view, nlohmann::ordered_json& json);
std::string summary(const format::ExactView& view);
inline std::vector<std::string> details(const format::ExactView&) { return {}; }

}  // namespace nif::bake
