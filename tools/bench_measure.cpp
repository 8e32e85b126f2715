#include "tools/bench_measure.hpp"

#include <fmt/format.h>
#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <chrono>
#include <ctime>

#include "tools/command.hpp"

namespace nif::tools {
namespace {

/// An object with its scenes and the rays that are asked of it.
struct Subject {
  Scene scene;
  std::array<std::unique_ptr<bake::EmbreeScene>, kEmbreeBuilds.size()> embree;
  std::vector<bake::LabelledRays> sets;
  std::vector<bake::Accuracy> accuracies;  ///< of the same sets
  Scene against;                           ///< of the other asset, where there is one
  std::vector<bake::Accuracy> against_accuracies;
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

/// The asset, asked through the runtime's public interface.
class Asked {
 public:
  Asked(NifScene scene, const bake::LabelledRays& rays)
      : scene_(scene), source_(rays), rays_(rays.segments.size()), visible_(rays.segments.size()) {}

  void lay_out() {
    std::transform(source_.segments.begin(), source_.segments.end(), rays_.begin(), to_ray);
    std::fill(visible_.begin(), visible_.end(), uint8_t{0xff});
  }

  /// One call for all rays, whatever the threads: they are the device's.
  void ask() {
    NifQuery query = nifQueryRays(rays_.data(), rays_.size());
    query.visible = visible_.data();
    check(nifQuery(scene_, &query));
  }

  size_t wrong() const {
    size_t wrong = 0;
    for (size_t i = 0; i < visible_.size(); ++i) wrong += visible_[i] != source_.visible[i];
    return wrong;
  }

