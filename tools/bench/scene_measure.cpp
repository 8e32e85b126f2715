// Races the scene as it is, then times moves of some instances on all sides, then races again with the
// instances where they ended. All sides make the same moves; otherwise their answers could not be compared.
#include "tools/bench/scene_measure.hpp"

#include <fmt/format.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <deque>
#include <numeric>
#include <optional>

#include "formats/base/quantities.hpp"
#include "formats/base/status.hpp"
#include "tools/bench/bench_scene.hpp"
#include "tools/bench/entrants.hpp"
#include "tools/bench/race.hpp"
#include "tools/common/interruption.hpp"

namespace nif::tools {
namespace {

constexpr uint64_t kMoveStream = 0x6d6f7665;  // "move"
/// A move takes about a millisecond, so it is repeated more often than a pass over all rays.
constexpr size_t kMovesPerRound = 5;
/// Maximum distance that an instance moves, in diagonals of the scene.
constexpr double kFarthestMove = 0.01;

using GoOn = std::function<void(double, const std::string&)>;

/// Positions of some instances, move after move. Each move starts from the original positions.
class Moves {
 public:
  Moves(const BenchScene& scene, uint32_t count, uint64_t seed)
      : scene_(scene), seed_(seed), chosen_(scene.instances().size()) {
    std::iota(chosen_.begin(), chosen_.end(), 0u);
    Random random(seed, kMoveStream, 0);
    count = std::min(count, uint32_t(chosen_.size()));
    for (uint32_t i = 0; i < count; ++i)
      std::swap(chosen_[i], chosen_[i + random.below(uint32_t(chosen_.size() - i))]);
    chosen_.resize(count);
    farthest_ = kFarthestMove * bake::bounds_of(scene.objects(), scene.instances()).diagonal();
  }

  uint32_t count() const { return uint32_t(chosen_.size()); }
  uint32_t instance(uint32_t i) const { return chosen_[i]; }

  /// Transforms of the chosen instances after a move: each goes in a random direction, by at most its own
  /// length.
  std::vector<mesh::Transform> transforms(uint64_t move) const {
    Random random(seed_, kMoveStream, 1 + move);
    std::vector<mesh::Transform> moved;
    for (const uint32_t i : chosen_) {
      const bake::Placed& placed = scene_.instances()[i];
      mesh::Transform& t = moved.emplace_back(placed.transform);
      const double size = mesh::bounds(scene_.objects()[placed.object]->box, t).longest_side();
      const Double3 way = random.direction() * (random.uniform() * std::min(size, farthest_));
      for (size_t a = 0; a < 3; ++a) t[4 * a + 3] = float(t[4 * a + 3] + way[a]);
    }
    return moved;
  }

  std::vector<bake::Placed> instances_after(uint64_t move) const {
    std::vector<bake::Placed> instances = scene_.instances();
    const std::vector<mesh::Transform> moved = transforms(move);
    for (uint32_t i = 0; i < count(); ++i) instances[chosen_[i]].transform = moved[i];
    return instances;
  }

