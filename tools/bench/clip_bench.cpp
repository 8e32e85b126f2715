// Poses the asset frame by frame, and Embree's scenes of the same triangles; all answer the same rays in turn, on one
// thread.
#include "tools/bench/clip_bench.hpp"

#include <fmt/format.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>

#include "bake/ground_truth/embree_baseline.hpp"
#include "formats/base/quantities.hpp"
#include "formats/base/status.hpp"
#include "tools/common/clip_frames.hpp"
#include "tools/common/interruption.hpp"
#include "tools/common/segment_query.hpp"
#include "tools/common/stopwatch.hpp"

namespace nif::tools {
namespace {

/// Of Embree's calls the one that was fastest for a frame counts: the fastest way to ask it.
double fastest(const bake::EmbreeScene& scene, bake::EmbreeRays& rays,
               std::span<const kernels::Segment> segments, bool hits) {
  double least = std::numeric_limits<double>::infinity();
  for (const bake::EmbreeCall call : bake::kEmbreeCalls) {
    if (bake::finds_first_hits(call) != hits) continue;
    rays.lay_out(segments, call);
    least = std::min(least, seconds_of([&] { rays.ask(scene, false); }));
  }
  return least;
}

class ClipBench {
 public:
  ClipBench(const ClipBenchOptions& options, Progress& progress)
      : options_(options),
        progress_(progress),
        asset_(options.asset, options.mesh, options.configuration, progress),
        frames_(asset_, options.clip, options.frames),
        rays_a_frame_(std::max<uint64_t>(1, options.rays / options.frames)),
        embree_rays_(rays_a_frame_),
        scene_(asset_.whole()) {}

  ClipBenchResult run() {
    result_.embree = bake::embree_version();
    result_.isa = asset_.device().isa;
    result_.asset_bytes = asset_.info().resident_bytes;
    result_.frames = frames_.count();
    for (const bake::RaySet set : options_.sets) result_.sets.push_back({.set = set});
    for (const uint32_t i : asset_.prepared().instances) {
      const mesh::Mesh& mesh = asset_.scene().meshes[asset_.scene().instances[i].mesh];
      result_.triangles += mesh.triangles.size();
      if (mesh.skin) result_.bending += mesh.triangles.size();
    }
    // The first pose allocates; it is not timed.
    pose_instances(scene_.handle, 0, frames_.at(0));
    check(nifCommitScene(scene_.handle));
    tbb::task_arena(1).execute([&] {
      for (size_t f = 0; f < frames_.count(); ++f) measure_frame(f);
    });
    const auto frames = double(frames_.count());
    for (ClipBenchResult::Times* sum :
         {&result_.pose, &result_.commit, &result_.embree_refit, &result_.embree_rebuild}) {
      sum->median /= frames;
      sum->first /= frames;
    }
    auto info = nifkit::sized<NifSceneInfo>();
    check(nifGetSceneInfo(scene_.handle, &info));
    result_.scene_bytes = info.resident_bytes;
    const bake::EmbreeScene::Memory memory = refitted_->memory();
    result_.embree_bytes = uint64_t(memory.bvh + memory.buffers);
    return std::move(result_);
  }

 private:
  void measure_frame(size_t frame) {
    const std::atomic<bool>& cancel = interruption();
    if (cancel) throw Error(Status::interrupted, "the measurement was cancelled");
    progress_.update(double(frame) / double(frames_.count()), "measuring " + frames_.name(frame));
    const ClipFrames::Pose pose = frames_.at(frame);
    const mesh::Mesh mesh = frames_.mesh(pose);
    if (!refitted_ || mesh.positions.size() != vertices_) {
      refitted_.emplace(mesh, bake::EmbreeBuild::refitted);
      rebuilt_.emplace(mesh, bake::EmbreeBuild::standard);
      vertices_ = mesh.positions.size();
    }
    std::vector<double> pose_times, commit_times, refit_times, rebuild_times;
    // One after the other: the first round of each finds cold caches, and later ones its own data.
    for (uint32_t round = 0; round < options_.rounds; ++round) {
      pose_times.push_back(seconds_of([&] { pose_instances(scene_.handle, 0, pose); }));
      commit_times.push_back(seconds_of([&] { check(nifCommitScene(scene_.handle)); }));
    }
    for (auto [scene, times] : {std::pair{&*refitted_, &refit_times}, {&*rebuilt_, &rebuild_times}})
      for (uint32_t round = 0; round < options_.rounds; ++round)
        times->push_back(seconds_of([&] {
          scene->move_vertices(mesh.positions);
          scene->commit();
        }));
    add(pose_times, result_.pose);
    add(commit_times, result_.commit);
    add(refit_times, result_.embree_refit);
    add(rebuild_times, result_.embree_rebuild);
    const bake::Prepared prepared = bake::prepare(mesh);
    const bake::GroundTruth truth(prepared);
    for (ClipSpeeds& speeds : result_.sets) measure_set(frame, truth.source(), speeds);
  }

  static void add(std::vector<double>& times, ClipBenchResult::Times& sum) {
    sum.first += times[0];
    std::nth_element(times.begin(), times.begin() + ptrdiff_t(times.size() / 2), times.end());
    sum.median += times[times.size() / 2];
  }