 private:
  NifScene scene_;
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

SetSpeeds race_set(const std::vector<Subject>& subjects, size_t index, bake::RaySet set, uint32_t threads,
                   const Schedule& schedule,
                   const std::function<void(double, const std::string&)>& progress) {
  SetSpeeds result;
  result.set = set;
  result.embree = variants_for(set);
  std::vector<Asked> asked, others;
  std::vector<bake::EmbreeRays> laid_out;
  for (const Subject& subject : subjects) {
    const bake::LabelledRays& rays = subject.sets[index];
    if (rays.segments.empty()) continue;
    result.accuracy += subject.accuracies[index];
    asked.emplace_back(subject.scene.handle, rays);
    if (subject.against.handle == nullptr) continue;
    if (!result.against) result.against.emplace();
    result.against->accuracy += subject.against_accuracies[index];
    others.emplace_back(subject.against.handle, rays);
  }
  for (const Subject& subject : subjects) laid_out.emplace_back(subject.sets[index].segments.size());
  if (asked.empty()) return result;

  // All sides' rays are written anew before each pass, while no clock runs: Embree overwrites its own with
  // its answers, and so all find theirs as warm in the caches. What they then write is part of their work.
  Stopwatch stopwatch;
  tbb::task_arena arena(static_cast<int>(threads));
  std::vector<Contender> contenders;
  const auto ask_all = [&](std::vector<Asked>& all, const bake::Accuracy& stated) {
    for (Asked& a : all) a.lay_out();
    const double seconds = stopwatch.time([&] {
      for (Asked& a : all) a.ask();
    });
    size_t wrong = 0;
    for (const Asked& a : all) wrong += a.wrong();
    if (wrong != stated.leak + stated.spurious)
      throw Error(Status::internal, "the answers timed are not those whose error is stated");
    return seconds;
  };
  contenders.push_back({"nif", kEmbreeBuilds.size(), [&] { return ask_all(asked, result.accuracy); }});
  if (result.against)
    contenders.push_back({"the other asset", kEmbreeBuilds.size() + 1,
                          [&] { return ask_all(others, result.against->accuracy); }});
  const size_t assets = contenders.size();
  for (EmbreeVariant& variant : result.embree) {
    contenders.push_back({"Embree " + name_of(variant), variant.build, [&, v = &variant] {
                            for (size_t i = 0; i < subjects.size(); ++i)
                              laid_out[i].lay_out(subjects[i].sets[index].segments, v->call);
                            const double seconds = stopwatch.time([&] {
                              arena.execute([&] {
                                for (size_t i = 0; i < subjects.size(); ++i)
                                  laid_out[i].ask(*subjects[i].embree[v->build], v->coherent);
                              });
                            });
                            v->wrong = 0;
                            for (size_t i = 0; i < subjects.size(); ++i)
                              v->wrong += laid_out[i].wrong(subjects[i].sets[index].visible);
                            return seconds;
                          }});
  }
  const std::vector<Timing> timings = race(contenders, schedule, progress);

  const uint64_t rays = result.accuracy.rays;
  result.cores = stopwatch.cores();
  result.rates = rates_of(rays, timings[0].rounds);
  if (result.against) result.against->rates = rates_of(rays, timings[1].rounds);
  for (size_t v = 0; v < result.embree.size(); ++v) {
    const std::vector<double> heats = rates_of(rays, timings[v + assets].heats);
    result.embree[v].rates = rates_of(rays, timings[v + assets].rounds);
    result.embree[v].fastest_heat = *std::max_element(heats.begin(), heats.end());
  }
  std::stable_sort(result.embree.begin(), result.embree.end(),
                   [](const EmbreeVariant& a, const EmbreeVariant& b) {
                     if (a.rates.empty() || b.rates.empty()) return a.rates.size() > b.rates.size();
                     return a.rate().median > b.rate().median;
                   });
  return result;
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

Spread SetSpeeds::ratio_by_round() const {
  std::vector<double> ratios;
  for (size_t r = 0; r < rates.size(); ++r) ratios.push_back(rates[r] / best().rates[r]);
  return spread_of(ratios);
}

Spread SetSpeeds::ratio_to_other() const {
  std::vector<double> ratios;
  for (size_t r = 0; r < rates.size(); ++r) ratios.push_back(rates[r] / against->rates[r]);
  Spread spread = spread_of(ratios);
  spread.median = rate().median / against->rate().median;
  return spread;
}

BenchResult measure(const BenchOptions& options, Progress& progress) {
  const MeasuredAsset asset(options.asset, options.mesh, options.isa.empty() ? "" : "isa=" + options.isa,
                            progress);
  std::optional<MeasuredAsset> against;
  if (!options.against.empty())
    against.emplace(options.against, options.mesh, options.isa.empty() ? "" : "isa=" + options.isa, progress);
  const std::atomic<bool>& cancel = interruption();
  const auto go_on = [&](double fraction, const std::string& text) {
    if (cancel) throw Error(Status::interrupted, "the benchmark was cancelled");
    progress.update(fraction, text);
  };
  BenchResult result;
  result.info = asset.info();
  if (against) result.against = against->info();
  result.isa = asset.device().isa;
  result.objects = asset.objects().size();
  result.triangles = asset.triangles();

  std::vector<Subject> subjects(result.objects);
  const auto set_scenes = [&](uint32_t threads) {
    std::vector<Scene> scenes = asset.each_alone(threads);
    for (size_t i = 0; i < subjects.size(); ++i) subjects[i].scene = std::move(scenes[i]);
    if (!against) return;
    scenes = against->each_alone(threads);
    for (size_t i = 0; i < subjects.size(); ++i) subjects[i].against = std::move(scenes[i]);
  };
  set_scenes(options.threads.front());
  for (size_t i = 0; i < subjects.size(); ++i) {
    const bake::Prepared& prepared = asset.objects()[i];
    {
      const bake::GroundTruth truth(prepared);
      const uint64_t rays = std::max<uint64_t>(1, options.rays / subjects.size());
      for (bake::RaySet set : options.sets) {
        go_on(0, fmt::format("drawing {} of {}", bake::name_of(set), asset.name(i)));
        subjects[i].sets.push_back(bake::make_ray_set(truth.source(), set, rays, options.seed));
        subjects[i].accuracies.push_back(bake::evaluate(
            subjects[i].sets.back(), runtime_answerer(subjects[i].scene.handle), truth.source().oracle));
        if (against)
          subjects[i].against_accuracies.push_back(bake::evaluate(
              subjects[i].sets.back(), runtime_answerer(subjects[i].against.handle), truth.source().oracle));
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
  const double races = double(options.threads.size() * options.sets.size());
  for (size_t t = 0; t < options.threads.size(); ++t) {
    ThreadRun& run = result.runs.emplace_back(ThreadRun{options.threads[t], {}});
    set_scenes(run.threads);
    for (size_t s = 0; s < options.sets.size(); ++s) {
      const std::string where =
          fmt::format("{}, {}: ", bake::name_of(options.sets[s]), count_of(run.threads, "thread"));
      const double before = double(t * options.sets.size() + s);
      SetSpeeds speeds = race_set(subjects, s, options.sets[s], run.threads, options.schedule,
                                  [&](double fraction, const std::string& contender) {
                                    go_on((before + fraction) / races, where + contender);
                                  });
      if (speeds.accuracy.rays > 0) run.sets.push_back(std::move(speeds));
    }
  }
  return result;
}

}  // namespace nif::tools
