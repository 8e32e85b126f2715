// Counts errors. Chunks of rays are counted in parallel and added up in order, so that sums repeat. It is
// slow to find out whether a ground truth is in doubt, so that is asked only if a certain answer is wrong.
#include "bake/ground_truth/evaluate.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <boost/math/distributions/binomial.hpp>
#include <cmath>

namespace nif::bake {

double rate_bound(uint64_t rays, uint64_t count) {
  if (count == rays) return 1;
  constexpr double kDoubt = 0.01;
  return boost::math::binomial::find_upper_bound_on_p(double(rays), double(count), kDoubt);
}

Accuracy& Accuracy::operator+=(const Accuracy& other) {
  rays += other.rays;
  leak += other.leak;
  spurious += other.spurious;
  certain += other.certain;
  certain_wrong += other.certain_wrong;
  squared_error += other.squared_error;
  for (size_t b = 0; b < bins.size(); ++b) {
    bins[b].rays += other.bins[b].rays;
    bins[b].visible += other.bins[b].visible;
    bins[b].probability += other.bins[b].probability;
  }
  worst_error = std::max(worst_error, other.worst_error);
  least_certain = std::min(least_certain, other.least_certain);
  return *this;
}

double Accuracy::error_bound() const {
  const uint64_t wrong = leak + spurious;
  return wrong == 0 && certain == rays ? 0 : rate_bound(rays, wrong);
}

double Accuracy::calibration_error() const {
  if (uncertain() == 0) return 0;
  double off = 0;
  for (const CalibrationBin& bin : bins) off += std::abs(bin.probability - double(bin.visible));
  return off / double(uncertain());
}

namespace {

size_t bin_of(float probability) {
  constexpr auto kBins = static_cast<float>(kCalibrationBins);
  return probability > 0 ? size_t(std::min(probability * kBins, kBins - 1)) : 0;
}

}  // namespace

Accuracy evaluate(const RaysWithTruth& rays, const Answerer& answer, const EmbreeTruth& embree) {
  // Chunks end where groups do.
  constexpr size_t kChunk = 4096;
  std::vector<std::pair<size_t, size_t>> chunks;
  for (const size_t end : rays.group_ends)
    for (size_t first = chunks.empty() ? 0 : chunks.back().second; first < end;) {
      chunks.emplace_back(first, std::min(first + kChunk, end));
      first = chunks.back().second;
    }
  std::vector<Accuracy> parts(chunks.size());
  tbb::parallel_for(size_t{0}, chunks.size(), [&](size_t b) {
    const size_t first = chunks[b].first, size = chunks[b].second - first;
    uint8_t visible[kChunk], certain[kChunk];
    float probability[kChunk];
    answer(std::span(rays.segments).subspan(first, size), {visible, certain, probability});
    Accuracy& part = parts[b];
    part.rays = size;
    for (size_t i = 0; i < size; ++i) {
      const bool truth = rays.visible[first + i], wrong = (visible[i] != 0) != truth;
      part.leak += wrong && !truth;
      part.spurious += wrong && truth;
      part.certain += certain[i] != 0;
      part.certain_wrong += wrong && certain[i] && !embree.in_doubt(rays.segments[first + i]);
      const double off = double(probability[i]) - (truth ? 1.0 : 0.0);
      part.squared_error += off * off;
      if (certain[i]) continue;
      CalibrationBin& bin = part.bins[bin_of(probability[i])];
      ++bin.rays;
      bin.visible += truth;
      bin.probability += double(probability[i]);
    }
  });
  Accuracy all, group;
  for (size_t b = 0, g = 0; b < parts.size(); ++b) {
    group += parts[b];
    if (chunks[b].second != rays.group_ends[g]) continue;
    group.worst_error = group.error();
    group.least_certain = group.rate(group.certain);
    all += group;
    group = {};
    ++g;
  }
  return all;
}

}  // namespace nif::bake
