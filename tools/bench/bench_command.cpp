// `nif bench`: compares the speed of an asset, or of a scene of instances, with Embree's on the same rays,
// and always states the error on them.
#include <fmt/format.h>
#include <tbb/info.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <filesystem>
#include <limits>
#include <memory>

#include "formats/base/file_name.hpp"
#include "formats/base/output_file.hpp"
#include "formats/base/quantities.hpp"
#include "formats/base/status.hpp"
#include "tools/bench/bench_gpu.hpp"
#include "tools/bench/bench_plot.hpp"
#include "tools/bench/bench_report.hpp"
#include "tools/bench/clip_bench.hpp"
#include "tools/bench/entrants.hpp"
#include "tools/bench/race_export.hpp"
#include "tools/bench/scene_report.hpp"
#include "tools/common/json_output.hpp"
#include "tools/common/measure_options.hpp"
#include "tools/common/options.hpp"
#include "tools/common/progress.hpp"
#include "tools/common/ray_set_option.hpp"
#include "tools/common/shared_options.hpp"
#include "tools/render/scene_file.hpp"
#include "tools/subcommands.hpp"

namespace nif::tools {
namespace {

struct Arguments : MeasureArguments {
  std::string file, mesh, asset, against, plot, folder, clip, device = "cpu", precision = "single";
  std::vector<std::string> compare;
  std::vector<uint32_t> threads;
  uint32_t rounds = 7, moved = 1000, frames = 24;
  std::string embree = "fastest";
  bool hits = false, stages = false, batches = false, json = false, quiet = false;
};

/// Keeps the first occurrence of each value.
template <class T>
void drop_repeats(std::vector<T>& list) {
  for (auto end = list.begin(); end != list.end();) {
    ++end;
    list.erase(std::remove(end, list.end(), end[-1]), list.end());
  }
}

BenchOptions resolve(const Arguments& arguments) {
  BenchOptions options{.asset = arguments.file,
                       .mesh = arguments.mesh,
                       .configuration = arguments.configuration(),
                       .against = arguments.against,
                       .compare = arguments.compare,
                       .sets = parse_sets(arguments.sets),
                       .threads = arguments.threads,
                       .fallback = !arguments.fallback.empty(),
                       .hits = arguments.hits,
                       .stages = arguments.stages,
                       .rays = arguments.rays,
                       .seed = arguments.seed,
                       .schedule = {}};
  if (options.sets.empty()) {
    options.sets = {bake::RaySet::outer_lines, bake::RaySet::inner_surface, bake::RaySet::sun};
    if (options.hits || !arguments.folder.empty()) options.sets.push_back(bake::RaySet::camera);
  }
  const auto all = uint32_t(tbb::info::default_concurrency());
  if (options.threads.empty()) options.threads = {1, 0};
  std::replace(options.threads.begin(), options.threads.end(), 0u, all);
  drop_repeats(options.sets);
  drop_repeats(options.threads);
  options.schedule.rounds = arguments.rounds;
  if (arguments.embree == "all") options.schedule.finalists = std::numeric_limits<size_t>::max();
  return options;
}

void check_plot(const Arguments& arguments) {
  if (arguments.plot.empty()) return;
  if (arguments.plot == "-") {
    throw Error(Status::usage,
                "--plot -: the results go to standard output, so give a file name for the plot");
  }
  std::error_code ignored;
  std::vector<std::string> inputs{arguments.file, arguments.mesh, arguments.asset, arguments.against};
  inputs.insert(inputs.end(), arguments.compare.begin(), arguments.compare.end());
  for (const std::string& input : inputs) {
    if (std::filesystem::equivalent(arguments.plot, input, ignored))
      throw Error(Status::usage, fmt::format("--plot {}: the plot would overwrite an input", input));
  }
  check_output(arguments.plot);
}

void check_hits(const Arguments& arguments) {
  if (!arguments.hits) return;
  if (!arguments.fallback.empty())
    throw Error(
        Status::usage,
        "--hits and --fallback cannot be used together: proofs with Embree behind them find no first hits");
  if (arguments.stages)
    throw Error(Status::usage,
                "--hits and --stages cannot be used together: the stages are those of occlusion");
}

/// Speeds measured on a busy machine are of little worth, and only this note tells the user.
void print_notes(const BenchResult& result) {
  for (const std::string& note : result.notes) fmt::print(stderr, "nif: note: {}\n", note);
  for (const ThreadRun& run : result.runs) {
    for (const SetSpeeds& speeds : run.sets) {
      if (speeds.cores > 0.85 * run.threads) continue;
      fmt::print(stderr,
                 "nif: note: {}: {} got only {:.2f} cores: other programs were running, or there were too "
                 "few rays\n",
                 bake::name_of(speeds.set), count_of(run.threads, "thread"), speeds.cores);
    }
  }
}

/// The measurement on a GPU, to which threads and Embree do not apply.
void run_gpu(const Arguments& arguments, const Command& command) {
  const auto refuse = [&](const char* option) {
    throw Error(Status::usage, fmt::format("--device {}: {} is only for the CPU", arguments.device, option));
  };
  if (!arguments.threads.empty()) refuse("--threads");
  for (const char* option : {"--isa", "--least-memory"})
    if (command.given(option)) refuse(option);
  if (arguments.embree != "fastest") refuse("--embree");
  if (!arguments.fallback.empty()) refuse("--fallback");
  if (arguments.hits) refuse("--hits");
  if (!arguments.plot.empty()) refuse("--plot");
  if (!arguments.compare.empty()) refuse("--compare");
  const BenchOptions resolved = resolve(arguments);
  const GpuBenchOptions options{
      resolved.asset,   resolved.mesh,    resolved.against,         resolved.sets,
      resolved.rays,    resolved.seed,    resolved.schedule.rounds, arguments.precision == "half",
      arguments.stages, arguments.batches};
  Progress progress(arguments.quiet);
  const GpuBenchResult result = measure_gpu(options, progress);
  progress.finish();
  if (arguments.json)
    write_json(to_json(options, result));
  else
    fmt::print("{}", gpu_bench_table(options, result));
}

bool is_scene(const std::string& file) { return render::is_gltf(file) || ending_of(file) == ".toml"; }

void write_plot(const Arguments& arguments, const BenchResult& result, const std::string& measured) {
  if (arguments.plot.empty()) return;
  const std::string plot =
      bench_plot({arguments.file, measured, arguments.rays, arguments.rounds, arguments.hits}, result);
  write_output(arguments.plot, std::as_bytes(std::span(plot)));
}

/// Over the frames of an animation.
void run_clip(const Arguments& arguments, const Command& command) {
  constexpr std::array kTakes{"ASSET|SCENE", "--mesh",   "--clip", "--frames",       "--set",  "--rays",
                              "--seed",      "--rounds", "--isa",  "--least-memory", "--json", "--quiet"};
  for (const std::string& given : command.given())
    if (std::ranges::find(kTakes, given) == kTakes.end())
      throw Error(Status::usage, fmt::format("--clip and {} cannot be used together", given));
  const BenchOptions resolved = resolve(arguments);
  const ClipBenchOptions options{.asset = arguments.file,
                                 .mesh = arguments.mesh,
                                 .configuration = resolved.configuration,
                                 .clip = arguments.clip,
                                 .frames = arguments.frames,
                                 .sets = resolved.sets,
                                 .rays = resolved.rays,
                                 .seed = resolved.seed,
                                 .rounds = arguments.rounds};
  Progress progress(arguments.quiet);
  const ClipBenchResult result = measure_clip(options, progress);
  progress.finish();
  if (arguments.json)
    write_json(to_json(options, result));
  else
    fmt::print("{}", clip_bench_tables(options, result));
}

/// Writes what a race asks, instead of measuring. `Options`: of an asset or of a scene.
template <class Options>
void run_export(const Arguments& arguments, const Command& command, const Options& options) {
  constexpr std::array kTakes{"ASSET|SCENE", "--mesh", "--asset",  "--set",  "--rays",
                              "--seed",      "--hits", "--export", "--json", "--quiet"};
  for (const std::string& given : command.given())
    if (std::ranges::find(kTakes, given) == kTakes.end())
      throw Error(Status::usage,
                  fmt::format("--export and {} cannot be used together: an export measures nothing", given));
  Progress progress(arguments.quiet);
  const nlohmann::ordered_json race = export_race(options, arguments.folder, progress);
  progress.finish();
  if (arguments.json)
    write_json(race);
  else if (!arguments.quiet)
    fmt::print("{}", export_summary(race, arguments.folder));
}

void run_scene(const Arguments& arguments, const Command& command) {
  for (const char* option : {"--mesh", "--fallback", "--stages", "--device", "--batches", "--precision"})
    if (command.given(option))
      throw Error(Status::usage,
                  fmt::format("{}: {} is only for an ASSET, not for a scene", arguments.file, option));
  if (!arguments.against.empty() && !render::is_gltf(arguments.file))
    throw Error(Status::usage,
                fmt::format("--against {}: {} names its assets itself", arguments.against, arguments.file));
  const BenchOptions resolved = resolve(arguments);
  const SceneBenchOptions options{.scene = arguments.file,
                                  .asset = arguments.asset,
                                  .configuration = resolved.configuration,
                                  .sets = resolved.sets,
                                  .threads = resolved.threads,
                                  .rays = resolved.rays,
                                  .seed = resolved.seed,
                                  .moved = arguments.moved,
                                  .hits = resolved.hits,
                                  .schedule = resolved.schedule,
                                  .against = resolved.against,
                                  .compare = resolved.compare};
  if (!arguments.folder.empty()) return run_export(arguments, command, options);
  check_plot(arguments);
  Progress progress(arguments.quiet);
  const SceneBenchResult result = measure_scene(options, progress);
  progress.finish();
  if (!arguments.quiet) print_notes(result.still);
  if (arguments.json)
    write_json(to_json(options, result));
  else
    fmt::print("{}", scene_bench_tables(options, result));
  write_plot(arguments, result.still,
             fmt::format("{} of {}", count_of(result.instances, "instance"),
                         count_of(result.still.triangles, "triangle")));
}

void run(const Arguments& arguments, const Command& command) {
  if (is_scene(arguments.file)) return run_scene(arguments, command);
  for (const char* option : {"--asset", "--moved"})
    if (command.given(option))
      throw Error(Status::usage,
                  fmt::format("{}: {} is only for a scene (.toml, .gltf or .glb)", arguments.file, option));
  if (arguments.mesh.empty())
    throw Error(Status::usage, arguments.file + ": --mesh is required: the mesh that it was baked from");
  if (!arguments.clip.empty()) return run_clip(arguments, command);
  if (!arguments.folder.empty()) return run_export(arguments, command, resolve(arguments));
  if (arguments.device != "cpu") return run_gpu(arguments, command);
  if (arguments.batches) throw Error(Status::usage, "--batches is only for a GPU: add --device gpu");
  if (arguments.precision != "single")
    throw Error(Status::usage, "--precision is only for a GPU: add --device gpu");
  check_hits(arguments);
  const BenchOptions options = resolve(arguments);
  check_plot(arguments);
  Progress progress(arguments.quiet);
  const BenchResult result = measure(options, progress);
  progress.finish();
  if (!arguments.quiet) print_notes(result);
  if (arguments.json) {
    write_json(to_json(options, result));
  } else {
    fmt::print("{}", bench_tables(options, result));
  }
  write_plot(arguments, result, count_of(result.triangles, "triangle"));
}

}  // namespace

void add_bench(Command app) {
  const Command command =
      app.add_subcommand("bench", "Compare the speed of an asset or a scene with Embree's fastest");
  auto a = std::make_shared<Arguments>();
  command
      .add_option("ASSET|SCENE", a->file,
                  "The .nif file to measure, or a scene as nif render takes it (.toml, .gltf, .glb)")
      .required();
  command.add_option("--mesh", a->mesh, "For an ASSET: the mesh that it was baked from");
  command.add_option("--asset", a->asset,
                     "For a SCENE in glTF: the .nif file that was baked from it. A .toml names its assets");
  add_measure_options(command, *a, "outer-lines, inner-surface and sun; with --hits also camera");
  command.add_option("--moved", a->moved, "For a SCENE: instances to move; 0 for none").capture_default_str();
  command
      .add_option("-j,--threads", a->threads,
                  "Query threads (0 = all cores); may be repeated (default: 1, then all cores)")
      .range(0, 1024);
  command.add_option("--rounds", a->rounds, "Measured rounds; everything is timed once per round")
      .range(1, 1000)
      .capture_default_str();
  command
      .add_option("--embree", a->embree,
                  "fastest: two trial rounds select the two fastest calls of each Embree build; all: every "
                  "call is timed in all rounds")
      .one_of({"fastest", "all"})
      .capture_default_str();
  command.add_option(
      "--against", a->against,
      "Another .nif file of the same mesh or glTF to time in the same rounds, e.g. with another encoding");
  command
      .add_option("--compare", a->compare,
                  fmt::format("Results of another program for the rays of an export ({}), to check and to "
                              "show beside; may be repeated",
                              kEntrantSchema))
      .one_word_each();
  command.add_option("--export", a->folder,
                     fmt::format("Measure nothing; write the meshes and the rays of each set to this folder "
                                 "({}), so that any other program can take part",
                                 kRaceSchema));
  command.add_option(
      "--clip", a->clip,
      "Measure the asset frame by frame as an animation of the mesh poses it: the clip's name, its number "
      "from 0 on, or all; with Embree's trees refitted and rebuilt, visibility and first hits, on one "
      "thread. "
      "Needs an asset baked with --deforms");
  command.add_option("--frames", a->frames, "Frames of the clip, evenly from its first key to its last")
      .range(1u, 100'000u)
      .capture_default_str();
  command.add_flag("--hits", a->hits, "Race first hits (nifIntersect and rtcIntersect) instead of occlusion");
  command.add_flag("--stages", a->stages,
                   "Also time the stages: of spherical objects on one thread, or of the pipeline on a GPU");
  command
      .add_option("--device", a->device,
                  "cpu: compare with Embree; gpu: compare with an exact BVH of the mesh on the same GPU")
      .one_of({"cpu", "gpu"})
      .capture_default_str();
  command.add_option("--precision", a->precision, "On a GPU: precision of the networks of spherical objects")
      .one_of({"single", "half"})
      .capture_default_str();
  command.add_flag("--batches", a->batches, "On a GPU: also time smaller batches of rays");
  add_json_option(command, a->json,
                  fmt::format("{}; for a scene {}; of a clip {}; on a GPU {}", kBenchSchema,
                              kSceneBenchSchema, kClipBenchSchema, kGpuBenchSchema));
  command.add_option("--plot", a->plot, "Also plot the results as an SVG to this file");
  add_quiet_option(command, a->quiet);
  command.footer(
      "If a file has several objects, each answers its own rays in its own space, on both sides. Times, "
      "bytes and\n"
      "errors are added up. Rates are in millions of rays per second, medians over the rounds.\n"
      "A scene is queried as a whole, with instances on both sides. Then some instances are moved, which is "
      "timed, too,\n"
      "and the scene is queried again. Each object of a .toml needs an asset (nif = \"...\").\n"
      "Examples:\n"
      "  nif bench dragon.nif --mesh dragon.ply.gz --plot dragon.svg\n"
      "  nif bench dragon.nif --mesh dragon.ply.gz --hits\n"
      "  nif bench dragon.nif --mesh dragon.ply.gz --device gpu --stages --batches\n"
      "  nif bench dragon.nif --mesh dragon.ply.gz --export race\n"
      "  nif bench dragon.nif --mesh dragon.ply.gz --compare other/results.json --plot dragon.svg\n"
      "  nif bench city.glb --asset city.nif\n"
      "  nif bench knight.nif --mesh knight.glb --clip Walking_A --frames 60\n"
      "  nif bench scene.toml --set sun --moved 100");
  command.callback([a, command] { run(*a, command); });
}

}  // namespace nif::tools