 private:
  const BenchScene& scene_;
  uint64_t seed_;
  std::vector<uint32_t> chosen_;
  double farthest_ = 0;
};

void draw_sets(const SceneBenchOptions& options, std::span<const bake::Placed> instances,
               const BenchScene& scene, Subject& subject, const GoOn& go_on) {
  subject.sets.clear();
  subject.accuracies.clear();
  subject.against_accuracies.clear();
  go_on(0, "building the scene for the ground truth");
  const bake::SceneTruth truth(scene.objects(), instances);
  for (const bake::RaySet set : options.sets) {
    go_on(0, fmt::format("drawing {}", bake::name_of(set)));
    subject.sets.push_back(bake::make_ray_set(truth.source(), set, options.rays, options.seed));
    subject.accuracies.push_back(bake::evaluate(
        subject.sets.back(), runtime_answerer(subject.scenes.front().handle), truth.source().embree));
    if (!subject.against.empty())
      subject.against_accuracies.push_back(bake::evaluate(
          subject.sets.back(), runtime_answerer(subject.against.front().handle), truth.source().embree));
  }
}

/// One move of one side, with its parts timed separately.
template <class SetTransforms, class Commit>
double time_move(MoveTime& time, SetTransforms&& set_transforms, Commit&& commit) {
  Stopwatch stopwatch;
  const double transforms = stopwatch.time(set_transforms), committed = stopwatch.time(commit);
  time.transforms.push_back(1e3 * transforms);
  time.commit.push_back(1e3 * committed);
  return transforms + committed;
}

/// Moves instances on all sides. All end in the position of the same move, whose number is returned.
uint64_t race_moves(const SceneBenchOptions& options, const Moves& moves, Subject& subject,
                    std::vector<MovedRun>& runs, const GoOn& go_on) {
  const EnoughThreads enough(options.threads);
  Schedule schedule = options.schedule;
  schedule.rounds *= kMovesPerRound;
  schedule.finalists = SIZE_MAX;
  std::vector<Contender> contenders;
  std::deque<tbb::task_arena> arenas;
  std::deque<uint64_t> done;  // number of moves done by each contender
  for (size_t t = 0; t < options.threads.size(); ++t) {
    const std::string with = count_of(options.threads[t], "thread") + ": ";
    uint64_t& made = done.emplace_back(0);
    contenders.push_back({with + "nif", t, [&, t] {
                            const NifScene scene = subject.scenes[t].handle;
                            const std::vector<mesh::Transform> to = moves.transforms(made++);
                            return time_move(
                                runs[t].nif,
                                [&] {
                                  for (uint32_t i = 0; i < moves.count(); ++i)
                                    check(nifSetInstanceTransform(scene, moves.instance(i), to[i].data()));
                                },
                                [&] { check(nifCommitScene(scene)); });
                          }});
    tbb::task_arena& arena = arenas.emplace_back(static_cast<int>(options.threads[t]));
    for (size_t b = 0; b < kEmbreeBuilds.size(); ++b) {
      uint64_t& embree_made = done.emplace_back(0);
      contenders.push_back({fmt::format("{}Embree {}", with, name_of(kEmbreeBuilds[b])), t, [&, t, b] {
                              bake::EmbreeScene& scene = *subject.embree[b];
                              const std::vector<mesh::Transform> to = moves.transforms(embree_made++);
                              return time_move(
                                  runs[t].embree[b],
                                  [&] {
                                    for (uint32_t i = 0; i < moves.count(); ++i)
                                      scene.move(moves.instance(i), to[i]);
                                  },
                                  [&] { arena.execute([&] { scene.commit(); }); });
                            }});
    }
  }
  race(contenders, schedule, [&](double fraction, const std::string& contender) {
    go_on(fraction, fmt::format("moving {}, {}", count_of(moves.count(), "instance"), contender));
  });
  // The heats only warm up.
  for (MovedRun& run : runs) {
    const auto drop_heats = [&](MoveTime& time) {
      for (std::vector<double>* parts : {&time.transforms, &time.commit})
        parts->erase(parts->begin(), parts->begin() + ptrdiff_t(schedule.heats));
    };
    drop_heats(run.nif);
    for (MoveTime& time : run.embree) drop_heats(time);
  }
  return done.front() - 1;
}

/// Returns the share of the scene itself.
uint64_t add_bytes(const BenchScene& scene, const Scene& in_runtime, NifAssetInfo& sum) {
  for (const std::unique_ptr<MeasuredAsset>& asset : scene.assets()) {
    sum.file_bytes += asset->info().file_bytes;
    sum.resident_bytes += asset->info().resident_bytes;
  }
  NifSceneInfo info{};
  info.struct_size = sizeof(info);
  check(nifGetSceneInfo(in_runtime.handle, &info));
  sum.resident_bytes += info.resident_bytes;
  return info.resident_bytes;
}

}  // namespace

Spread MoveTime::whole() const {
  std::vector<double> sums;
  for (size_t r = 0; r < commit.size(); ++r) sums.push_back(transforms[r] + commit[r]);
  return spread_of(sums);
}

size_t MovedRun::best() const {
  const auto faster = [](const MoveTime& a, const MoveTime& b) {
    return a.whole().median < b.whole().median;
  };
  return size_t(std::min_element(embree.begin(), embree.end(), faster) - embree.begin());
}

SceneBenchResult measure_scene(const SceneBenchOptions& options, Progress& progress) {
  const std::vector<EntrantFile> entrants = read_entrants(options.compare);
  const BenchScene scene(options.scene, options.asset, options.configuration, progress);
  std::optional<BenchScene> against;
  if (!options.against.empty())
    against.emplace(options.scene, options.against, options.configuration, progress);
  const std::atomic<bool>& cancel = interruption();
  const GoOn go_on = [&](double fraction, const std::string& text) {
    if (cancel) throw Error(Status::interrupted, "the benchmark was cancelled");
    progress.update(fraction, text);
  };
  SceneBenchResult result;
  result.still.isa = scene.assets().front()->device().isa;
  result.still.objects = scene.objects().size();
  result.still.triangles = scene.triangles();
  result.placed_triangles = scene.placed_triangles();
  result.instances = scene.instances().size();

  std::vector<Subject> subjects(1);
  Subject& subject = subjects.front();
  subject.instances = true;
  subject.hits = options.hits;
  go_on(0, "building the runtime's scene");
  for (const uint32_t threads : options.threads) {
    subject.scenes.push_back(scene.scene(threads));
    if (against) subject.against.push_back(against->scene(threads));
  }
  draw_sets(options, scene.instances(), scene, subject, go_on);
  const std::vector<JudgedEntrant> judged =
      judge_entrants(entrants, race_of_scene(scene.objects(), scene.instances(), options.sets, subject.sets),
                     options.threads, options.hits, [&](const std::string& text) { go_on(0, text); });
  result.still.notes = entrant_notes(entrants);
  const std::vector<bake::EmbreeObject> objects = bake::embree_objects(scene.objects());
  for (size_t b = 0; b < kEmbreeBuilds.size(); ++b) {
    go_on(0, fmt::format("building Embree's {} BVHs", name_of(kEmbreeBuilds[b])));
    subject.embree[b] = std::make_unique<bake::EmbreeScene>(objects, scene.instances(), kEmbreeBuilds[b]);
  }
  result.scene_bytes = add_bytes(scene, subject.scenes.front(), result.still.info);
  if (against) add_bytes(*against, subject.against.front(), result.still.against);
  for (size_t b = 0; b < kEmbreeBuilds.size(); ++b)
    result.still.embree_bytes[b] = uint64_t(subject.embree[b]->memory().bvh);
  const double still = options.moved == 0 ? 1 : 0.48;
  result.still.runs = race_sets(subjects, options.sets, options.threads, options.schedule,
                                [&](double done, const std::string& text) { go_on(still * done, text); });
  add_entrants(judged, result.still.runs);
  if (options.moved == 0) return result;
  subject.against.clear();

  const Moves moves(scene, options.moved, options.seed);
  result.moved_instances = moves.count();
  result.moved.resize(options.threads.size());
  const uint64_t last =
      race_moves(options, moves, subject, result.moved,
                 [&](double done, const std::string& text) { go_on(still + (0.52 - still) * done, text); });
  draw_sets(options, moves.instances_after(last), scene, subject,
            [&](double, const std::string& text) { go_on(0.52, text); });
  std::vector<ThreadRun> runs = race_sets(
      subjects, options.sets, options.threads, options.schedule,
      [&](double done, const std::string& text) { go_on(0.52 + 0.48 * done, "after the move: " + text); });
  for (size_t t = 0; t < runs.size(); ++t) result.moved[t].run = std::move(runs[t]);
  return result;
}

}  // namespace nif::tools
