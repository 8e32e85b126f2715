// `nif eval`: asks an asset the named ray sets through the runtime, and compares every answer with Embree's.
#include "bake/evaluate.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <memory>

#include "bake/prepare.hpp"
#include "bake/report.hpp"
#include "formats/mesh/read.hpp"
#include "nif/nif.h"
#include "tools/accuracy_table.hpp"
#include "tools/command.hpp"
#include "tools/progress.hpp"

namespace nif::tools {
namespace {

struct Arguments {
  std::string asset, mesh;
  std::vector<std::string> sets;
  uint64_t rays = 1'000'000, seed = 2;
  uint32_t threads = 0;
  bool bvh = false, json = false, quiet = false;
};

/// Turns a failed call of the runtime into an exception; its codes for files are our exit codes.
void check(NifError error) {
  if (error == NIF_OK) return;
  const bool file = error >= NIF_ERROR_FILE_NOT_FOUND && error <= NIF_ERROR_UNSUPPORTED_NIF;
  throw Error(file                               ? Status(error)
              : error == NIF_ERROR_OUT_OF_MEMORY ? Status::out_of_memory
                                                 : Status::internal,
              nifGetErrorMessage());
}

template <class Handle, void (*kRelease)(Handle)>
struct Released {
  Handle handle = nullptr;
  Released() = default;
  Released(const Released&) = delete;
  Released& operator=(const Released&) = delete;
  ~Released() { kRelease(handle); }
};
using Device = Released<NifDevice, nifReleaseDevice>;
using Asset = Released<NifAsset, nifReleaseAsset>;
using Scene = Released<NifScene, nifReleaseScene>;

bake::Answerer runtime_answerer(NifScene scene) {
  return [scene](std::span<const kernels::Segment> segments, const bake::Answers& answers) {
    const kernels::Segment& first = segments.front();
    NifQuery query{};
    query.struct_size = sizeof(query);
    query.count = segments.size();
    for (int a = 0; a < 3; ++a) {
      query.origin[a] = &first.origin[a];
      query.direction[a] = &first.direction[a];
    }
    query.tmin = &first.tmin;
    query.tmax = &first.tmax;
    query.origin_stride = query.direction_stride = query.tmin_stride = query.tmax_stride =
        sizeof(kernels::Segment);
    query.visible = answers.visible;
    query.certain = answers.certain;
    query.probability = answers.probability;
    check(nifQuery(scene, &query));
  };
}

struct EmbreeBytes {
  uint64_t standard = 0, compact = 0;
};

struct Result {
  uint64_t triangles = 0;
  NifAssetInfo info{};
  EmbreeBytes embree;
  bake::SetAccuracies sets{};
  std::vector<std::pair<std::string, bake::SetAccuracies>> objects;
};

/// The asset must have been baked from this mesh, or from one that is the same in all that we can tell.
void match(const Arguments& arguments, const NifObjectInfo& object, const bake::Prepared& prepared) {
  bool same = object.triangles == prepared.surface.triangles.size();
  for (int a = 0; a < 3; ++a) {
    same = same && object.bounds_min[a] == prepared.box.min[a] && object.bounds_max[a] == prepared.box.max[a];
  }
  if (same) return;
  throw Error(
      Status::mesh_mismatch,
      fmt::format(
          "{} was not baked from {}: object '{}' has {} triangles, the mesh '{}' {}, or their bounds differ",
          arguments.asset, arguments.mesh, object.name, object.triangles, prepared.source->name,
          prepared.surface.triangles.size()));
}

Result measure(const Arguments& arguments, const std::vector<bake::RaySet>& sets) {
  Result result;
  Device device;
  Asset asset;
  check(nifNewDevice(nullptr, nullptr, &device.handle));
  check(nifLoadAssetFile(device.handle, arguments.asset.c_str(), NIF_LOAD_READ, &asset.handle));
  result.info.struct_size = sizeof(NifAssetInfo);
  check(nifGetAssetInfo(asset.handle, &result.info));

  Progress progress(arguments.quiet);
  progress.update(0, "reading " + arguments.mesh);
  const mesh::Scene scene = mesh::read(arguments.mesh);
  const bake::PreparedScene objects = naming(arguments.mesh, [&] { return bake::prepare(scene); });
  const size_t count = objects.objects.size();
  if (result.info.object_count != count) {
    throw Error(Status::mesh_mismatch,
                fmt::format("{} was not baked from {}: it holds {} objects, the mesh file {}",
                            arguments.asset, arguments.mesh, result.info.object_count, count));
  }
  const std::atomic<bool>& cancel = interruption();
  for (uint32_t i = 0; i < count; ++i) {
    NifObjectInfo object{};
    object.struct_size = sizeof(object);
    check(nifGetObjectInfo(asset.handle, i, &object));
    const bake::Prepared& prepared = objects.objects[i];
    match(arguments, object, prepared);
    result.triangles += prepared.surface.triangles.size();

    Scene alone;
    check(nifNewScene(device.handle, &alone.handle));
    check(nifAddInstance(alone.handle, asset.handle, i, nullptr, nullptr));
    check(nifCommitScene(alone.handle));
    const bake::GroundTruth truth(prepared);
    auto& [name, accuracies] = result.objects.emplace_back(object.name, bake::SetAccuracies{});
    const uint64_t rays = std::max<uint64_t>(1, arguments.rays / count);
    for (size_t s = 0; s < sets.size(); ++s) {
      if (cancel) throw Error(Status::interrupted, "the evaluation was cancelled");
      progress.update((double(i) + double(s) / double(sets.size())) / double(count),
                      fmt::format("measuring {} on {}", object.name, bake::name_of(sets[s])));
      const bake::LabelledRays labelled = bake::make_ray_set(truth.source(), sets[s], rays, arguments.seed);
      accuracies[size_t(sets[s])] = bake::evaluate(labelled, runtime_answerer(alone.handle));
      result.sets[size_t(sets[s])] += accuracies[size_t(sets[s])];
    }
    if (arguments.bvh) {
      progress.update(double(i + 1) / double(count), "building Embree's BVHs");
      const auto& [positions, triangles, slivers, cleaned] = prepared.surface;
      result.embree.standard +=
          uint64_t(bake::Oracle(positions, triangles, bake::EmbreeBuild::standard).memory().bvh);
      result.embree.compact +=
          uint64_t(bake::Oracle(positions, triangles, bake::EmbreeBuild::compact).memory().bvh);
    }
  }
  return result;
}

void print_json(const Arguments& arguments, const Result& result) {
  nlohmann::ordered_json objects = nlohmann::ordered_json::array();
  for (const auto& [name, sets] : result.objects)
    objects.push_back({{"name", name}, {"sets", bake::to_json(sets)}});
  nlohmann::ordered_json json{
      {"schema", "nifkit.eval/1"},
      {"file", arguments.asset},
      {"triangles", result.triangles},
      {"bytes", {{"file", result.info.file_bytes}, {"resident", result.info.resident_bytes}}},
      {"sets", bake::to_json(result.sets)},
      {"objects", std::move(objects)}};
  if (arguments.bvh) {
    json["bvh"] = {{"embree_default", {{"bytes", result.embree.standard}}},
                   {"embree_compact", {{"bytes", result.embree.compact}}}};
  }
  fmt::print("{}\n", json.dump(2, ' ', false, nlohmann::json::error_handler_t::replace));
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
}

void run(const Arguments& arguments) {
  std::vector<bake::RaySet> sets;
  for (const std::string& name : arguments.sets) {
    const std::optional<bake::RaySet> set = bake::ray_set_named(name);
    if (!set) {
      throw Error(
          Status::usage,
          fmt::format("--set '{}' is none of outer-lines, inner-surface, inner-volume, segments, sun", name));
    }
    sets.push_back(*set);
  }
  if (sets.empty()) sets.assign(bake::kRaySets.begin(), bake::kRaySets.end());
  limit_threads(arguments.threads);
  const Result result = measure(arguments, sets);
  if (arguments.json) {
    print_json(arguments, result);
  } else {
    print(arguments, result);
  }
}

}  // namespace

void add_eval(CLI::App& app) {
  CLI::App* command =
      app.add_subcommand("eval", "Measure an asset's answers against Embree on its source mesh");
  auto a = std::make_shared<Arguments>();
  command->add_option("ASSET", a->asset, "A .nif file")->required();
  command->add_option("--mesh", a->mesh, "The mesh that it was baked from")->required();
  command->add_option("--set", a->sets, "A ray set to measure; may be repeated. All of them by default");
  command->add_option("--rays", a->rays, "Rays of each set, shared out over the objects")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  command->add_option("--seed", a->seed, "Start of the random rays")->capture_default_str();
  command->add_option("-j,--threads", a->threads, "Threads; 0: all")->capture_default_str();
  command->add_flag("--bvh", a->bvh,
                    "Also build Embree's default and compact BVH, and say how many bytes they take");
  command->add_flag("--json", a->json, "Print the results as one JSON object (nifkit.eval/1)");
  command->add_flag("--quiet", a->quiet, "No progress");
  command->footer("Example: nif eval dragon.nif --mesh dragon.ply.gz --set outer-lines --set segments");
  command->callback([a] { run(*a); });
}

}  // namespace nif::tools
