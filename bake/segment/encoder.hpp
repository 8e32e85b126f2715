// Baking of `segment` objects: an occupancy grid, and a field that is trained for the rest.
#pragma once

#include <array>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "formats/nif/asset.hpp"

namespace nif::bake {

class Encoder;
struct BakeOptions;
struct ObjectReport;
struct RaySource;

struct SegmentBaking {
  using Data = format::SegmentData;
  struct Options {
    double scale = 1;  ///< of the grids; other than 1: whatever that takes
    std::optional<uint32_t>
        resolution;  ///< finest cells along the longest side, in place of what fits the budget
  };
  struct Report {
    std::array<uint32_t, 3> voxels{};  ///< of the grid
    size_t surface_voxels = 0, inside_voxels = 0, unknown_voxels = 0;
    size_t parts = 0;   ///< of surface voxels that are cut
    size_t planes = 0;  ///< surface voxels and parts with planes
    size_t walls = 0;   ///< of those, with a wall
  };
  static constexpr bool kAutomatic = true;
  static constexpr bool kTrained = true;
  static constexpr const char* kHelp = "small fields, some answers are wrong";
  static std::unique_ptr<Encoder> make(const BakeOptions& options);
};

void add_report(const SegmentBaking::Report& report, nlohmann::ordered_json& json);
void add_metadata(const SegmentBaking::Report& report, const ObjectReport& all, const format::Object& object,
                  nlohmann::ordered_json& json);
void describe(const format::SegmentView& view, nlohmann::ordered_json& json);
std::string summary(const format::SegmentView& view);
inline std::vector<std::string> details(const format::SegmentView&) { return {}; }

/// Mean work of a ray, as mean_work(). Features and network do not matter to it.
double work_of(const kernels::SegmentField& field, const RaySource& source, uint64_t seed);

}  // namespace nif::bake
