#include "tools/bench/measure.hpp"

#include <fmt/format.h>
#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <chrono>
#include <ctime>
#include <deque>

#include "formats/base/quantities.hpp"
#include "formats/base/status.hpp"
#include "tools/common/interruption.hpp"
#include "tools/common/measured_asset.hpp"
#include "tools/common/progress.hpp"
#include "tools/common/runtime_handles.hpp"

namespace nif::tools {
namespace {

/// An object with its scenes and the rays that are asked of it.
struct Subject {
  std::vector<Scene> scenes;   ///< by number of threads
  std::vector<Scene> against;  ///< of the other asset, where there is one
  std::array<std::unique_ptr<bake::EmbreeScene>, kEmbreeBuilds.size()> embree;
  std::vector<bake::LabelledRays> sets;
  std::vector<bake::Accuracy> accuracies, against_accuracies;  ///< of the same sets
};

/// Times work by the clock, and adds up how much of the processor it got.
class Stopwatch {
 public:
  template <class Work>
  double time(Work&& work) {
    const auto start = std::chrono::steady_clock::now();
    const std::clock_t before = std::clock();
    work();
    processor_ += double(std::clock() - before) / CLOCKS_PER_SEC;
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    wall_ += seconds;
    return seconds;
  }
  double cores() const { return wall_ > 0 ? processor_ / wall_ : 0; }

 private:
  double wall_ = 0, processor_ = 0;
};

NifRay to_ray(const kernels::Segment& s) {
  return {{s.origin[0], s.origin[1], s.origin[2]},
          s.tmin,
          {s.direction[0], s.direction[1], s.direction[2]},
          s.tmax};
}

/// A set of rays as the runtime's public interface takes them.
class Asked {
 public:
  explicit Asked(const bake::LabelledRays& rays)
      : source_(rays), rays_(rays.segments.size()), visible_(rays.segments.size()) {}

  void lay_out() {
    std::transform(source_.segments.begin(), source_.segments.end(), rays_.begin(), to_ray);
    std::fill(visible_.begin(), visible_.end(), uint8_t{0xff});
  }

  /// One call for all rays, whatever the threads: they are the device's.
  void ask(NifScene scene) {
    NifQuery query = nifQueryRays(rays_.data(), rays_.size());
    query.visible = visible_.data();
    check(nifQuery(scene, &query));
  }

  size_t wrong() const {
    size_t wrong = 0;
    for (size_t i = 0; i < visible_.size(); ++i) wrong += visible_[i] != source_.visible[i];
    return wrong;
  }

