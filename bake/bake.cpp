// Calls the steps of a bake one after the other (bake/steps.hpp), and assembles what they made.
#include "bake/bake.hpp"

#include "bake/colors.hpp"
#include "bake/report.hpp"
#include "bake/steps.hpp"

namespace nif::bake {

BakeResult bake(const mesh::Scene& scene, const BakeOptions& options, const BakeCallback& callback,
                const std::atomic<bool>& cancel, TrainingLog* log) {
  BakeOptions meant = options;
  meant.colors = options.colors && has_colors(scene);
  if (meant.encoding != kAutomatic) meant.prefer.reset();
  TrainingLog none;
  BakeRun run{{scene, meant, callback, cancel, log ? *log : none}};
  prepare_objects(run);
  choose_forms(run);
  shrink_to_limit(run);
  encode_objects(run);
  check_error(run);
  return assemble(run);
}

BakeResult assemble(BakeRun& run) {
  BakeResult& result = run.result;
  for (const ObjectReport& report : result.objects) {
    result.triangles += report.triangles;
    for (RaySet set : kRaySets) result.sets[size_t(set)] += report.sets[size_t(set)];
  }
  result.hits = figures_of(run.hits);
  for (Candidate& candidate : run.candidates) {
    fill_colors(run.scene, candidate.prepared, candidate.form());
    candidate.encoder().add(std::move(candidate.form()), result.asset);
  }
  result.asset.metadata = make_metadata(run.scene, run.options, run.encoders, result);
  return std::move(result);
}

const EncodingCost* ObjectReport::cost_of(std::string_view which) const {
  for (const auto& [known, cost] : compared)
    if (known == which) return &cost;
  return nullptr;
}

}  // namespace nif::bake
