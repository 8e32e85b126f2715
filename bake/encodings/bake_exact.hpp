// Bakes `exact` objects: planes prove most answers, and triangles decide the others. Nothing is trained.
#pragma once

#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "bake/choice.hpp"
#include "bake/encodings/bake_bvh.hpp"
#include "bake/encodings/bake_segment.hpp"
#include "bake/planes/grid_shape.hpp"
#include "formats/nif/asset.hpp"

namespace nif::bake {

class Encoder;
struct BakeOptions;
struct ObjectReport;
struct RaySource;

struct ExactBaking {
  using Field = kernels::ExactField;
  struct Options {};
  struct Report : GridReport {};
  static constexpr bool kAutomatic = true;
  static constexpr std::string_view kStandsInFor = "";
  static constexpr bool kGrids = true;
  static constexpr AnswerKind kKind = AnswerKind::exact;
  static constexpr const char* kHelp =
      "planes first, triangles for the rest; no answer is wrong, no training";
  static std::unique_ptr<Encoder> make(const BakeOptions& options);
};

inline void add_report(const ExactBaking::Report& report, nlohmann::ordered_json& json) {
  add_grid(report, json);
}
void add_metadata(const ExactBaking::Report& report, const ObjectReport& all, const format::Object& object,
                  nlohmann::ordered_json& json);

/// Work of the fast kernels for rays, by which encodings are compared.
struct ExactCounts {
  SegmentCounts traversal;  ///< there is no network
  BvhCounts triangles;      ///< for rays left open, with culled boxes

  ExactCounts operator+(const ExactCounts& other) const {
    return {traversal + other.traversal, triangles + other.triangles};
  }
  double nanoseconds() const;
};
ExactCounts count_work(const kernels::ExactField& field, std::span<const kernels::Segment> rays);
/// Mean work per ray, as mean_work().
double work_of(const kernels::ExactField& field, const RaySource& source, uint64_t seed);

}  // namespace nif::bake
