// Measures the accuracy of an asset's answers on a ray set with ground truth.
#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <span>

#include "bake/ground_truth/ray_sets.hpp"

namespace nif::bake {

/// If something held for `count` of `rays` random rays, an upper bound, 0..1, of the share of all possible
/// rays for which it holds, with 99 % confidence (Clopper and Pearson 1934). There must be some rays.
double rate_bound(uint64_t rays, uint64_t count);

/// Answers that are not certain, and whose probability of being visible lies in one tenth of 0..1.
struct CalibrationBin {
  uint64_t rays = 0;
  uint64_t visible = 0;    ///< in truth
  double probability = 0;  ///< sum over rays, as answered

  double mean() const { return rays ? probability / double(rays) : 0; }
  double share() const { return rays ? double(visible) / double(rays) : 0; }
};
constexpr size_t kCalibrationBins = 10;

/// The figures stated for a ray set (docs/ray-sets.md). Counts are of rays.
struct Accuracy {
  uint64_t rays = 0;
  uint64_t leak = 0;           ///< occluded, called visible
  uint64_t spurious = 0;       ///< visible, called occluded
  uint64_t certain = 0;        ///< answered exactly, by the traversal alone
  uint64_t certain_wrong = 0;  ///< of those, wrong although the truth is not in doubt: must be 0
  double squared_error = 0;    ///< sum over rays of (probability of being visible - truth)^2
  // Over the groups of rays that are examined separately, the suns or cameras: the largest error, and the
  // smallest share of certain answers.
  double worst_error = 0, least_certain = 1;

  std::array<CalibrationBin, kCalibrationBins> bins{};  ///< 0 to 0.1, 0.1 to 0.2, ..., the last with 1

  double rate(uint64_t count) const { return rays ? double(count) / double(rays) : 0; }
  double error() const { return rate(leak + spurious); }
  /// The rate_bound() of the error; 0 if all answers are certain and right.
  double error_bound() const;
  double brier() const { return rays ? squared_error / double(rays) : 0; }
  /// Answers that are not certain.
  uint64_t uncertain() const { return rays - certain; }
  /// The mean over uncertain() answers of how far the mean probability of their bin is from the share of its
  /// rays that are visible (expected calibration error; Naeini et al. 2015). 0 if all answers are certain.
  double calibration_error() const;
  Accuracy& operator+=(const Accuracy& other);
};

using SetAccuracies = std::array<Accuracy, kAllRaySets.size()>;  ///< by RaySet

/// Answers to consecutive segments; each array has one entry per segment.
struct Answers {
  uint8_t* visible;
  uint8_t* certain;
  float* probability;  ///< of being visible, 0..1
};
/// Answers consecutive segments; called from several threads at once.
using Answerer = std::function<void(std::span<const Segment>, const Answers&)>;

/// Compares answers with the ground truth of `embree`, in parallel; sums are ordered, so the figures do not
/// depend on the number of threads.
Accuracy evaluate(const RaysWithTruth& rays, const Answerer& answer, const EmbreeTruth& embree);

}  // namespace nif::bake
