// Times with the GPU's own clock, without copies. Without --against, the BVH is an asset that is baked here
// in memory. The faster of the asset's two ways counts: one kernel, or the pipeline.
#include "tools/bench/bench_gpu.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <span>

#include "bake/bake.hpp"
#include "formats/base/quantities.hpp"
#include "formats/base/status.hpp"
#include "formats/mesh/read.hpp"
#include "formats/nif/file_memory.hpp"
#include "formats/nif/writer.hpp"
#include "tools/bench/bench_report.hpp"
#include "tools/common/baked_scene.hpp"
#include "tools/common/interruption.hpp"
#include "tools/common/measured_asset.hpp"
#include "tools/common/runtime_handles.hpp"

namespace nif::tools {
namespace {

constexpr const char* kConfiguration = "backend=gpu";

/// What the asset is compared with, on its own device, each object alone.
class Other {
 public:
  Other(const GpuBenchOptions& options, size_t objects) {
    check(nifNewDevice(kConfiguration, nullptr, &device_.handle));
    if (options.against.empty()) {
      bake::BakeOptions exact;
      exact.encoding = "bvh";
      exact.evaluation_rays = 0;
      const std::vector<std::byte> file = format::encode(
          bake::bake(mesh::read(options.mesh, limits_of_asset(options.asset)), exact, {}, interruption())
              .asset);
      check(nifLoadAssetMemory(device_.handle, file.data(), file.size(), NIF_LOAD_COPY, &asset_.handle));
    } else {
      check(nifLoadAssetFile(device_.handle, options.against.c_str(), NIF_LOAD_COPY, &asset_.handle));
    }
    for (uint32_t i = 0; i < objects; ++i) {
      Scene scene;
      check(nifNewScene(device_.handle, &scene.handle));
      check(nifAddInstance(scene.handle, asset_.handle, i, nullptr, nullptr));
      check(nifCommitScene(scene.handle));
      scenes.push_back(std::move(scene));
    }
  }
  uint64_t gpu_bytes() const {
    NifAssetInfo info{};
    info.struct_size = sizeof(info);
    check(nifGetAssetInfo(asset_.handle, &info));
    return info.gpu_bytes;
  }

 private:
  Device device_;
  Asset asset_;

 public:
  std::vector<Scene> scenes;
};

constexpr const char* kSideNames[kGpuSides] = {"one_kernel", "pipeline", "other", "single_bvh"};

struct StageName {
  const char *key, *text;
};
/// Expands NIF_MEASURE_STAGES.
constexpr StageName kStageNames[NIF_MEASURED_STAGES] = {{"ray_cast", "ray cast"},
                                                        {"order", "order"},
                                                        {"outer_grids", "outer grids"},
                                                        {"outer_network", "outer network"},
                                                        {"inner_grids", "inner grids"},
                                                        {"inner_network", "inner network"},
                                                        {"rest", "rest"}};

std::vector<NifRay> to_rays(const bake::RaysWithTruth& drawn) {
  std::vector<NifRay> rays;
  for (const kernels::Segment& s : drawn.segments)
    rays.push_back({{s.origin[0], s.origin[1], s.origin[2]},
                    s.tmin,
                    {s.direction[0], s.direction[1], s.direction[2]},
                    s.tmax});
  return rays;
}

/// Adds the GPU seconds that nifMeasureQuery() reports for `rounds` rounds.
void add_times(NifScene scene, std::span<const NifRay> rays, NifMeasure measure, size_t rounds,
               std::span<double> seconds) {
  std::vector<uint8_t> visible(rays.size());
  const NifRays asked = nifMakeRays(rays.data(), rays.size());
  auto answers = nifkit::sized<NifAnswers>();
  answers.visible = visible.data();
  std::vector<double> times(seconds.size());
  check(nifMeasureQuery(scene, &asked, &answers, measure, uint32_t(rounds), times.data()));
  for (size_t i = 0; i < times.size(); ++i) seconds[i] += times[i];
}

/// A scene that answers one side's queries, and the way it does.
struct Side {
  NifScene scene;
  NifMeasure measure;
};

/// Times of one ray set, summed over the objects.
class SetTimes {
 public:
  SetTimes(const GpuBenchOptions& options) : options_(options) {
    for (auto& seconds : seconds_) seconds.resize(options.rounds);
    if (options.stages) stages_.resize(options.rounds * NIF_MEASURED_STAGES);
  }

