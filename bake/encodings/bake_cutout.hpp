// Bakes `cutout` objects: exact, without training. Objects whose triangles have holes become that, unless an
// encoding that may have them is asked for.
#pragma once

#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <string_view>

#include "bake/choice.hpp"
#include "bake/holes/describe_holes.hpp"
#include "formats/nif/asset.hpp"

namespace nif::bake {

class Encoder;
struct BakeOptions;
struct ObjectReport;

struct CutoutBaking {
  using Field = kernels::CutoutField;
  struct Options {};
  struct Report {};
  static constexpr bool kForHoles = true;
  static constexpr bool kAutomatic = true;
  static constexpr std::string_view kStandsInFor{};
  static constexpr bool kGrids = false;
  static constexpr AnswerKind kKind = AnswerKind::exact;
  static constexpr const char* kHelp = "exact triangles of which some have holes";
  static std::unique_ptr<Encoder> make(const BakeOptions& options);
};

inline void add_report(const CutoutBaking::Report&, nlohmann::ordered_json&) {}
inline void add_metadata(const CutoutBaking::Report&, const ObjectReport&, const format::Object&,
                         nlohmann::ordered_json&) {}

}  // namespace nif::bake
