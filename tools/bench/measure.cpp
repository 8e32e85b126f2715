// The order of steps: load the asset, draw rays and their ground truth, state the error on them, build
// Embree's BVHs, race. Errors and speeds are for the very same rays.
#include "tools/bench/measure.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "formats/base/status.hpp"
#include "tools/bench/entrants.hpp"
#include "tools/bench/race.hpp"
#include "tools/common/interruption.hpp"
#include "tools/common/measured_asset.hpp"
#include "tools/common/proofs_first.hpp"

namespace nif::tools {
namespace {

void add_stages(const BenchOptions& options, const std::vector<Subject>& subjects, size_t index,
                SetSpeeds& speeds) {
  std::vector<const bake::RaysWithTruth*> rays;
  for (const Subject& subject : subjects) rays.push_back(&subject.sets[index]);
  const auto wrong = [](const bake::Accuracy& accuracy) { return accuracy.leak + accuracy.spurious; };
  const size_t rounds = options.schedule.rounds;
  speeds.stages = time_stages(options.asset, rays, rounds, wrong(speeds.accuracy));
  if (speeds.against)
    speeds.against->stages = time_stages(options.against, rays, rounds, wrong(speeds.against->accuracy));
}

}  // namespace

std::string_view name_of(bake::EmbreeBuild build) {
  switch (build) {
    case bake::EmbreeBuild::standard:
      return "default";
    case bake::EmbreeBuild::high:
      return "high";
    case bake::EmbreeBuild::compact:
      return "compact";
    case bake::EmbreeBuild::robust:
      return "robust";
    case bake::EmbreeBuild::refitted:
      return "refitted";
  }
  return "";
}

std::string name_of(const EmbreeVariant& variant) {
  return fmt::format("{} {}{}", name_of(kEmbreeBuilds[variant.build]), bake::name_of(variant.call),
                     variant.coherent ? " coherent" : "");
}

std::string name_of(const Behind& behind) {
  return fmt::format("{} {}", name_of(kEmbreeBuilds[behind.build]), bake::name_of(behind.call));
}

const EmbreeVariant& SetSpeeds::best(size_t build) const {
  return *std::find_if(embree.begin(), embree.end(),
                       [&](const EmbreeVariant& v) { return v.build == build; });
}

Spread SetSpeeds::ratio_to_best() const {
  Spread spread = ratio_by_round(rates, best().rates);
  spread.median = rate().median / best().rate().median;
  return spread;
}

Spread SetSpeeds::ratio_to_other() const {
  Spread spread = ratio_by_round(rates, against->rates);
  spread.median = rate().median / against->rate().median;
  return spread;
}

BenchResult measure(const BenchOptions& options, Progress& progress) {
  const std::vector<EntrantFile> entrants = read_entrants(options.compare);
  const MeasuredAsset asset(options.asset, options.mesh, options.configuration, progress);
  std::optional<MeasuredAsset> against;
  if (!options.against.empty())
    against.emplace(options.against, options.mesh, options.configuration, progress);
  if (options.stages && !asset.any_spherical() && !(against && against->any_spherical()))
    throw Error(Status::usage,
                "--stages: no object of these assets is spherical, and only spherical objects have stages");
  const std::atomic<bool>& cancel = interruption();
  const auto go_on = [&](double fraction, const std::string& text) {
    if (cancel) throw Error(Status::interrupted, "the benchmark was cancelled");
    progress.update(fraction, text);
  };
  BenchResult result;
  result.info = asset.info();
  result.parts = asset.parts();
  if (against) result.against = against->info();
  result.isa = asset.device().isa;
  result.objects = asset.objects().size();
  result.triangles = asset.triangles();

  std::vector<Subject> subjects(result.objects);
  for (size_t i = 0; i < subjects.size(); ++i) {
    subjects[i].fallback = options.fallback;
    subjects[i].hits = options.hits;
    subjects[i].proves = asset.proves(i);
  }
  for (uint32_t threads : options.threads) {
    std::vector<Scene> scenes = asset.each_alone(threads);
    for (size_t i = 0; i < subjects.size(); ++i) subjects[i].scenes.push_back(std::move(scenes[i]));
    if (!against) continue;
    scenes = against->each_alone(threads);
    for (size_t i = 0; i < subjects.size(); ++i) subjects[i].against.push_back(std::move(scenes[i]));
  }
  for (size_t i = 0; i < subjects.size(); ++i) {
    const bake::Prepared& prepared = asset.objects()[i];
    {
      const bake::GroundTruth truth(prepared);
      std::optional<bake::EmbreeScene> behind;
      if (options.fallback) behind.emplace(prepared.surface, bake::EmbreeBuild::standard);
      const uint64_t rays = rays_of_each(options.rays, subjects.size());
      for (bake::RaySet set : options.sets) {
        go_on(0, fmt::format("drawing {} of {}", bake::name_of(set), asset.name(i)));
        subjects[i].sets.push_back(bake::make_ray_set(truth.source(), set, rays, options.seed));
        const NifScene scene = subjects[i].scenes.front().handle;
        subjects[i].accuracies.push_back(bake::evaluate(
            subjects[i].sets.back(), behind ? proofs_first_answerer(scene, *behind) : runtime_answerer(scene),
            truth.source().embree));
        if (against)
          subjects[i].against_accuracies.push_back(
              bake::evaluate(subjects[i].sets.back(), runtime_answerer(subjects[i].against.front().handle),
                             truth.source().embree));
      }
    }
    for (size_t b = 0; b < kEmbreeBuilds.size(); ++b) {
      go_on(0, fmt::format("building Embree's {} BVH of {}", name_of(kEmbreeBuilds[b]), asset.name(i)));
      subjects[i].embree[b] = std::make_unique<bake::EmbreeScene>(prepared.surface, kEmbreeBuilds[b]);
      result.embree_bytes[b] += uint64_t(subjects[i].embree[b]->memory().bvh);
    }
  }

  std::vector<const bake::Prepared*> objects;
  std::vector<const std::vector<bake::RaysWithTruth>*> rays;
  for (size_t i = 0; i < subjects.size(); ++i) {
    objects.push_back(&asset.objects()[i]);
    rays.push_back(&subjects[i].sets);
  }
  const std::vector<JudgedEntrant> judged =
      judge_entrants(entrants, race_of_objects(std::move(objects), options.sets, rays), options.threads,
                     options.hits, [&](const std::string& text) { go_on(0, text); });
  result.notes = entrant_notes(entrants);

  result.runs = race_sets(subjects, options.sets, options.threads, options.schedule, go_on);
  add_entrants(judged, result.runs);
  if (options.stages) {
    for (SetSpeeds& speeds : result.runs.front().sets) {
      const auto index =
          std::find(options.sets.begin(), options.sets.end(), speeds.set) - options.sets.begin();
      go_on(1, fmt::format("{}, stages", bake::name_of(speeds.set)));
      add_stages(options, subjects, size_t(index), speeds);
    }
  }
  return result;
}

}  // namespace nif::tools
