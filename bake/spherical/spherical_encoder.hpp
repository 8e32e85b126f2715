// Bakes `spherical` objects, those of the paper: grids of latent vectors for each, and networks that they may
// share.
#pragma once

#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "bake/choice.hpp"
#include "bake/spherical/describe_spherical.hpp"
#include "bake/spherical/spherical_field_options.hpp"
#include "formats/nif/asset.hpp"

namespace nif::bake {

class Encoder;
struct BakeOptions;
struct ObjectReport;

struct SphericalBaking {
  using Field = kernels::SphericalField;
  struct Options {
    SphericalBakeOptions spherical;
  };
  struct Report {
    uint64_t primary_rays = 0;  ///< number of rays that a field for primary rays learned from
  };
  static constexpr bool kAutomatic = false;
  static constexpr std::string_view kStandsInFor = "";
  static constexpr bool kGrids = true;
  static constexpr AnswerKind kKind = AnswerKind::learned;
  static constexpr const char* kHelp = "the published Neural Intersection Function, for comparison";
  /// Throws InvalidOption.
  static std::unique_ptr<Encoder> make(const BakeOptions& options);
};

void add_report(const SphericalBaking::Report& report, nlohmann::ordered_json& json);
void add_metadata(const SphericalBaking::Report& report, const ObjectReport& all,
                  const format::Object& object, nlohmann::ordered_json& json);

}  // namespace nif::bake
