// `nif bake`: a mesh file in, a .nif asset out.
#include "bake/bake.hpp"

#include <fmt/format.h>

#include <chrono>
#include <filesystem>
#include <memory>

#include "bake/report.hpp"
#include "formats/mesh/read.hpp"
#include "formats/nif/reader.hpp"
#include "formats/nif/writer.hpp"
#include "formats/output_file.hpp"
#include "tools/accuracy_table.hpp"
#include "tools/command.hpp"
#include "tools/measuring.hpp"
#include "tools/progress.hpp"
#include "tools/render/scene_file.hpp"
#include "tools/render/scene_meshes.hpp"
#include "tools/render/view_rays.hpp"
#include "tools/spherical_options.hpp"

namespace nif::tools {
namespace {

struct Arguments {
  std::string mesh, output;
  std::optional<std::string> preset;
  std::optional<std::string> encoding;
  std::optional<uint32_t> resolution;
  std::string max_bytes, max_error, mix;
  uint64_t seed = 1;
  uint32_t threads = 0;
  uint64_t rays = 1'000'000;
  SphericalArguments spherical;
  bool json = false, quiet = false;
};

/// "outer-lines=0.5,segments=0.5", or names alone for equal shares.
bake::Mix parse_mix(const std::string& text) {
  bake::Mix mix{};
  for (const std::string& part : CLI::detail::split(text, ',')) {
    const size_t equals = part.find('=');
    const std::string name = part.substr(0, equals);
    const std::optional<bake::RaySet> set = bake::ray_set_named(name);
    if (!set || *set == bake::RaySet::sun) {
      throw Error(Status::usage,
                  fmt::format("--mix names '{}'; rays can be drawn from outer-lines, inner-surface, "
                              "inner-volume and segments",
                              name));
    }
    mix[size_t(*set)] =
        equals == std::string::npos ? 1.0 : parse_rate(part.substr(equals + 1), "--mix " + name);
  }
  double total = 0;
  for (double share : mix) total += share;
  if (!(total > 0)) throw Error(Status::usage, "--mix leaves no rays to train on");
  return mix;
}

bake::BakeOptions resolve_options(const Arguments& arguments) {
  bake::BakeOptions options;
  const bool paper = arguments.preset == "paper";
  const std::string encoding_name = arguments.encoding.value_or(paper ? "spherical" : "auto");
  const std::string preset = arguments.preset.value_or(encoding_name == "spherical" ? "paper" : "balanced");
  const std::optional<bake::Preset> known_preset = bake::preset_named(preset);
  if (!known_preset)
    throw Error(Status::usage, fmt::format("--preset '{}' is none of fast, balanced, high, paper", preset));
  const std::optional<bake::EncodingOption> encoding = bake::encoding_named(encoding_name);
  if (!encoding) {
    throw Error(Status::usage,
                fmt::format("--encoding '{}' is none of auto, segment, bvh, spherical", encoding_name));
  }
  if (*encoding == bake::EncodingOption::bvh) {
    const char* idle = arguments.preset         ? "--preset"
                       : arguments.resolution   ? "--resolution"
                       : !arguments.mix.empty() ? "--mix"
                                                : nullptr;
    if (idle)
      throw Error(Status::usage,
                  fmt::format("--encoding bvh and {} contradict each other: no field is trained", idle));
  }
  const bool spherical = *encoding == bake::EncodingOption::spherical;
  if (spherical != (preset == "paper"))
    throw Error(Status::usage,
                fmt::format("--encoding {} and --preset {} contradict each other: paper is the "
                            "preset of spherical, and its only one",
                            encoding_name, preset));
  if (spherical && arguments.resolution)
    throw Error(Status::usage,
                "--encoding spherical and --resolution contradict each other: its grids are set by "
                "--outer-resolution, --inner-resolution and --distance-resolution");
  if (arguments.spherical.view && !arguments.mix.empty())
    throw Error(Status::usage, "--view and --mix contradict each other: rays come from the one or the other");
  if (spherical) {
    options.spherical = resolve_spherical(arguments.spherical);
  } else if (const char* idle = arguments.spherical.first_given()) {
    throw Error(Status::usage, fmt::format("{} is an option of --encoding spherical, and the encoding is {}",
                                           idle, encoding_name));
  }
  options.encoding = *encoding;
  options.preset = *known_preset;
  options.seed = arguments.seed;
  options.evaluation_rays = arguments.rays;
  options.resolution = arguments.resolution;
  if (!arguments.max_bytes.empty()) {
    if (arguments.resolution) {
      throw Error(Status::usage, "--resolution and --max-bytes contradict each other: each sets the grid");
    }
    options.max_bytes = parse_bytes(arguments.max_bytes, "--max-bytes");
  }
  if (!arguments.max_error.empty()) {
    if (arguments.rays == 0) {
      throw Error(Status::usage, "--max-error and --rays 0 contradict each other: nothing would be measured");
    }
    options.max_error = parse_rate(arguments.max_error, "--max-error");
  }
  if (!arguments.mix.empty()) options.mix = parse_mix(arguments.mix);
  return options;
}

struct AssetBytes {
  uint64_t file, resident, occupancy = 0, features = 0, network = 0, bvh = 0, grids = 0, primary = 0;
};

AssetBytes count_bytes(std::span<const std::byte> file) {
  const format::AssetView view = format::read_asset(file, "the new asset");
  AssetBytes bytes{file.size(), resident_bytes(file)};
  for (const format::ObjectView& object : view.objects) {
    bytes.occupancy += object.occupancy_bytes;
    bytes.features += object.feature_bytes;
    bytes.bvh += object.bvh_bytes;
    bytes.grids += object.grid_bytes;
  }
  for (const format::NetworkView& network : view.networks) bytes.network += network.bytes;
  for (const format::SphericalNetworksView& networks : view.spherical_networks)
    bytes.network += networks.bytes;
  for (const format::PrimaryView& primary : view.primaries)
    bytes.primary += primary.grid_bytes + primary.network_bytes;
  return bytes;
}

nlohmann::ordered_json to_json(const std::optional<bake::EncodingCost>& cost) {
  if (!cost) return nullptr;
  nlohmann::ordered_json json{{"bytes", cost->bytes}};
  if (cost->work > 0) json["work"] = cost->work;
  if (cost->error) json["error"] = *cost->error;
  return json;
}

nlohmann::ordered_json to_json(const bake::ObjectReport& object) {
  nlohmann::ordered_json json{{"name", object.name},
                              {"encoding", bake::name_of(object.encoding)},
                              {"reason", object.reason},
                              {"triangles", object.triangles},
                              {"degenerate", object.cleaned.degenerate},
                              {"duplicate", object.cleaned.duplicate},
                              {"closed_components", object.closed_components},
                              {"open_components", object.open_components}};
  if (object.as_bvh || object.as_segment)
    json["compared"] = {{"segment", to_json(object.as_segment)}, {"bvh", to_json(object.as_bvh)}};
  if (object.encoding == format::kSegment) {
    json["voxels"] = object.voxels;
    json["surface_voxels"] = object.surface_voxels;
    json["inside_voxels"] = object.inside_voxels;
    json["unknown_voxels"] = object.unknown_voxels;
  }
  json["training_rays"] = object.training_rays;
  if (object.primary_rays) json["primary_rays"] = object.primary_rays;
  json["recoveries"] = object.recoveries;
  json["sets"] = bake::to_json(object.sets);
  return json;
}

void print_json(const Arguments& arguments, const bake::BakeResult& result, const AssetBytes& bytes,
                double seconds) {
  nlohmann::ordered_json objects = nlohmann::ordered_json::array();
  for (const bake::ObjectReport& object : result.objects) objects.push_back(to_json(object));
  const nlohmann::ordered_json json{{"schema", "nifkit.bake/1"},
                                    {"file", arguments.output},
                                    {"triangles", result.triangles},
                                    {"instances", result.asset.instances.size()},
                                    {"seconds", seconds},
                                    {"peak_memory", peak_memory()},
                                    {"bytes",
                                     {{"file", bytes.file},
                                      {"resident", bytes.resident},
                                      {"occupancy", bytes.occupancy},
                                      {"features", bytes.features},
                                      {"network", bytes.network},
                                      {"bvh", bytes.bvh},
                                      {"grids", bytes.grids},
                                      {"primary", bytes.primary}}},
                                    {"sets", bake::to_json(result.sets)},
                                    {"objects", std::move(objects)}};
  fmt::print("{}\n", json.dump(2, ' ', false, nlohmann::json::error_handler_t::replace));
}

void print_summary(const Arguments& arguments, const bake::BakeResult& result, const AssetBytes& bytes,
                   double seconds) {
  fmt::print("{}: {} in {}, {}; baked in {:.1f} s, at most {} of memory\n", arguments.output,
             count_of(result.triangles, "triangle"), count_of(result.objects.size(), "object"),
             count_of(result.asset.instances.size(), "instance"), seconds,
             format_bytes(double(peak_memory())));
  fmt::print("{} as a file, {} resident (occupancy {}, features {}, networks {}, BVHs {}, grids {})\n",
             format_bytes(double(bytes.file)), format_bytes(double(bytes.resident)),
             format_bytes(double(bytes.occupancy)), format_bytes(double(bytes.features)),
             format_bytes(double(bytes.network)), format_bytes(double(bytes.bvh)),
             format_bytes(double(bytes.grids)));
  if (bytes.primary) fmt::print("of which for primary rays {}\n", format_bytes(double(bytes.primary)));
  constexpr size_t kShown = 20;
  for (size_t i = 0; i < std::min(kShown, result.objects.size()); ++i) {
    const bake::ObjectReport& object = result.objects[i];
    fmt::print("'{}' is {}: {}\n", object.name, bake::name_of(object.encoding), object.reason);
  }
  if (result.objects.size() > kShown)
    fmt::print("and {} more; --json lists all\n", result.objects.size() - kShown);
  if (arguments.rays > 0) fmt::print("\n{}", accuracy_table(result.sets));
}

/// What preparation changed or could not do, for people to see.
void print_notes(const mesh::Scene& scene, const bake::BakeResult& result) {
  for (const std::string& warning : scene.warnings) fmt::print(stderr, "nif: note: {}\n", warning);
  for (const std::string& note : result.notes) fmt::print(stderr, "nif: note: {}\n", note);
  for (const bake::ObjectReport& object : result.objects) {
    if (object.cleaned.degenerate || object.cleaned.duplicate) {
      fmt::print(stderr, "nif: note: '{}': dropped {} triangles without area and {} duplicates\n",
                 object.name, object.cleaned.degenerate, object.cleaned.duplicate);
    }
    if (object.recoveries) {
      fmt::print(stderr,
                 "nif: note: '{}': the loss became non-finite {} time(s); training went back and on more "
                 "carefully\n",
                 object.name, object.recoveries);
    }
  }
}

std::string describe(const bake::BakeProgress& p) {
  std::string text;
  switch (p.stage) {
    case bake::BakeProgress::Stage::preparing:
      text = "preparing ";
      break;
    case bake::BakeProgress::Stage::choosing:
      text = "choosing an encoding for ";
      break;
    case bake::BakeProgress::Stage::training:
      text = "training ";
      break;
    case bake::BakeProgress::Stage::measuring:
      text = "measuring ";
      break;
  }
  text += p.object;
  if (p.object_count > 1) text += fmt::format(" ({} of {})", p.object_index + 1, p.object_count);
  if (p.loss > 0) text += fmt::format("  loss {:.4f}  wrong where learned {:.2f} %", p.loss, p.error * 100);
  return text;
}

/// What the training rays of a view are drawn from.
struct View {
  render::SceneDescription scene;
  std::vector<std::string> notes;
  render::ObjectMeshes meshes;
  render::Lighting lighting;
  render::World world;
  render::ViewRays rays;

