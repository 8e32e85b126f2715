// `nif eval`: queries an asset with the named ray sets through the runtime, and compares every answer with
// Embree's; with --hits also every first hit.
#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "bake/report.hpp"
#include "formats/base/json_text.hpp"
#include "formats/base/quantities.hpp"
#include "formats/base/status.hpp"
#include "tools/common/accuracy_table.hpp"
#include "tools/common/clip_frames.hpp"
#include "tools/common/hit_finders.hpp"
#include "tools/common/hit_report.hpp"
#include "tools/common/interruption.hpp"
#include "tools/common/json_output.hpp"
#include "tools/common/measure_options.hpp"
#include "tools/common/measured_asset.hpp"
#include "tools/common/options.hpp"
#include "tools/common/progress.hpp"
#include "tools/common/proofs_first.hpp"
#include "tools/common/ray_set_option.hpp"
#include "tools/common/shared_options.hpp"
#include "tools/common/threads.hpp"
#include "tools/common/voxel_size.hpp"
#include "tools/subcommands.hpp"

namespace nif::tools {
namespace {

constexpr const char* kSchema = "nifkit.eval/2";

struct Arguments : MeasureArguments, RunArguments {
  std::string asset, mesh, format, clip;
  uint32_t frames = 24;
  bool bvh = false, reference = false, hits = false, calibration = false;
};

struct EmbreeBytes {
  uint64_t standard = 0, compact = 0;
};

struct ObjectResult {
  std::string name;
  bake::SetAccuracies sets{};
  bake::SetHits hits;  ///< with --hits
};

struct Result {
  uint64_t triangles = 0;
  std::string isa;
  bool any_spherical = false;
  uint64_t compared = 0, different = 0;  ///< rays also answered by the reference
  uint64_t different_hits = 0;           ///< of the compared ones
  NifAssetInfo info{};
  EmbreeBytes embree;
  bake::SetAccuracies sets{};
  bake::SetHits hits;
  std::vector<ObjectResult> objects;
  nlohmann::ordered_json metadata;  ///< written by its baker: shown, never trusted
};

/// Frame by frame, each with rays and a ground truth of its own.
void measure_clip(const Arguments& arguments, const MeasuredAsset& asset,
                  const std::vector<bake::RaySet>& sets, Progress& progress, Result& result) {
  const ClipFrames frames(asset, arguments.clip, arguments.frames);
  const Scene scene = asset.whole(), reference = asset.whole_by_reference();
  std::atomic<uint64_t> different{0};
  const std::atomic<bool>& cancel = interruption();
  const uint64_t rays = std::max<uint64_t>(1, arguments.rays / frames.count());
  for (size_t f = 0; f < frames.count(); ++f) {
    const ClipFrames::Pose pose = frames.at(f);
    for (const Scene* posed : {&scene, &reference}) {
      if (posed == &reference && !arguments.reference) continue;
      pose_instances(posed->handle, 0, pose);
      check(nifCommitScene(posed->handle));
    }
    const bake::Answerer answer = arguments.reference
                                      ? comparing_answerer(scene.handle, reference.handle, different)
                                      : runtime_answerer(scene.handle);
    const mesh::Mesh mesh = frames.mesh(pose);
    const bake::Prepared prepared = bake::prepare(mesh);
    const bake::GroundTruth truth(prepared);
    ObjectResult& object = result.objects.emplace_back();
    object.name = frames.name(f);
    for (const bake::RaySet set : sets) {
      if (cancel) throw Error(Status::interrupted, "the evaluation was cancelled");
      progress.update(double(f) / double(frames.count()), fmt::format("measuring {}", object.name));
      const bake::RaysWithTruth drawn = bake::make_ray_set(truth.source(), set, rays, arguments.seed + f);
      object.sets[size_t(set)] = bake::evaluate(drawn, answer, truth.source().embree);
      result.sets[size_t(set)] += object.sets[size_t(set)];
      if (arguments.reference) result.compared += drawn.segments.size();
      if (!arguments.hits) continue;
      object.hits[size_t(set)] =
          bake::evaluate_hits(drawn.segments, runtime_finder(scene.handle), truth.source().embree,
                              {prepared.box.diagonal(), 0}, nullptr);
      result.hits[size_t(set)] += object.hits[size_t(set)];
      if (arguments.reference)
        result.different_hits += different_hits(drawn.segments, scene.handle, reference.handle);
    }
  }
  result.different = different;
}

Result measure(const Arguments& arguments, const std::vector<bake::RaySet>& sets) {
  Result result;
  Progress progress(arguments.quiet);
  const MeasuredAsset asset(arguments.asset, arguments.mesh, arguments.configuration(), progress,
                            arguments.format);
  const size_t count = asset.objects().size();
  const std::vector<double> voxels =
      arguments.hits ? voxels_per_unit(arguments.asset) : std::vector<double>();
  result.info = asset.info();
  result.metadata = parse_untrusted<nlohmann::ordered_json>(metadata_of(result.info));
  result.triangles = asset.triangles();
  result.isa = asset.device().isa;
  result.any_spherical = asset.any_spherical();
  if (!arguments.clip.empty()) {
    measure_clip(arguments, asset, sets, progress, result);
    return result;
  }
  std::atomic<uint64_t> different{0};
  const std::atomic<bool>& cancel = interruption();
  for (size_t i = 0; i < count; ++i) {
    const bake::Prepared& prepared = asset.objects()[i];
    const Scene alone = asset.alone(i), reference = asset.alone_by_reference(i);
    std::optional<bake::EmbreeScene> behind;
    if (!arguments.fallback.empty()) behind.emplace(prepared.surface, bake::EmbreeBuild::standard);
    const bake::Answerer answer = behind ? proofs_first_answerer(alone.handle, *behind)
                                  : arguments.reference
                                      ? comparing_answerer(alone.handle, reference.handle, different)
                                      : runtime_answerer(alone.handle);
    const bake::GroundTruth truth(prepared);
    ObjectResult& object = result.objects.emplace_back();
    object.name = asset.name(i);
    std::optional<bake::SourceMesh> source;
    if (arguments.hits && asset.has_source_triangles(i))
      source.emplace(bake::SourceMesh{*prepared.source, mesh::source_triangles(prepared.surface)});
    const uint64_t rays = std::max<uint64_t>(1, arguments.rays / count);
    for (size_t s = 0; s < sets.size(); ++s) {
      if (cancel) throw Error(Status::interrupted, "the evaluation was cancelled");
      progress.update((double(i) + double(s) / double(sets.size())) / double(count),
                      fmt::format("measuring {} on {}", object.name, bake::name_of(sets[s])));
      const bake::RaysWithTruth drawn = bake::make_ray_set(truth.source(), sets[s], rays, arguments.seed);
      const auto set = size_t(sets[s]);
      object.sets[set] = bake::evaluate(drawn, answer, truth.source().embree);
      result.sets[set] += object.sets[set];
      if (arguments.reference) result.compared += drawn.segments.size();
      if (!arguments.hits) continue;
      object.hits[set] = bake::evaluate_hits(
          drawn.segments, runtime_finder(alone.handle), truth.source().embree,
          {prepared.box.diagonal(), asset.proves(i) ? voxels[i] : 0}, source ? &*source : nullptr);
      result.hits[set] += object.hits[set];
      if (arguments.reference)
        result.different_hits += different_hits(drawn.segments, alone.handle, reference.handle);
    }
    if (arguments.bvh) {
      progress.update(double(i + 1) / double(count), "building Embree's BVHs");
      result.embree.standard +=
          uint64_t(bake::EmbreeScene(prepared.surface, bake::EmbreeBuild::standard).memory().bvh);
      result.embree.compact +=
          uint64_t(bake::EmbreeScene(prepared.surface, bake::EmbreeBuild::compact).memory().bvh);
    }
  }
  result.different = different;
  return result;
}

/// The baker's note on an object's decision threshold (--max-leak, --max-spurious), or null if there is none.
const nlohmann::ordered_json* error_limit_of(const Result& result, size_t object) {
  const nlohmann::ordered_json::json_pointer at(fmt::format("/objects/{}/error_limit", object));
  if (!result.metadata.is_object() || !result.metadata.contains(at)) return nullptr;
  const nlohmann::ordered_json& limit = result.metadata.at(at);
  return limit.is_object() ? &limit : nullptr;
}

/// Each set's accuracy, including that of probabilities and first hits.
nlohmann::ordered_json sets_json(const Arguments& arguments, const bake::SetAccuracies& sets,
                                 const bake::SetHits& hits) {
  nlohmann::ordered_json json = bake::to_json(sets);
  bake::add_calibration(sets, arguments.calibration, json);
  if (arguments.hits) bake::add_hits(bake::figures_of(hits), json);
  return json;
}

void print_json(const Arguments& arguments, const Result& result) {
  nlohmann::ordered_json objects = nlohmann::ordered_json::array();
  for (size_t i = 0; i < result.objects.size(); ++i) {
    const ObjectResult& object = result.objects[i];
    objects.push_back({{"name", object.name}, {"sets", sets_json(arguments, object.sets, object.hits)}});
    if (const nlohmann::ordered_json* limit = error_limit_of(result, i))
      objects.back()["error_limit"] = *limit;
  }
  nlohmann::ordered_json json{
      {"schema", kSchema},
      {"file", arguments.asset},
      {"triangles", result.triangles},
      {"bytes", {{"file", result.info.file_bytes}, {"resident", result.info.resident_bytes}}},
      {"sets", sets_json(arguments, result.sets, result.hits)},
      {"objects", std::move(objects)}};
  if (arguments.bvh) {
    json["bvh"] = {{"embree_default", {{"bytes", result.embree.standard}}},
                   {"embree_compact", {{"bytes", result.embree.compact}}}};
  }
  if (arguments.reference)
    json["reference"] = {{"isa", result.isa}, {"rays", result.compared}, {"different", result.different}};
  if (arguments.reference && arguments.hits) json["reference"]["different_hits"] = result.different_hits;
  write_json(json);
}

void print(const Arguments& arguments, const Result& result) {
  const auto resident = double(result.info.resident_bytes);
  fmt::print("{}: {}, {} resident\n", arguments.asset, count_of(result.triangles, "triangle"),
             format_bytes(resident));
  if (arguments.bvh) {
    fmt::print("Embree's BVH: {} ({:.0f} x), compact {} ({:.0f} x)\n",
               format_bytes(double(result.embree.standard)), double(result.embree.standard) / resident,
               format_bytes(double(result.embree.compact)), double(result.embree.compact) / resident);
  }
  fmt::print("\n{}", accuracy_table(result.sets));
  if (arguments.calibration) fmt::print("\n{}", calibration_table(result.sets));
  if (arguments.hits) fmt::print("\n{}", hit_tables(bake::figures_of(result.hits)));
  for (size_t i = 0; i < result.objects.size(); ++i) {
    const nlohmann::ordered_json* limit = error_limit_of(result, i);
    if (!limit) continue;
    const auto against = limit->find("against"), rate = limit->find("rate");
    if (against == limit->end() || !against->is_string() || rate == limit->end() || !rate->is_number())
      continue;
    fmt::print("\n'{}' was baked with --max-{} {}\n", result.objects[i].name, against->get<std::string>(),
               rate->get<double>());
  }
  if (result.any_spherical)
    fmt::print("\nSpherical objects ignore where a segment ends: they answer it as a ray.\n");
  if (arguments.reference)
    fmt::print("\n{} of {} rays answered differently by {} and the scalar reference\n", result.different,
               result.compared, result.isa);
  if (arguments.reference && arguments.hits)
    fmt::print("{} of them with a first hit that differs\n", result.different_hits);
}

void run(const Arguments& arguments) {
  std::vector<bake::RaySet> sets = parse_sets(arguments.sets);
  if (sets.empty()) sets.assign(bake::kRaySets.begin(), bake::kRaySets.end());
  if (arguments.reference && !arguments.fallback.empty())
    throw Error(Status::usage, "--reference and --fallback cannot be used together: Embree has no reference");
  if (arguments.hits && !arguments.fallback.empty())
    throw Error(
        Status::usage,
        "--hits and --fallback cannot be used together: proofs with Embree behind them find no first hits");
  if (!arguments.clip.empty() && (!arguments.fallback.empty() || arguments.bvh))
    throw Error(Status::usage,
                fmt::format("--clip and {} cannot be used together", arguments.bvh ? "--bvh" : "--fallback"));
  limit_threads(arguments.threads);
  const Result result = measure(arguments, sets);
  if (arguments.json) {
    print_json(arguments, result);
  } else {
    print(arguments, result);
  }
  if (result.different != 0 || result.different_hits != 0)
    throw Error(Status::internal,
                fmt::format("{}: {} and the scalar reference disagree", arguments.asset, result.isa));
}

}  // namespace

void add_eval(Command app) {
  const Command command =
      app.add_subcommand("eval", "Compare an asset's answers with Embree's on its source mesh");
  auto a = std::make_shared<Arguments>();
  command.add_option("ASSET", a->asset, "The .nif file to measure").required();
  command.add_option("--mesh", a->mesh, "The mesh that it was baked from").required();
  add_format_option(command, a->format);
  add_measure_options(command, *a, "all except camera");
  command.add_flag("--bvh", a->bvh, "Also build Embree's default and compact BVH, and print their size");
  command.add_flag(
      "--hits", a->hits,
      "Also compare first hits (nifIntersect): rays that hit or miss wrongly, places, normals, proven "
      "bounds, and triangles if the asset stores their numbers");
  command.add_flag(
      "--calibration", a->calibration,
      "Also list, for each tenth of the answered probabilities, their mean and the share of rays "
      "that are visible: equal if probabilities are right");
  command.add_option(
      "--clip", a->clip,
      "Measure the asset as an animation of the mesh poses it: the clip's name, its number from 0 on, or "
      "all. Needs an asset baked with --deforms");
  command.add_option("--frames", a->frames, "Frames of the clip, evenly from its first key to its last")
      .default_str("24")
      .range(1u, 100'000u);
  command.add_flag("--reference", a->reference,
                   "Also query the scalar reference, and fail if any bit of an answer differs");
  add_run_options(command, *a, kSchema);
  command.footer(
      "Examples:\n"
      "  nif eval dragon.nif --mesh dragon.ply.gz --set outer-lines --set segments\n"
      "  nif eval dragon.nif --mesh dragon.ply.gz --bvh\n"
      "  nif eval dragon.nif --mesh dragon.ply.gz --hits\n"
      "  nif eval tree.nif --mesh tree.ply --calibration\n"
      "  nif eval knight.nif --mesh knight.glb --clip Walking_A --frames 60\n"
      "  nif eval dragon_planes.nif --mesh dragon.ply.gz --fallback embree");
  command.callback([a] { run(*a); });
}

}  // namespace nif::tools
