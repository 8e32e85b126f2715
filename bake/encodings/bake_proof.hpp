// Bakes `proof` objects: planes prove most answers, and the others stay open, for a BVH of the caller's.
// Nothing is trained.
#pragma once

#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "bake/choice.hpp"
#include "bake/planes/describe_planes.hpp"
#include "bake/planes/grid_shape.hpp"
#include "formats/nif/asset.hpp"

namespace nif::bake {

class Encoder;
struct BakeOptions;
struct ObjectReport;

struct ProofBaking {
  using Field = kernels::PlanesField;
  struct Options {};
  struct Report : GridReport {};
  static constexpr bool kAutomatic = true;
  static constexpr std::string_view kStandsInFor = "";
  static constexpr bool kGrids = true;
  static constexpr AnswerKind kKind = AnswerKind::open;
  static constexpr const char* kHelp =
      "planes alone, for those who have a BVH: never wrong, but some rays stay open";
  static std::unique_ptr<Encoder> make(const BakeOptions& options);
};

inline void add_report(const ProofBaking::Report& report, nlohmann::ordered_json& json) {
  add_grid(report, json);
}
void add_metadata(const ProofBaking::Report& report, const ObjectReport& all, const format::Object& object,
                  nlohmann::ordered_json& json);

}  // namespace nif::bake