  void measure_set(size_t frame, const bake::RaySource& source, ClipSpeeds& speeds) {
    const bake::RaysWithTruth drawn =
        bake::make_ray_set(source, speeds.set, rays_a_frame_, options_.seed + frame);
    const std::span<const kernels::Segment> segments = drawn.segments;
    if (segments.empty()) return;
    speeds.rays += segments.size();
    const NifRays rays = rays_of(segments);
    std::vector<uint8_t> visible(segments.size());
    std::vector<float> t(segments.size());
    auto answers = nifkit::sized<NifAnswers>();
    answers.visible = visible.data();
    auto hits = nifkit::sized<NifHits>();
    hits.t = t.data();
    for (uint32_t round = 0; round < options_.rounds; ++round) {
      speeds.nif += seconds_of([&] { check(nifQuery(scene_.handle, &rays, &answers)); });
      speeds.refitted += fastest(*refitted_, embree_rays_, segments, false);
      speeds.rebuilt += fastest(*rebuilt_, embree_rays_, segments, false);
      speeds.nif_hits += seconds_of([&] { check(nifIntersect(scene_.handle, &rays, &hits)); });
      speeds.refitted_hits += fastest(*refitted_, embree_rays_, segments, true);
      speeds.rebuilt_hits += fastest(*rebuilt_, embree_rays_, segments, true);
    }
    for (size_t i = 0; i < segments.size(); ++i)
      if (visible[i] != drawn.visible[i])
        ++(source.embree.in_doubt(segments[i]) ? speeds.in_doubt : speeds.wrong);
  }

  const ClipBenchOptions& options_;
  Progress& progress_;
  const MeasuredAsset asset_;
  const ClipFrames frames_;
  const uint64_t rays_a_frame_;
  bake::EmbreeRays embree_rays_;
  const Scene scene_;
  std::optional<bake::EmbreeScene> refitted_, rebuilt_;
  size_t vertices_ = 0;
  ClipBenchResult result_;
};

double ratio(double embree, double nif) { return nif > 0 ? embree / nif : 0; }

}  // namespace

ClipBenchResult measure_clip(const ClipBenchOptions& options, Progress& progress) {
  return ClipBench(options, progress).run();
}

namespace {

nlohmann::ordered_json json_of(const ClipBenchResult::Times& times) {
  return {{"median", times.median}, {"first", times.first}};
}

}  // namespace

nlohmann::ordered_json to_json(const ClipBenchOptions& options, const ClipBenchResult& result) {
  nlohmann::ordered_json sets = nlohmann::ordered_json::object();
  for (const ClipSpeeds& own : result.sets) {
    const double rays = double(own.rays) * options.rounds;
    const auto rate = [&](double seconds) { return seconds > 0 ? rays / seconds / 1e6 : 0; };
    sets[std::string(bake::name_of(own.set))] = {{"rays", own.rays},
                                                 {"wrong", own.wrong},
                                                 {"in_doubt", own.in_doubt},
                                                 {"visibility",
                                                  {{"nif", rate(own.nif)},
                                                   {"embree_refitted", rate(own.refitted)},
                                                   {"embree_rebuilt", rate(own.rebuilt)}}},
                                                 {"first_hits",
                                                  {{"nif", rate(own.nif_hits)},
                                                   {"embree_refitted", rate(own.refitted_hits)},
                                                   {"embree_rebuilt", rate(own.rebuilt_hits)}}}};
  }
  return {{"schema", kClipBenchSchema},
          {"file", options.asset},
          {"clip", options.clip},
          {"frames", result.frames},
          {"triangles", result.triangles},
          {"bending", result.bending},
          {"isa", result.isa},
          {"embree", result.embree},
          {"bytes",
           {{"asset", result.asset_bytes},
            {"scene", result.scene_bytes},
            {"embree_refitted", result.embree_bytes}}},
          {"seconds",
           {{"pose", json_of(result.pose)},
            {"commit", json_of(result.commit)},
            {"embree_refit", json_of(result.embree_refit)},
            {"embree_rebuild", json_of(result.embree_rebuild)}}},
          {"sets", std::move(sets)}};
}

std::string clip_bench_tables(const ClipBenchOptions& options, const ClipBenchResult& result) {
  std::string text = fmt::format(
      "{}: {} placed, of which {} bend; {} of {}; one thread, {}; Embree {}\n\n", options.asset,
      count_of(result.triangles, "triangle"), result.bending, count_of(result.frames, "frame"),
      options.clip == kAllClips ? "all clips" : "'" + options.clip + "'", result.isa, result.embree);
  const double all = double(std::max<uint64_t>(result.triangles, 1));
  const auto us = [](const ClipBenchResult::Times& times) {
    return fmt::format("{:.1f} (first {:.1f})", 1e6 * times.median, 1e6 * times.first);
  };
  text += fmt::format("a frame, microseconds   pose {}, commit {}: {:.1f} ns a triangle\n", us(result.pose),
                      us(result.commit), 1e9 * (result.pose.median + result.commit.median) / all);
  text += fmt::format("                        Embree: refit {}, rebuild {}\n", us(result.embree_refit),
                      us(result.embree_rebuild));
  text += fmt::format("memory                  {} posed, and {} of the asset; Embree {}\n\n",
                      format_bytes(double(result.scene_bytes)), format_bytes(double(result.asset_bytes)),
                      format_bytes(double(result.embree_bytes)));
  text += fmt::format("{:<15}{:>10}{:>8}{:>10}{:>12}{:>12}{:>12}{:>12}\n", "speed against", "rays", "wrong",
                      "in doubt", "refitted", "rebuilt", "hits, refit", "rebuilt");
  for (const ClipSpeeds& own : result.sets)
    text += fmt::format("{:<15}{:>10}{:>8}{:>10}{:>10.2f} x{:>10.2f} x{:>10.2f} x{:>10.2f} x\n",
                        bake::name_of(own.set), own.rays, own.wrong, own.in_doubt,
                        ratio(own.refitted, own.nif), ratio(own.rebuilt, own.nif),
                        ratio(own.refitted_hits, own.nif_hits), ratio(own.rebuilt_hits, own.nif_hits));
  return text;
}

}  // namespace nif::tools
