// Measures objects against the ground truth, and compares their error with the limit. Objects share the rays
// of the evaluation, but each gets enough for useful figures.
#include <fmt/format.h>

#include <algorithm>

#include "bake/reference_answers.hpp"
#include "bake/seeds.hpp"
#include "bake/steps.hpp"

namespace nif::bake {

SetAccuracies measure_answers(const BakeRun& run, const Candidate& candidate, const RaySource& source) {
  SetAccuracies sets{};
  const BakeOptions& options = run.options;
  if (options.evaluation_rays == 0) return sets;
  const uint64_t share = std::max<uint64_t>(20'000, options.evaluation_rays / run.candidates.size());
  const size_t count = size_t(std::min(share, options.evaluation_rays));
  const Answerer answer = reference_answerer(candidate.form().field());
  for (RaySet set : kRaySets) {
    stop_if(run.cancel);
    run.show(BakeProgress::Stage::measuring, candidate, 0.90 + 0.02 * double(set));
    sets[size_t(set)] =
        evaluate(make_ray_set(source, set, count, options.seed + kMeasuringSeed), answer, source.embree);
  }
  return sets;
}

// On a tenth of the rays: finding a hit takes longer than finding out whether there is one. An object whose
// planes were left out is not measured in voxels.
SetHits measure_hits(const BakeRun& run, const Candidate& candidate, const RaySource& source) {
  SetHits sets;
  const BakeOptions& options = run.options;
  if (options.evaluation_rays == 0) return sets;
  constexpr uint64_t kLeast = 1000;  // for one object of many
  const uint64_t all = std::max<uint64_t>(1, options.evaluation_rays / 10);
  const size_t count = size_t(std::min(std::max(kLeast, all / run.candidates.size()), all));
  const kernels::AnyField field = candidate.form().field();
  const auto* planes = std::get_if<kernels::PlanesField>(&field);
  const ObjectScale scale{candidate.prepared.box.diagonal(),
                          planes && !kernels::has_planes(*planes) ? 0 : voxels_per_unit(field)};
  for (const RaySet set : kHitSets) {
    stop_if(run.cancel);
    run.show(BakeProgress::Stage::measuring, candidate, 0.99);
    const RaysWithTruth rays = make_ray_set(source, set, count, options.seed + kMeasuringSeed);
    sets[size_t(set)] = evaluate_hits(rays.segments, reference_finder(field), source.embree, scale);
  }
  return sets;
}

ErrorBound error_bound(const SetAccuracies& sets) {
  ErrorBound worst;
  for (RaySet set : kRaySets) {
    const double bound = sets[size_t(set)].error_bound();
    if (bound > worst.bound) worst = {bound, sets[size_t(set)].error(), set};
  }
  return worst;
}

void check_error(const BakeRun& run) {
  if (!run.options.max_error) return;
  SetAccuracies learned{};
  for (const Candidate& candidate : run.candidates)
    for (const RaySet set : kRaySets)
      if (candidate.kind() == AnswerKind::learned) learned[size_t(set)] += candidate.report.sets[size_t(set)];
  const ErrorBound worst = error_bound(learned);
  if (worst.bound <= *run.options.max_error) return;
  throw TargetNotMet(
      TargetNotMet::Limit::error,
      fmt::format("{:.4f}% of {} are answered wrongly, below {:.4f}% with 99% confidence; the limit is "
                  "{:.4f}%",
                  worst.error * 100, name_of(worst.set), worst.bound * 100, *run.options.max_error * 100));
}

}  // namespace nif::bake
