// Searches for the smallest grid whose error is within the limit: trains and measures the object at other
// scales, between the smallest that meets the limit and the largest that does not.
#include <fmt/format.h>

#include <cmath>

#include "bake/steps.hpp"
#include "formats/base/status.hpp"

namespace nif::bake {

void meet_error(BakeRun& run, Candidate& candidate, const RaySource& source) {
  if (candidate.kind() != AnswerKind::learned) return;
  constexpr int kMostBakes = 6;
  constexpr double kStep = 1.4, kFineEnough = 1.08;
  ObjectReport& report = candidate.report;
  double met = 0, missed = 0;  // scales: the smallest that meets it, the largest that does not
  std::optional<Form> best;
  ObjectReport best_report;
  for (int bakes = 1;; ++bakes) {
    const double bound = error_bound(report.sets).bound, scale = candidate.form().scale;
    report.bakes.emplace_back(candidate.form().cost.bytes, bound);
    if (bound <= *run.options.max_error) {
      met = scale;
      best = candidate.form();
      best_report = report;
    } else {
      missed = scale;
    }
    const double next = met == 0 ? missed * kStep : missed == 0 ? met / kStep : std::sqrt(met * missed);
    const bool narrow = met > 0 && missed > 0 && met / missed < kFineEnough;
    if (bakes == kMostBakes || narrow || !candidate.encoder().has_scale(next)) break;
    candidate.lay_out(candidate.chosen(), next, false);
    if (!run.fits()) break;
    const Lesson lesson = candidate.lesson(source);
    if (const std::string failure = train(run, {&lesson, 1}); !failure.empty()) {
      if (!best) throw Error(Status::training_failed, failure);
      break;
    }
    report.sets = measure_answers(run, candidate, source);
  }
  if (best) {
    best_report.bakes = std::move(report.bakes);
    report = std::move(best_report);
    candidate.replace(std::move(*best));
    return;
  }
  const ErrorBound worst = error_bound(report.sets);
  if (make_exact(run, candidate, source,
                 fmt::format("{} would answer {:.2f} % of {} wrongly, more than is allowed",
                             candidate.encoder().noun(), 100 * worst.error, name_of(worst.set))))
    report.sets = measure_answers(run, candidate, source);
}

}  // namespace nif::bake