 private:
  const bake::LabelledRays& source_;
  std::vector<NifRay> rays_;
  std::vector<uint8_t> visible_;
};

std::vector<EmbreeVariant> variants_for(bake::RaySet set) {
  std::vector<EmbreeVariant> variants;
  for (size_t build = 0; build < kEmbreeBuilds.size(); ++build) {
    for (bake::EmbreeCall call : bake::kEmbreeCalls) {
      variants.push_back({.build = build, .call = call, .coherent = false});
      // Where rays are not coherent, the hint that they are halves the speed; single rays have no use for it.
      if (set == bake::RaySet::sun && call != bake::EmbreeCall::occluded1)
        variants.push_back({.build = build, .call = call, .coherent = true});
    }
  }
  return variants;
}

std::vector<double> rates_of(uint64_t rays, const std::vector<double>& seconds) {
  std::vector<double> rates;
  for (double s : seconds) rates.push_back(double(rays) / std::max(s, 1e-9) * 1e-6);
  return rates;
}

/// A set's race: every side with every number of threads in the same rounds. Results by number of threads;
/// none where the set has no rays.
std::vector<SetSpeeds> race_set(const std::vector<Subject>& subjects, size_t index, bake::RaySet set,
                                const std::vector<uint32_t>& threads, const Schedule& schedule,
                                const std::function<void(double, const std::string&)>& progress) {
  SetSpeeds start;
  start.set = set;
  start.embree = variants_for(set);
  std::vector<Asked> asked;
  std::vector<bake::EmbreeRays> laid_out;
  for (const Subject& subject : subjects) {
    start.accuracy += subject.accuracies[index];
    asked.emplace_back(subject.sets[index]);
    laid_out.emplace_back(subject.sets[index].segments.size());
    if (subject.against.empty()) continue;
    if (!start.against) start.against.emplace();
    start.against->accuracy += subject.against_accuracies[index];
  }
  if (start.accuracy.rays == 0) return {};

  // All sides' rays are written anew before each pass, while no clock runs: Embree overwrites its own with
  // its answers, and so all find theirs as warm in the caches. What they then write is part of their work.
  const auto ask_all = [&](Stopwatch& stopwatch, std::vector<Scene> Subject::*scenes, size_t t,
                           const bake::Accuracy& stated) {
    for (Asked& a : asked) a.lay_out();
    const double seconds = stopwatch.time([&] {
      for (size_t i = 0; i < subjects.size(); ++i)
        if (!subjects[i].sets[index].segments.empty()) asked[i].ask((subjects[i].*scenes)[t].handle);
    });
    size_t wrong = 0;
    for (const Asked& a : asked) wrong += a.wrong();
    if (wrong != stated.leak + stated.spurious)
      throw Error(Status::internal, "the timed answers differ from those whose error was measured");
    return seconds;
  };
  const auto ask_embree = [&](Stopwatch& stopwatch, tbb::task_arena& arena, EmbreeVariant& variant) {
    for (size_t i = 0; i < subjects.size(); ++i)
      laid_out[i].lay_out(subjects[i].sets[index].segments, variant.call);
    const double seconds = stopwatch.time([&] {
      arena.execute([&] {
        for (size_t i = 0; i < subjects.size(); ++i)
          laid_out[i].ask(*subjects[i].embree[variant.build], variant.coherent);
      });
    });
    variant.wrong = 0;
    for (size_t i = 0; i < subjects.size(); ++i)
      variant.wrong += laid_out[i].wrong(subjects[i].sets[index].visible);
    return seconds;
  };

  std::vector<SetSpeeds> results(threads.size(), start);
  std::vector<Stopwatch> stopwatches(threads.size());
  std::deque<tbb::task_arena> arenas;
  std::vector<Contender> contenders;
  const size_t groups = kEmbreeBuilds.size() + 2, assets = start.against ? 2 : 1;
  for (size_t t = 0; t < threads.size(); ++t) {
    const std::string with = count_of(threads[t], "thread") + ": ";
    const size_t first = t * groups;
    tbb::task_arena& arena = arenas.emplace_back(static_cast<int>(threads[t]));
    Stopwatch& stopwatch = stopwatches[t];
    contenders.push_back({with + "nif", first + kEmbreeBuilds.size(),
                          [&, t] { return ask_all(stopwatch, &Subject::scenes, t, start.accuracy); }});
    if (start.against)
      contenders.push_back({with + "the other asset", first + kEmbreeBuilds.size() + 1, [&, t] {
                              return ask_all(stopwatch, &Subject::against, t, start.against->accuracy);
                            }});
    for (EmbreeVariant& variant : results[t].embree)
      contenders.push_back({with + "Embree " + name_of(variant), first + variant.build,
                            [&] { return ask_embree(stopwatch, arena, variant); }});
  }
  const std::vector<Timing> timings = race(contenders, schedule, progress);

  const uint64_t rays = start.accuracy.rays;
  auto timing = timings.begin();
  for (size_t t = 0; t < threads.size(); ++t) {
    SetSpeeds& result = results[t];
    result.cores = stopwatches[t].cores();
    result.rates = rates_of(rays, timing[0].rounds);
    if (result.against) result.against->rates = rates_of(rays, timing[1].rounds);
    timing += assets;
    for (EmbreeVariant& variant : result.embree) {
      const std::vector<double> heats = rates_of(rays, timing->heats);
      variant.rates = rates_of(rays, timing->rounds);
      variant.fastest_heat = *std::max_element(heats.begin(), heats.end());
      ++timing;
    }
    std::stable_sort(result.embree.begin(), result.embree.end(),
                     [](const EmbreeVariant& a, const EmbreeVariant& b) {
                       if (a.rates.empty() || b.rates.empty()) return a.rates.size() > b.rates.size();
                       return a.rate().median > b.rate().median;
                     });
  }
  return results;
}

void add_stages(const BenchOptions& options, const std::vector<Subject>& subjects, size_t index,
                SetSpeeds& speeds) {
  std::vector<const bake::LabelledRays*> rays;
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
  }
  return "";
}

std::string name_of(const EmbreeVariant& variant) {
  return fmt::format("{} {}{}", name_of(kEmbreeBuilds[variant.build]), bake::name_of(variant.call),
                     variant.coherent ? " coherent" : "");
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
  const MeasuredAsset asset(options.asset, options.mesh, "isa=" + options.isa, progress);
  std::optional<MeasuredAsset> against;
  if (!options.against.empty())
    against.emplace(options.against, options.mesh, "isa=" + options.isa, progress);
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
      const uint64_t rays = std::max<uint64_t>(1, options.rays / subjects.size());
      for (bake::RaySet set : options.sets) {
        go_on(0, fmt::format("drawing {} of {}", bake::name_of(set), asset.name(i)));
        subjects[i].sets.push_back(bake::make_ray_set(truth.source(), set, rays, options.seed));
        subjects[i].accuracies.push_back(bake::evaluate(subjects[i].sets.back(),
                                                        runtime_answerer(subjects[i].scenes.front().handle),
                                                        truth.source().oracle));
        if (against)
          subjects[i].against_accuracies.push_back(
              bake::evaluate(subjects[i].sets.back(), runtime_answerer(subjects[i].against.front().handle),
                             truth.source().oracle));
      }
    }
    for (size_t b = 0; b < kEmbreeBuilds.size(); ++b) {
      go_on(0, fmt::format("building Embree's {} BVH of {}", name_of(kEmbreeBuilds[b]), asset.name(i)));
      subjects[i].embree[b] = std::make_unique<bake::EmbreeScene>(
          prepared.surface.positions, prepared.surface.triangles, kEmbreeBuilds[b]);
      result.embree_bytes[b] += uint64_t(subjects[i].embree[b]->memory().bvh);
    }
  }

  const uint32_t most = *std::max_element(options.threads.begin(), options.threads.end());
  const tbb::global_control enough(tbb::global_control::max_allowed_parallelism,
                                   std::max<size_t>(most, tbb::global_control::active_value(
                                                              tbb::global_control::max_allowed_parallelism)));
  for (uint32_t threads : options.threads) result.runs.push_back({threads, {}});
  for (size_t s = 0; s < options.sets.size(); ++s) {
    std::vector<SetSpeeds> speeds =
        race_set(subjects, s, options.sets[s], options.threads, options.schedule,
                 [&](double fraction, const std::string& contender) {
                   go_on((double(s) + fraction) / double(options.sets.size()),
                         fmt::format("{}, {}", bake::name_of(options.sets[s]), contender));
                 });
    if (options.stages && !speeds.empty()) {
      go_on(double(s) / double(options.sets.size()),
            fmt::format("{}, stages", bake::name_of(options.sets[s])));
      add_stages(options, subjects, s, speeds.front());
    }
    for (size_t t = 0; t < speeds.size(); ++t) result.runs[t].sets.push_back(std::move(speeds[t]));
  }
  return result;
}

}  // namespace nif::tools
