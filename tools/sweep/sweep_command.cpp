// `nif sweep`: bakes a mesh at several sizes, and shows bytes, error, certain answers and speed of each.
#include <fmt/format.h>

#include <chrono>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>

#include "bake/report.hpp"
#include "formats/base/output_file.hpp"
#include "formats/base/quantities.hpp"
#include "formats/base/status.hpp"
#include "formats/mesh/read.hpp"
#include "formats/nif/writer.hpp"
#include "tools/common/asset_bytes.hpp"
#include "tools/common/interruption.hpp"
#include "tools/common/json_output.hpp"
#include "tools/common/naming.hpp"
#include "tools/common/runtime_handles.hpp"
#include "tools/common/shared_options.hpp"
#include "tools/common/threads.hpp"
#include "tools/subcommands.hpp"
#include "tools/sweep/sweep_plot.hpp"

namespace nif::tools {
namespace {

constexpr const char* kSchema = "nifkit.sweep/1";

struct Arguments : RunArguments {
  std::string mesh, folder, preset = "balanced";
  std::vector<double> scales;
  uint64_t seed = 1, rays = 300'000;
  bool no_speed = false;
};

SweepPoint bake_at(double scale, const Arguments& arguments, const mesh::Scene& scene, size_t number,
                   const std::function<void(const bake::BakeProgress&)>& callback) {
  bake::BakeOptions options;
  options.encoding = "segment";
  options.preset = *bake::preset_named(arguments.preset);
  options.seed = arguments.seed;
  options.evaluation_rays = arguments.rays;
  options.scale = scale;
  const auto start = std::chrono::steady_clock::now();
  const bake::BakeResult result =
      naming(arguments.mesh, [&] { return bake::bake(scene, options, callback, interruption()); });
  SweepPoint point;
  point.scale = scale;
  point.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  point.sets = result.sets;
  const std::vector<std::byte> file = format::encode(result.asset);
  point.file = (std::filesystem::path(arguments.folder) / fmt::format("size-{}.nif", number + 1)).string();
  point.file_bytes = file.size();
  point.resident_bytes = resident_bytes(file);
  write_output(point.file, file);
  return point;
}

nlohmann::ordered_json json_of_sweep(const Arguments& arguments, uint64_t triangles,
                                     const std::vector<SweepPoint>& points) {
  nlohmann::ordered_json json{{"schema", kSchema},
                              {"mesh", std::filesystem::path(arguments.mesh).filename().string()},
                              {"triangles", triangles},
                              {"preset", arguments.preset},
                              {"points", nlohmann::ordered_json::array()}};
  for (const SweepPoint& point : points) {
    nlohmann::ordered_json one{{"file", point.file},
                               {"scale", point.scale},
                               {"seconds", point.seconds},
                               {"bytes", {{"file", point.file_bytes}, {"resident", point.resident_bytes}}},
                               {"sets", bake::to_json(point.sets)}};
    bake::add_calibration(point.sets, false, one["sets"]);
    for (const SetSpeeds& speeds : point.speeds)
      one["speed"][std::string(bake::name_of(speeds.set))] = {{"mrays_per_s", speeds.rate().median},
                                                              {"ratio", speeds.ratio_to_best().median}};
    json["points"].push_back(std::move(one));
  }
  return json;
}

void print(const std::vector<SweepPoint>& points) {
  fmt::print("{:>6}{:>10}{:>10}{:>8}  {}\n", "scale", "file", "resident", "bake",
             "wrong, certain, speed: outer-lines; inner-surface; sun");
  for (const SweepPoint& point : points) {
    fmt::print("{:>6.2f}{:>10}{:>10}{:>6.0f} s ", point.scale, format_bytes(double(point.file_bytes)),
               format_bytes(double(point.resident_bytes)), point.seconds);
    for (const bake::RaySet set :
         {bake::RaySet::outer_lines, bake::RaySet::inner_surface, bake::RaySet::sun}) {
      const bake::Accuracy& a = point.sets[size_t(set)];
      fmt::print(" {:.3f} % {:.1f} %", 100 * a.error(), 100 * a.rate(a.certain));
      for (const SetSpeeds& speeds : point.speeds)
        if (speeds.set == set) fmt::print(" {:.2f} x", speeds.ratio_to_best().median);
      fmt::print("{}", set == bake::RaySet::sun ? "\n" : ";");
    }
  }
}

void run(const Arguments& arguments) {
  if (arguments.preset == "paper")
    throw Error(Status::usage, "--preset paper is for spherical objects; a sweep bakes segment fields");
  if (!bake::preset_named(arguments.preset))
    throw Error(Status::usage, fmt::format("--preset {}: choose fast, balanced or high", arguments.preset));
  std::error_code failed;
  std::filesystem::create_directories(arguments.folder, failed);
  const auto in_folder = [&](const char* name) {
    return (std::filesystem::path(arguments.folder) / name).string();
  };
  check_output(in_folder("sweep.json"));
  limit_threads(arguments.threads);
  Progress progress(arguments.quiet);
  progress.update(0, "reading " + arguments.mesh);
  const mesh::Scene scene = mesh::read(arguments.mesh);
  uint64_t triangles = 0;
  for (const mesh::Mesh& mesh : scene.meshes) triangles += mesh.triangles.size();

  std::vector<double> scales = arguments.scales;
  if (scales.empty()) scales = {0.35, 0.5, 0.7, 1, 1.4, 2};
  std::sort(scales.begin(), scales.end());
  std::vector<SweepPoint> points;
  const double bakes = double(scales.size());
  for (size_t i = 0; i < scales.size(); ++i) {
    const std::string what = fmt::format("size {} of {}", i + 1, scales.size());
    points.push_back(bake_at(scales[i], arguments, scene, i, [&](const bake::BakeProgress& p) {
      progress.update((double(i) + 0.8 * p.fraction) / bakes, what + ": baking");
    }));
    if (!arguments.no_speed) {
      progress.update((double(i) + 0.8) / bakes, what + ": measuring speed");
      BenchOptions options{
          .asset = points.back().file,
          .mesh = arguments.mesh,
          .configuration = RuntimeArguments().configuration(),
          .against = "",
          .sets = {bake::RaySet::outer_lines, bake::RaySet::inner_surface, bake::RaySet::sun},
          .threads = {1},
          .rays = std::max<uint64_t>(arguments.rays, 20'000),
          .seed = arguments.seed + 1,
          .schedule = {}};
      options.schedule.rounds = 3;
      Progress silent(true);
      points.back().speeds = measure(options, silent).runs.front().sets;
    }
    // Saves the results so far, in case the rest is cancelled.
    const std::string json = json_of_sweep(arguments, triangles, points).dump(2) + "\n";
    write_output(in_folder("sweep.json"), std::as_bytes(std::span(json)));
  }
  const std::string title =
      fmt::format("{}, {}, preset {}", std::filesystem::path(arguments.mesh).filename().string(),
                  count_of(triangles, "triangle"), arguments.preset);
  const std::string plot = sweep_plot(title, points);
  write_output(in_folder("sweep.svg"), std::as_bytes(std::span(plot)));
  progress.finish();
  if (arguments.json)
    write_json(json_of_sweep(arguments, triangles, points));
  else if (!arguments.quiet)
    print(points);
}

}  // namespace

void add_sweep(Command app) {
  const Command command = app.add_subcommand("sweep", "Bake a mesh at several sizes and compare them");
  auto a = std::make_shared<Arguments>();
  command.add_option("MESH", a->mesh, "The mesh to bake, as for nif bake").required();
  command
      .add_option("-o,--output", a->folder,
                  "Folder for the assets, sweep.json and sweep.svg; it is created if missing")
      .required();
  command.add_option("--preset", a->preset, "fast, balanced or high").capture_default_str();
  command
      .add_option(
          "--scale", a->scales,
          "Size of the grids, as a factor on the preset's; may be repeated (default: 0.35 to 2 in six "
          "steps)")
      .range(0.1, 4.0);
  command.add_option("--rays", a->rays, "Rays per ray set to measure with").capture_default_str();
  command.add_flag("--no-speed", a->no_speed, "Do not measure speed");
  add_seed_option(command, a->seed);
  add_run_options(command, *a, kSchema);
  command.footer(
      "Examples:\n"
      "  nif sweep dragon.ply.gz -o dragon-sizes --preset fast\n"
      "  nif sweep crate.glb -o sizes --scale 0.5 --scale 1 --no-speed --json");
  command.callback([a] { run(*a); });
}

}  // namespace nif::tools
