#include "tools/bench_gpu.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "bake/bake.hpp"
#include "formats/mesh/read.hpp"
#include "formats/nif/file_memory.hpp"
#include "formats/nif/writer.hpp"
#include "tools/bench_report.hpp"
#include "tools/command.hpp"
#include "tools/measuring.hpp"

namespace nif::tools {
namespace {

constexpr const char* kConfiguration = "backend=hip";

/// What the asset is raced against, on a device of its own, each object alone.
class Other {
 public:
  Other(const GpuBenchOptions& options, size_t objects) {
    check(nifNewDevice(kConfiguration, nullptr, &device_.handle));
    if (options.against.empty()) {
      bake::BakeOptions exact;
      exact.encoding = bake::EncodingOption::bvh;
      exact.evaluation_rays = 0;
      const std::vector<std::byte> file =
          format::encode(bake::bake(mesh::read(options.mesh), exact, {}, interruption()).asset);
      check(nifLoadAssetMemory(device_.handle, file.data(), file.size(), NIF_MEMORY_COPY, &asset_.handle));
    } else {
      check(nifLoadAssetFile(device_.handle, options.against.c_str(), NIF_LOAD_READ, &asset_.handle));
    }
    for (uint32_t i = 0; i < objects; ++i) {
      Scene scene;
      check(nifNewScene(device_.handle, &scene.handle));
      check(nifAddInstance(scene.handle, asset_.handle, i, nullptr, nullptr));
      check(nifCommitScene(scene.handle));
      scenes.push_back(std::move(scene));
    }
  }
  uint64_t card_bytes() const {
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

/// Seconds that the card takes for each round of a set: the objects' own, added up.
void add_times(NifScene scene, const bake::LabelledRays& rays, std::vector<double>& seconds) {
  if (rays.segments.empty()) return;
  std::vector<NifRay> asked;
  for (const kernels::Segment& s : rays.segments)
    asked.push_back({{s.origin[0], s.origin[1], s.origin[2]},
                     s.tmin,
                     {s.direction[0], s.direction[1], s.direction[2]},
                     s.tmax});
  std::vector<uint8_t> visible(asked.size());
  NifQuery query = nifQueryRays(asked.data(), asked.size());
  query.visible = visible.data();
  std::vector<double> times(seconds.size());
  check(nifMeasureQuery(scene, &query, uint32_t(times.size()), times.data()));
  for (size_t round = 0; round < times.size(); ++round) seconds[round] += times[round];
}

nlohmann::ordered_json side_json(const GpuSpeed& side, uint64_t bytes) {
  const Spread rate = side.rate();
  return {{"mrays_per_s", rate.median},
          {"lowest", rate.lowest},
          {"highest", rate.highest},
          {"error", side.accuracy.error()},
          {"bytes", bytes}};
}

std::string with_spread(const Spread& spread) {
  return fmt::format("{} ({}-{})", format_rate(spread.median), format_rate(spread.lowest),
                     format_rate(spread.highest));
}

}  // namespace

Spread GpuSetSpeeds::ratio() const {
  Spread spread = ratio_by_round(nif.rates, other.rates);
  spread.median = nif.rate().median / other.rate().median;
  return spread;
}

GpuBenchResult measure_gpu(const GpuBenchOptions& options, Progress& progress) {
  const MeasuredAsset asset(options.asset, options.mesh, kConfiguration, progress);
  const size_t objects = asset.objects().size();
  progress.update(0, options.against.empty() ? "making the BVH" : "reading " + options.against);
  if (!options.against.empty()) MeasuredAsset(options.against, options.mesh, kConfiguration, progress);
  const Other other(options, objects);
  std::vector<Scene> scenes;
  for (size_t i = 0; i < objects; ++i) scenes.push_back(asset.alone(i));

  GpuBenchResult result;
  result.card = asset.device().card;
  result.triangles = asset.triangles();
  result.objects = objects;
  result.file_bytes = asset.info().file_bytes;
  result.card_bytes = asset.gpu_bytes();
  result.other_card_bytes = other.card_bytes();
  for (size_t s = 0; s < options.sets.size(); ++s) {
    GpuSetSpeeds speeds{options.sets[s], {}, {}};
    std::vector<double> seconds(options.rounds), other_seconds(options.rounds);
    for (size_t i = 0; i < objects; ++i) {
      if (interruption()) throw Error(Status::interrupted, "the benchmark was cancelled");
      progress.update((double(s) + double(i) / double(objects)) / double(options.sets.size()),
                      fmt::format("{}, {}", bake::name_of(options.sets[s]), asset.name(i)));
      const bake::GroundTruth truth(asset.objects()[i]);
      const bake::LabelledRays rays = bake::make_ray_set(
          truth.source(), options.sets[s], std::max<uint64_t>(1, options.rays / objects), options.seed);
      const auto& oracle = truth.source().oracle;
      speeds.nif.accuracy += bake::evaluate(rays, runtime_answerer(scenes[i].handle), oracle);
      speeds.other.accuracy += bake::evaluate(rays, runtime_answerer(other.scenes[i].handle), oracle);
      add_times(scenes[i].handle, rays, seconds);
      add_times(other.scenes[i].handle, rays, other_seconds);
    }
    if (speeds.nif.accuracy.rays == 0) continue;
    const auto rate = [&](double time) {
      return double(speeds.nif.accuracy.rays) * 1e-6 / std::max(time, 1e-9);
    };
    for (size_t round = 0; round < options.rounds; ++round) {
      speeds.nif.rates.push_back(rate(seconds[round]));
      speeds.other.rates.push_back(rate(other_seconds[round]));
    }
    result.sets.push_back(std::move(speeds));
  }
  return result;
}

nlohmann::ordered_json to_json(const GpuBenchOptions& options, const GpuBenchResult& result) {
  using Json = nlohmann::ordered_json;
  Json sets = Json::object();
  for (const GpuSetSpeeds& speeds : result.sets) {
    const bake::Accuracy& accuracy = speeds.nif.accuracy;
    const Spread ratio = speeds.ratio();
    sets[std::string(bake::name_of(speeds.set))] = {
        {"rays", accuracy.rays},
        {"error", accuracy.error()},
        {"leak", accuracy.rate(accuracy.leak)},
        {"spurious", accuracy.rate(accuracy.spurious)},
        {"certain", accuracy.rate(accuracy.certain)},
        {"certain_wrong", accuracy.certain_wrong},
        {"nif", side_json(speeds.nif, result.card_bytes)},
        {"other", side_json(speeds.other, result.other_card_bytes)},
        {"ratio", ratio.median},
        {"ratio_lowest", ratio.lowest},
        {"ratio_highest", ratio.highest}};
  }
  return {{"schema", "nifkit.bench-gpu/1"},
          {"file", options.asset},
          {"against", options.against.empty() ? "bvh" : options.against},
          {"card", result.card},
          {"sets", std::move(sets)},
          {"triangles", result.triangles},
          {"objects", result.objects},
          {"seed", options.seed},
          {"rounds", options.rounds},
          {"bytes",
           {{"file", result.file_bytes}, {"card", result.card_bytes}, {"other", result.other_card_bytes}}}};
}

std::string gpu_bench_table(const GpuBenchOptions& options, const GpuBenchResult& result) {
  const std::string other = options.against.empty() ? "BVH" : "other";
  std::string text = fmt::format(
      "{}: {}, on {}, against {}\n"
      "Millions of rays a second: the median of {} (lowest-highest), by the card's clock, without copies.\n"
      "Memory of the card: {}, {} for the {}.\n\n{:<14}{:>8}{:>22}{:>8}{:>22}{:>20}\n",
      options.asset, count_of(result.triangles, "triangle"), result.card,
      options.against.empty() ? "an exact BVH of the mesh" : options.against,
      count_of(options.rounds, "round"), format_bytes(double(result.card_bytes)),
      format_bytes(double(result.other_card_bytes)), other, "ray set", "error", "nif", "error", other,
      "nif / " + other);
  for (const GpuSetSpeeds& speeds : result.sets)
    text += fmt::format("{:<14}{:>7.3f}%{:>22}{:>7.3f}%{:>22}{:>20}\n", bake::name_of(speeds.set),
                        100 * speeds.nif.accuracy.error(), with_spread(speeds.nif.rate()),
                        100 * speeds.other.accuracy.error(), with_spread(speeds.other.rate()),
                        with_spread(speeds.ratio()));
  return text;
}

}  // namespace nif::tools
