// `nif bake --report`: the result of a bake as one HTML page for people.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "tools/common/progress.hpp"

namespace nif::tools {

/// State of a training at one time.
struct LossPoint {
  std::string object;
  double loss;
  double error;  ///< share of wrong answers among the training rays
};

/// Keeps the points of the loss curves. Memory is bounded, however long training takes.
class LossCurve {
 public:
  void add(const std::string& object, double loss, double error);
  const std::vector<LossPoint>& points() const { return points_; }

 private:
  static constexpr size_t kMostPoints = 4096;
  std::vector<LossPoint> points_;
  uint64_t seen_ = 0, step_ = 1;
};

/// Makes the page. `report` is the output of `nif bake --json` for an asset, and `metadata` is that asset's.
/// Queries the asset and Embree for pictures, a map of wrong answers, and errors by angle and distance. Runs
/// in parallel, with the same result for any number of threads. Throws Error(interrupted), and the errors of
/// reading the asset and its mesh.
std::string bake_page(const nlohmann::ordered_json& report, std::string_view metadata,
                      const std::string& mesh, std::span<const LossPoint> losses, Progress& progress);

}  // namespace nif::tools