  void add(const std::array<Side, kGpuSides>& sides, std::span<const NifRay> rays) {
    if (rays.empty()) return;
    for (size_t side = 0; side < kGpuSides; ++side)
      if (takes_part(side))
        add_times(sides[side].scene, rays, sides[side].measure, options_.rounds, seconds_[side]);
    if (options_.stages)
      add_times(sides[kPipeline].scene, rays, NIF_MEASURE_STAGES, options_.rounds, stages_);
    if (!options_.batches) return;
    size_t number = 0;
    for (uint64_t size = 256; size < rays.size(); size *= 4, ++number) {
      if (batches_.size() <= number) batches_.push_back({});
      Batch& batch = batches_[number];
      batch.rays += size;
      for (size_t side = 0; side < kGpuSides; ++side) {
        if (!takes_part(side)) continue;
        std::vector<double> seconds(options_.rounds);
        add_times(sides[side].scene, rays.first(size), sides[side].measure, options_.rounds, seconds);
        batch.seconds[side] += spread_of(seconds).median;
      }
    }
  }

  /// `rays` is the total number of rays.
  void finish(uint64_t rays, GpuSetSpeeds& speeds) const {
    const auto rate = [](uint64_t count, double seconds) {
      return double(count) * 1e-6 / std::max(seconds, 1e-9);
    };
    for (size_t side = 0; side < kGpuSides; ++side)
      for (const double seconds : seconds_[side])
        speeds.rates[side].push_back(takes_part(side) ? rate(rays, seconds) : 0);
    for (size_t i = 0; i < stages_.size(); i += NIF_MEASURED_STAGES) {
      auto& stages = speeds.stages.emplace_back();
      for (size_t s = 0; s < stages.size(); ++s) stages[s] = 1e9 * stages_[i + s] / double(rays);
    }
    for (const Batch& batch : batches_) {
      GpuBatch& of = speeds.batches.emplace_back(GpuBatch{batch.rays, {}});
      for (size_t side = 0; side < kGpuSides; ++side)
        of.rates[side] = takes_part(side) ? rate(batch.rays, batch.seconds[side]) : 0;
    }
  }

 private:
  struct Batch {
    uint64_t rays = 0;
    std::array<double, kGpuSides> seconds{};
  };
  bool takes_part(size_t side) const {
    return side == kOneKernel ? !options_.half : side != kSingleBvh || options_.against.empty();
  }

