// `nif bake --report`: what a bake has come to, as one page for people.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "tools/common/progress.hpp"

namespace nif::tools {

/// How a training was at some time.
struct LossPoint {
  std::string object;
  double loss;
  double error;  ///< share of wrong answers among the rays that it was trained with
};

/// Keeps what the curves of trainings need, and not much more, however long they take.
class LossCurve {
 public:
  void add(const std::string& object, double loss, double error);
  const std::vector<LossPoint>& points() const { return points_; }

 private:
  static constexpr size_t kMostPoints = 4096;
  std::vector<LossPoint> points_;
  uint64_t seen_ = 0, step_ = 1;
};

/// The page. `report` is what `nif bake --json` prints of the asset that it names, and `metadata` that
/// asset's. Asks the asset and Embree: pictures, a map of wrong answers, and errors by angle and distance. In
/// parallel, and the same for any number of threads. Throws Error(interrupted), and as the reading of the
/// asset and of its mesh does.
std::string bake_page(const nlohmann::ordered_json& report, std::string_view metadata,
                      const std::string& mesh, std::span<const LossPoint> losses, Progress& progress);

}  // namespace nif::tools
