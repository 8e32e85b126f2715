// Bakes `segment` objects: an occupancy grid, and a trained field for the rays that it leaves open.
#pragma once

#include <array>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "bake/choice.hpp"
#include "bake/network/describe_network.hpp"
#include "bake/network/error_limit.hpp"
#include "bake/planes/grid_shape.hpp"
#include "formats/nif/asset.hpp"
#include "kernels/reference/planes/grid_traversal.hpp"

namespace nif::bake {

class Encoder;
struct BakeOptions;
struct ObjectReport;
struct RaySource;

struct SegmentBaking {
  using Field = kernels::SegmentField;
  struct Options {
    double scale = 1;  ///< of the grids; if not 1, without a limit of their bytes
    std::optional<uint32_t>
        resolution;  ///< finest cells along the longest side, instead of what fits the budget
    std::optional<ErrorLimit> error_limit;  ///< only networks have thresholds
  };
  struct Report : GridReport {
    std::optional<ErrorLimitReport> error_limit;
  };
  static constexpr bool kAutomatic = true;
  static constexpr std::string_view kStandsInFor = "";
  static constexpr bool kGrids = true;
  static constexpr AnswerKind kKind = AnswerKind::learned;
  static constexpr const char* kHelp = "small fields, some answers are wrong";
  static std::unique_ptr<Encoder> make(const BakeOptions& options);
};

void add_report(const SegmentBaking::Report& report, nlohmann::ordered_json& json);
void add_metadata(const SegmentBaking::Report& report, const ObjectReport& all, const format::Object& object,
                  nlohmann::ordered_json& json);

/// Work of the fast kernels for rays, by which encodings are compared.
struct SegmentCounts {
  uint64_t rays = 0;
  uint64_t cubes = 0;  ///< passed in mixed bricks: fast traversals skip the others
  uint64_t open = 0;   ///< rays for the network

  SegmentCounts operator+(const SegmentCounts& other) const {
    return {rays + other.rays, cubes + other.cubes, open + other.open};
  }
  double nanoseconds() const;
};
/// Counts the cubes of a traversal that are in mixed bricks.
struct CountCubes {
  const kernels::PlanesField& field;
  uint64_t& cubes;

  void operator()(const kernels::Cube& cube) const {
    int32_t voxel[3];
    for (int a = 0; a < 3; ++a) voxel[a] = cube.low[a] >> field.levels;
    cubes += kernels::voxel_address(field, voxel).entry >= kernels::kFirstMixedBrick;
  }
};
/// Features and network have no effect.
SegmentCounts count_work(const kernels::SegmentField& field, std::span<const kernels::Segment> rays);
/// Mean work per ray, as mean_work().
double work_of(const kernels::SegmentField& field, const RaySource& source, uint64_t seed);

}  // namespace nif::bake