  View(render::SceneDescription description, const std::string& mesh, const mesh::Scene& baked,
       Progress& progress)
      : scene(std::move(description)),
        meshes(render::read_meshes(scene, notes, progress)),
        lighting(scene),
        world(scene, std::move(meshes), "", progress),
        rays(scene, world, lighting, mesh, baked) {}
};

render::SceneDescription read_view(const SphericalArguments& arguments) {
  render::SceneDescription scene = render::read_scene(*arguments.view);
  scene.picture.samples = arguments.view_samples.value_or(scene.picture.samples);
  for (render::ObjectDescription& object : scene.objects) {  // labels are exact
    object.nif.reset();
    object.primary = false;
  }
  return scene;
}

void run(const Arguments& arguments) {
  const auto start = std::chrono::steady_clock::now();
  bake::BakeOptions options = resolve_options(arguments);
  std::error_code ignored;
  if (std::filesystem::equivalent(arguments.mesh, arguments.output, ignored)) {
    throw Error(Status::usage, fmt::format("{}: the output would overwrite the input", arguments.output));
  }
  if (arguments.output == "-") {
    throw Error(Status::usage,
                "-o -: an asset is written whole or not at all, so it needs a file, not a stream");
  }
  check_output(arguments.output);
  limit_threads(arguments.threads);

  Progress progress(arguments.quiet);
  progress.update(0, "reading " + arguments.mesh);
  const mesh::Scene scene = mesh::read(arguments.mesh);
  const std::atomic<bool>& cancel = interruption();
  std::unique_ptr<View> view;
  if (arguments.spherical.view) {
    view = std::make_unique<View>(read_view(arguments.spherical), arguments.mesh, scene, progress);
    progress.finish();
    if (!arguments.quiet)
      for (const std::string& note : view->notes) fmt::print(stderr, "nif: note: {}\n", note);
    const render::PictureDescription& picture = view->scene.picture;
    options.spherical.given = bake::GivenRays{
        fmt::format("{}, {} x {} pixels, {} samples each", count_of(view->scene.cameras.size(), "camera"),
                    picture.width, picture.height, picture.samples),
        picture.samples,
        [&](uint64_t round) { return view->rays.draw(round); },
        {}};
    if (arguments.spherical.primary)
      options.spherical.given->draw_primary = [&](uint64_t round) { return view->rays.draw_primary(round); };
  }
  const bake::BakeResult result = naming(arguments.mesh, [&] {
    return bake::bake(
        scene, options, [&](const bake::BakeProgress& p) { progress.update(p.fraction, describe(p)); },
        cancel);
  });
  const std::vector<std::byte> file = format::encode(result.asset);
  if (options.max_bytes && file.size() > *options.max_bytes) {
    throw Error(Status::target_not_met, fmt::format("--max-bytes {} is not met: the asset takes {} bytes",
                                                    *options.max_bytes, file.size()));
  }
  const AssetBytes bytes = count_bytes(file);
  if (cancel) throw Error(Status::interrupted, "the bake was cancelled");
  write_output(arguments.output, file);
  progress.finish();

  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  if (!arguments.quiet) print_notes(scene, result);
  if (arguments.json) {
    print_json(arguments, result, bytes, seconds);
  } else if (!arguments.quiet) {
    print_summary(arguments, result, bytes, seconds);
  }
}

}  // namespace

void add_bake(CLI::App& app) {
  CLI::App* command = app.add_subcommand("bake", "Bake a mesh into a .nif asset");
  auto a = std::make_shared<Arguments>();
  command->add_option("MESH", a->mesh, "OBJ, PLY, STL, OFF, glTF, GLB or DRC, also as .gz or .zst")
      ->required();
  command->add_option("-o,--output", a->output, "The .nif file to write")->required();
  command
      ->add_option("--preset", a->preset,
                   "fast, balanced or high: how fine and how long. paper: spherical, as published")
      ->default_str("balanced");
  command
      ->add_option(
          "--encoding", a->encoding,
          "segment: small fields, some answers wrong. bvh: exact, 16 bytes or so a triangle; nothing is "
          "trained. auto: for each object the better one of these, by bytes, work and measured error, and "
          "why. "
          "spherical: the fields of the paper that this idea is from, for comparison")
      ->default_str("auto");
  command
      ->add_option("--resolution", a->resolution,
                   "Voxels along the longest side of objects of 150,000 triangles or "
                   "more; fewer for smaller ones")
      ->check(CLI::Range(2u, kernels::kMaxVoxels));
  command->add_option("--max-bytes", a->max_bytes,
                      "Largest size of the file, e.g. 200kB: the finest grids up to the preset's that fit, "
                      "BVHs where there is room");
  command->add_option("--max-error", a->max_error,
                      "Write nothing where more of a ray set is wrong, e.g. 0.002 or 0.2%; with auto, fields "
                      "that are become BVHs");
  command->add_option("--mix", a->mix, "Ray sets to train on, e.g. outer-lines=0.5,segments=0.5");
  command
      ->add_option("--seed", a->seed, "Start of all random numbers: same input, options and seed, same bytes")
      ->capture_default_str();
  command->add_option("-j,--threads", a->threads, "Threads; 0: all. The result is the same for any number")
      ->capture_default_str();
  command->add_option("--rays", a->rays, "Rays of each set to measure the accuracy with; 0: do not")
      ->capture_default_str();
  add_spherical_options(*command, a->spherical);
  command->add_flag("--json", a->json, "Print the results as one JSON object (nifkit.bake/1)");
  command->add_flag("--quiet", a->quiet, "No progress, notes or summary");
  command->footer("Example: nif bake dragon.ply.gz -o dragon.nif --max-bytes 200kB");
  command->callback([a] { run(*a); });
}

}  // namespace nif::tools
