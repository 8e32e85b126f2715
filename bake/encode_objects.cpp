// The fourth step of a bake: trains what is learned, removes planes that save nothing, chooses among exact
// forms by counted work, and measures. Each object's ground truth lives as long as its turn.
#include <deque>

#include "bake/colors.hpp"
#include "bake/seeds.hpp"
#include "bake/steps.hpp"
#include "formats/base/status.hpp"

namespace nif::bake {
namespace {

/// Trains objects that share a network, or one. If that fails for one, makes it exact if possible.
void train_objects(BakeRun& run, std::span<Candidate> objects, const std::deque<GroundTruth>& truths) {
  std::vector<Lesson> lessons;
  for (size_t i = 0; i < objects.size(); ++i) lessons.push_back(objects[i].lesson(truths[i].source()));
  const std::string failure = train(run, lessons);
  if (!failure.empty() &&
      (objects.size() > 1 || !make_exact(run, objects.front(), truths.front().source(), failure)))
    throw Error(Status::training_failed, failure);
}

/// Removes planes that save no work.
void leave_out_planes(BakeRun& run, Candidate& candidate, const RaySource& source) {
  run.show(BakeProgress::Stage::choosing, candidate, 0.5);
  Form form = std::move(candidate.form());
  const std::string why =
      candidate.encoder().leave_out(candidate.prepared, source, run.options.seed + kChoosingSeed, form);
  if (run.options.colors && !why.empty()) reserve_colors(candidate.prepared, form);
  candidate.replace(std::move(form));
  if (!why.empty()) candidate.report.reason += "; " + why;
}

/// Objects that share a network, or one.
void encode_together(BakeRun& run, std::span<Candidate> objects) {
  stop_if(run.cancel);
  Candidate& first = objects.front();
  const bool trains = first.kind() == AnswerKind::learned, proves = first.kind() == AnswerKind::open,
             compares = first.kind() == AnswerKind::exact && first.exact_forms().size() > 1;
  if (trains || proves || compares || run.options.evaluation_rays > 0) {
    std::deque<GroundTruth> truths;
    for (const Candidate& object : objects) truths.emplace_back(object.prepared);
    const RaySource& source = truths.front().source();
    if (trains)
      train_objects(run, objects, truths);
    else if (compares)
      choose_least_work(run, first, source);
    else if (proves)
      leave_out_planes(run, first, source);
    for (size_t i = 0; i < objects.size(); ++i)
      objects[i].report.sets = measure_answers(run, objects[i], truths[i].source());
    if (trains && run.options.max_error && objects.size() == 1) meet_error(run, first, source);
    for (size_t i = 0; i < objects.size(); ++i) {
      const SetHits hits = measure_hits(run, objects[i], truths[i].source());
      objects[i].report.hits = figures_of(hits);
      for (const RaySet set : kHitSets) run.hits[size_t(set)] += hits[size_t(set)];
    }
  }
  for (Candidate& object : objects) object.finish();
}

}  // namespace

void encode_objects(BakeRun& run) {
  const std::span<Candidate> objects(run.candidates);
  const size_t together = run.encoders.front()->trains_together() ? objects.size() : 1;
  for (size_t i = 0; i < objects.size(); i += together) encode_together(run, objects.subspan(i, together));
}

std::string train(BakeRun& run, std::span<const Lesson> lessons) {
  const Candidate& shown = run.candidates[lessons.front().object];
  const auto show = [&](double share, double loss, double error) {
    run.show(BakeProgress::Stage::training, shown, 0.03 + 0.87 * share, loss, error);
  };
  run.show(BakeProgress::Stage::training, shown, 0.03);
  return shown.encoder().train({lessons, run.prepared.object_of, show, run.cancel, run.log});
}

}  // namespace nif::bake