  const GpuBenchOptions& options_;
  std::array<std::vector<double>, kGpuSides> seconds_;
  std::vector<double> stages_;
  std::vector<Batch> batches_;
};

Spread stage_of(const GpuSetSpeeds& speeds, size_t stage) {
  std::vector<double> ns;
  for (const auto& stages : speeds.stages) ns.push_back(stages[stage]);
  return spread_of(std::move(ns));
}

nlohmann::ordered_json spread_json(const Spread& rate) {
  return {{"mrays_per_s", rate.median}, {"lowest", rate.lowest}, {"highest", rate.highest}};
}

nlohmann::ordered_json stages_json(const GpuSetSpeeds& speeds) {
  nlohmann::ordered_json json = nlohmann::ordered_json::object();
  for (size_t s = 0; s < NIF_MEASURED_STAGES; ++s) {
    const Spread ns = stage_of(speeds, s);
    json[kStageNames[s].key] = {{"ns", ns.median}, {"lowest", ns.lowest}, {"highest", ns.highest}};
  }
  return json;
}

}  // namespace

GpuSide GpuSetSpeeds::way() const {
  return rate(kOneKernel).median > rate(kPipeline).median ? kOneKernel : kPipeline;
}

GpuSide GpuSetSpeeds::bar() const {
  return rate(kSingleBvh).median > rate(kOther).median ? kSingleBvh : kOther;
}

Spread GpuSetSpeeds::ratio() const {
  Spread spread = ratio_by_round(rates[way()], rates[bar()]);
  spread.median = rate(way()).median / rate(bar()).median;
  return spread;
}

GpuBenchResult measure_gpu(const GpuBenchOptions& options, Progress& progress) {
  const std::string configuration = std::string(kConfiguration) + (options.half ? ",precision=half" : "");
  const MeasuredAsset asset(options.asset, options.mesh, configuration, progress);
  const size_t objects = asset.objects().size();
  progress.update(0, options.against.empty() ? "building the BVH" : "reading " + options.against);
  if (!options.against.empty()) MeasuredAsset(options.against, options.mesh, kConfiguration, progress);
  const Other other(options, objects);
  std::vector<Scene> scenes;
  for (size_t i = 0; i < objects; ++i) scenes.push_back(asset.alone(i));

  GpuBenchResult result;
  result.gpu = asset.device().gpu;
  result.triangles = asset.triangles();
  result.objects = objects;
  result.file_bytes = asset.info().file_bytes;
  result.gpu_bytes = asset.gpu_bytes();
  result.other_gpu_bytes = other.gpu_bytes();
  for (size_t s = 0; s < options.sets.size(); ++s) {
    GpuSetSpeeds speeds{options.sets[s], {}, {}, {}, {}, {}};
    SetTimes times(options);
    for (size_t i = 0; i < objects; ++i) {
      if (interruption()) throw Error(Status::interrupted, "the benchmark was cancelled");
      progress.update((double(s) + double(i) / double(objects)) / double(options.sets.size()),
                      fmt::format("{}, {}", bake::name_of(options.sets[s]), asset.name(i)));
      const bake::GroundTruth truth(asset.objects()[i]);
      const bake::RaysWithTruth rays = bake::make_ray_set(
          truth.source(), options.sets[s], std::max<uint64_t>(1, options.rays / objects), options.seed);
      const auto& embree = truth.source().embree;
      speeds.accuracy += bake::evaluate(rays, runtime_answerer(scenes[i].handle), embree);
      speeds.other_accuracy += bake::evaluate(rays, runtime_answerer(other.scenes[i].handle), embree);
      times.add({{{scenes[i].handle, NIF_MEASURE_ONE_KERNEL},
                  {scenes[i].handle, NIF_MEASURE_PIPELINE},
                  {other.scenes[i].handle, NIF_MEASURE_QUERY},
                  {other.scenes[i].handle, NIF_MEASURE_SINGLE_BVH}}},
                to_rays(rays));
    }
    if (speeds.accuracy.rays == 0) continue;
    times.finish(speeds.accuracy.rays, speeds);
    result.sets.push_back(std::move(speeds));
  }
  return result;
}

nlohmann::ordered_json to_json(const GpuBenchOptions& options, const GpuBenchResult& result) {
  using Json = nlohmann::ordered_json;
  Json sets = Json::object();
  for (const GpuSetSpeeds& speeds : result.sets) {
    const bake::Accuracy& accuracy = speeds.accuracy;
    const Spread ratio = speeds.ratio();
    Json set = {{"rays", accuracy.rays},
                {"error", accuracy.error()},
                {"leak", accuracy.rate(accuracy.leak)},
                {"spurious", accuracy.rate(accuracy.spurious)},
                {"certain", accuracy.rate(accuracy.certain)},
                {"certain_wrong", accuracy.certain_wrong},
                {"other_error", speeds.other_accuracy.error()},
                {"way", kSideNames[speeds.way()]},
                {"bar", kSideNames[speeds.bar()]},
                {"ratio", ratio.median},
                {"ratio_lowest", ratio.lowest},
                {"ratio_highest", ratio.highest}};
    for (size_t side = 0; side < kGpuSides; ++side)
      if (speeds.rate(GpuSide(side)).median > 0)
        set[kSideNames[side]] = spread_json(speeds.rate(GpuSide(side)));
    if (!speeds.stages.empty()) set["stages"] = stages_json(speeds);
    for (const GpuBatch& batch : speeds.batches) {
      Json json = {{"rays", batch.rays}};
      for (size_t side = 0; side < kGpuSides; ++side)
        if (batch.rates[side] > 0) json[kSideNames[side]] = batch.rates[side];
      set["batches"].push_back(std::move(json));
    }
    sets[std::string(bake::name_of(speeds.set))] = std::move(set);
  }
  return {
      {"schema", kGpuBenchSchema},
      {"file", options.asset},
      {"against", options.against.empty() ? "bvh" : options.against},
      {"gpu", result.gpu},
      {"precision", options.half ? "half" : "single"},
      {"sets", std::move(sets)},
      {"triangles", result.triangles},
      {"objects", result.objects},
      {"seed", options.seed},
      {"rounds", options.rounds},
      {"bytes", {{"file", result.file_bytes}, {"gpu", result.gpu_bytes}, {"other", result.other_gpu_bytes}}}};
}

std::string gpu_bench_table(const GpuBenchOptions& options, const GpuBenchResult& result) {
  const std::string other = options.against.empty() ? "BVH" : "other";
  std::string text = fmt::format(
      "{}: {}, on {}{}, against {}\n"
      "Millions of rays per second: the median of {} (lowest-highest), by the GPU's clock, without copies.\n"
      "Memory on the GPU: {}, and {} for the {}.\n\n{:<14}{:>8}{:>22}{:>22}{:>8}{:>22}{:>22}{:>20}\n",
      options.asset, count_of(result.triangles, "triangle"), result.gpu,
      options.half ? ", in half precision" : "",
      options.against.empty() ? "an exact BVH of the mesh" : options.against,
      count_of(options.rounds, "round"), format_bytes(double(result.gpu_bytes)),
      format_bytes(double(result.other_gpu_bytes)), other, "ray set", "error", "one kernel", "pipeline",
      "error", other, "single precision", "nif / the faster");
  const auto rate = [](const GpuSetSpeeds& speeds, GpuSide side) {
    return speeds.rate(side).median > 0 ? with_spread(speeds.rate(side)) : "-";
  };
  for (const GpuSetSpeeds& speeds : result.sets)
    text += fmt::format("{:<14}{:>7.3f}%{:>22}{:>22}{:>7.3f}%{:>22}{:>22}{:>20}\n", bake::name_of(speeds.set),
                        100 * speeds.accuracy.error(), rate(speeds, kOneKernel), rate(speeds, kPipeline),
                        100 * speeds.other_accuracy.error(), rate(speeds, kOther), rate(speeds, kSingleBvh),
                        with_spread(speeds.ratio()));
  if (options.stages) {
    text += fmt::format("\nNanoseconds per ray in each stage of the pipeline\n{:<14}", "ray set");
    for (const StageName& name : kStageNames) text += fmt::format("{:>15}", name.text);
    text += '\n';
    for (const GpuSetSpeeds& speeds : result.sets) {
      text += fmt::format("{:<14}", bake::name_of(speeds.set));
      for (size_t s = 0; s < NIF_MEASURED_STAGES; ++s)
        text += fmt::format("{:>15.4f}", stage_of(speeds, s).median);
      text += '\n';
    }
  }
  if (options.batches) {
    text += fmt::format(
        "\nMillions of rays per second, by rays per query\n{:<14}{:>12}{:>16}{:>16}{:>16}{:>18}\n", "ray set",
        "rays", "one kernel", "pipeline", other, "single precision");
    for (const GpuSetSpeeds& speeds : result.sets)
      for (const GpuBatch& batch : speeds.batches) {
        text += fmt::format("{:<14}{:>12}", bake::name_of(speeds.set), batch.rays);
        for (const double side : batch.rates)
          text += fmt::format("{:>{}}", side > 0 ? format_rate(side) : "-",
                              &side == &batch.rates.back() ? 18 : 16);
        text += '\n';
      }
  }
  return text;
}

}  // namespace nif::tools
