// Turns the asset and every way to call Embree into contenders, which bench_rounds.hpp times. Rays are laid
// out anew before each pass, off the clock, and the asset's timed answers must have the stated error.
#include "tools/bench/race.hpp"

#include <fmt/format.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <deque>

#include "formats/base/quantities.hpp"
#include "formats/base/status.hpp"
#include "tools/common/proofs_first.hpp"

namespace nif::tools {
namespace {

NifRay to_ray(const kernels::Segment& s) {
  return {{s.origin[0], s.origin[1], s.origin[2]},
          s.tmin,
          {s.direction[0], s.direction[1], s.direction[2]},
          s.tmax};
}

/// A set of rays as the runtime's public interface takes them.
class Asked {
 public:
  Asked(const bake::RaysWithTruth& rays, bool first_hits)
      : source_(rays), first_hits_(first_hits), rays_(rays.segments.size()), answers_(rays.segments.size()) {
    if (!first_hits) return;
    t_.resize(rays_.size());
    normal_.resize(rays_.size());
    triangle_.resize(rays_.size());
  }

  void lay_out() {
    std::transform(source_.segments.begin(), source_.segments.end(), rays_.begin(), to_ray);
    std::fill(answers_.begin(), answers_.end(), uint8_t{0xff});
    std::fill(t_.begin(), t_.end(), 0.f);
    std::fill(normal_.begin(), normal_.end(), std::array<float, 3>{});
    std::fill(triangle_.begin(), triangle_.end(), 0u);
  }

  /// One call for all rays. The device's thread pool splits it.
  void ask(NifScene scene) {
    const NifRays rays = nifMakeRays(rays_.data(), rays_.size());
    if (!first_hits_) {
      const NifAnswers answers = visible_answers();
      return check(nifQuery(scene, &rays, &answers));
    }
    NifHits hits{};
    hits.struct_size = sizeof(hits);
    hits.hit = answers_.data();
    hits.t = t_.data();
    hits.normal = normal_.front().data();
    hits.triangle = triangle_.data();
    check(nifIntersect(scene, &rays, &hits));
  }
  /// Proofs first, then Embree for open rays.
  void ask(NifScene scene, const bake::EmbreeScene& embree, bake::EmbreeCall call) {
    proofs_first_.ask(scene, nifMakeRays(rays_.data(), rays_.size()), visible_answers(), source_.segments,
                      embree, call);
  }

  /// For first hits: the number of rays with a wrong hit or miss.
  size_t wrong() const {
    size_t wrong = 0;
    for (size_t i = 0; i < answers_.size(); ++i)
      wrong += answers_[i] != (first_hits_ ? !source_.visible[i] : source_.visible[i]);
    return wrong;
  }

 private:
  NifAnswers visible_answers() {
    auto answers = nifkit::sized<NifAnswers>();
    answers.visible = answers_.data();
    return answers;
  }

  const bake::RaysWithTruth& source_;
  bool first_hits_;
  std::vector<NifRay> rays_;
  std::vector<uint8_t> answers_;  ///< NifAnswers::visible, or NifHits::hit
  std::vector<float> t_;
  std::vector<std::array<float, 3>> normal_;
  std::vector<uint32_t> triangle_;
  ProofsFirst proofs_first_;
};

std::vector<EmbreeVariant> variants_for(bake::RaySet set, bool instances, bool hits) {
  std::vector<EmbreeVariant> variants;
  for (size_t build = 0; build < kEmbreeBuilds.size(); ++build) {
    for (bake::EmbreeCall call : bake::kEmbreeCalls) {
      if (bake::finds_first_hits(call) != hits) continue;
      variants.push_back({.build = build, .call = call, .coherent = false});
      // For incoherent rays, the coherence hint halves the speed; calls with single rays ignore it.
      if (bake::is_coherent(set) && !bake::takes_single_rays(call) && !instances)
        variants.push_back({.build = build, .call = call, .coherent = true});
    }
  }
  return variants;
}

/// The calls that are worth a try with few rays and with many.
std::vector<Behind> all_behind() {
  std::vector<Behind> ways;
  for (size_t build = 0; build < kEmbreeBuilds.size(); ++build)
    for (const auto call :
         {bake::EmbreeCall::occluded1, bake::EmbreeCall::occluded16, bake::EmbreeCall::occluded1M})
      ways.push_back({build, call});
  return ways;
}

std::vector<double> rates_of(uint64_t rays, const std::vector<double>& seconds) {
  std::vector<double> rates;
  for (double s : seconds) rates.push_back(double(rays) / std::max(s, 1e-9) * 1e-6);
  return rates;
}

/// Results by number of threads; empty if the set has no rays.
std::vector<SetSpeeds> race_set(const std::vector<Subject>& subjects, size_t index, bake::RaySet set,
                                const std::vector<uint32_t>& threads, const Schedule& schedule,
                                const std::function<void(double, const std::string&)>& progress) {
  SetSpeeds start;
  start.set = set;
  start.embree = variants_for(set, subjects.front().instances, subjects.front().hits);
  std::vector<Asked> asked;
  std::vector<bake::EmbreeRays> laid_out;
  for (const Subject& subject : subjects) {
    start.accuracy += subject.accuracies[index];
    asked.emplace_back(subject.sets[index], subject.hits);
    laid_out.emplace_back(subject.sets[index].segments.size());
    if (subject.against.empty()) continue;
    if (!start.against) start.against.emplace();
    start.against->accuracy += subject.against_accuracies[index];
  }
  if (start.accuracy.rays == 0) return {};

  // All rays are written anew before each pass, while no clock runs: Embree overwrites its rays with its
  // answers, and this way all sides find their rays equally warm in the caches. What they then write is part
  // of their work.
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
  // Not compared with the stated error: other builds answer a few rays on edges differently.
  const auto ask_proofs_first = [&](Stopwatch& stopwatch, tbb::task_arena& arena, size_t t,
                                    const Behind& behind) {
    for (size_t i = 0; i < subjects.size(); ++i) {
      if (subjects[i].proves)
        asked[i].lay_out();
      else
        laid_out[i].lay_out(subjects[i].sets[index].segments, behind.call);
    }
    return stopwatch.time([&] {
      arena.execute([&] {
        for (size_t i = 0; i < subjects.size(); ++i) {
          const bake::EmbreeScene& embree = *subjects[i].embree[behind.build];
          if (!subjects[i].proves)
            laid_out[i].ask(embree, false);
          else if (!subjects[i].sets[index].segments.empty())
            asked[i].ask(subjects[i].scenes[t].handle, embree, behind.call);
        }
      });
    });
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
  const std::vector<Behind> behind = subjects.front().fallback ? all_behind() : std::vector<Behind>();
  const size_t groups = kEmbreeBuilds.size() + 2, ways = std::max<size_t>(1, behind.size());
  for (size_t t = 0; t < threads.size(); ++t) {
    const std::string with = count_of(threads[t], "thread") + ": ";
    const size_t first = t * groups;
    tbb::task_arena& arena = arenas.emplace_back(static_cast<int>(threads[t]));
    Stopwatch& stopwatch = stopwatches[t];
    for (size_t way = 0; way < ways; ++way)
      contenders.push_back({with + "nif", first + kEmbreeBuilds.size(), [&, t, way] {
                              return !behind.empty()
                                         ? ask_proofs_first(stopwatch, arena, t, behind[way])
                                         : ask_all(stopwatch, &Subject::scenes, t, start.accuracy);
                            }});
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
    for (size_t way = 0; way < ways; ++way, ++timing) {
      const std::vector<double> rates = rates_of(rays, timing->rounds);
      if (rates.empty() ||
          (!result.rates.empty() && spread_of(rates).median <= spread_of(result.rates).median))
        continue;
      result.rates = rates;
      if (!behind.empty()) result.behind = behind[way];
    }
    if (result.against) result.against->rates = rates_of(rays, timing++->rounds);
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

}  // namespace

EnoughThreads::EnoughThreads(const std::vector<uint32_t>& threads)
    : control_(
          tbb::global_control::max_allowed_parallelism,
          std::max<size_t>(*std::max_element(threads.begin(), threads.end()),
                           tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism))) {
}

std::vector<ThreadRun> race_sets(const std::vector<Subject>& subjects, const std::vector<bake::RaySet>& sets,
                                 const std::vector<uint32_t>& threads, const Schedule& schedule,
                                 const std::function<void(double, const std::string&)>& progress) {
  const EnoughThreads enough(threads);
  std::vector<ThreadRun> runs;
  for (uint32_t count : threads) runs.push_back({count, {}});
  for (size_t s = 0; s < sets.size(); ++s) {
    std::vector<SetSpeeds> speeds =
        race_set(subjects, s, sets[s], threads, schedule, [&](double fraction, const std::string& contender) {
          progress((double(s) + fraction) / double(sets.size()),
                   fmt::format("{}, {}", bake::name_of(sets[s]), contender));
        });
    for (size_t t = 0; t < speeds.size(); ++t) runs[t].sets.push_back(std::move(speeds[t]));
  }
  return runs;
}

}  // namespace nif::tools
