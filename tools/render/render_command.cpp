// `nif render`: renders a scene with shadow rays answered by Embree and by assets, to compare them; with
// camera rays answered by fields for primary rays; or with all rays answered by assets.
#include <fmt/format.h>
#include <tbb/task_arena.h>

#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "formats/base/output_file.hpp"
#include "formats/base/quantities.hpp"
#include "formats/base/status.hpp"
#include "tools/common/interruption.hpp"
#include "tools/common/json_output.hpp"
#include "tools/common/notes.hpp"
#include "tools/common/options.hpp"
#include "tools/common/progress.hpp"
#include "tools/common/runtime_handles.hpp"
#include "tools/common/shared_options.hpp"
#include "tools/common/threads.hpp"
#include "tools/render/compare_pictures.hpp"
#include "tools/render/flip.hpp"
#include "tools/render/renderer.hpp"
#include "tools/render/scene_file.hpp"
#include "tools/render/scene_meshes.hpp"
#include "tools/subcommands.hpp"

namespace nif::tools {
namespace {

namespace fs = std::filesystem;
using render::Image;
using render::Mode;
using Json = nlohmann::ordered_json;

constexpr const char* kSchema = "nifkit.render/1";

struct Arguments : RunArguments, RuntimeArguments {
  std::string scene, folder;
  std::vector<std::string> cameras;
  std::optional<uint32_t> samples, width, height, bounces;
  std::optional<uint64_t> seed;
  std::string primary = "embree";
  double confidence = 0.9;
  std::string exact = "none";
  std::optional<std::string> sheet, clip;
  double time = 0;
  uint32_t thumbnail = 240;
  bool exr = false, ignore_alpha = false;

  /// Whether another picture is made with all rays answered by assets.
  bool by_assets() const { return primary == "asset"; }
};

/// How a picture with other answers differs from the reference.
struct PictureError {
  Mode mode;
  double psnr, ssim, flip;
};

struct CameraResult {
  std::string name;
  render::ShadowRays shadow_rays;
  render::CameraRays camera_rays;
  std::vector<PictureError> errors;
  Image thumbnail;  ///< reference, other answers and error side by side; empty if no sheet is requested
  double seconds = 0;
};

void override_picture(const Arguments& arguments, render::PictureDescription& picture) {
  picture.samples = arguments.samples.value_or(picture.samples);
  picture.width = arguments.width.value_or(picture.width);
  picture.height = arguments.height.value_or(picture.height);
  picture.bounces = arguments.bounces.value_or(picture.bounces);
  picture.seed = arguments.seed.value_or(picture.seed);
}

void keep_cameras(const Arguments& arguments, render::SceneDescription& scene) {
  if (arguments.cameras.empty()) return;
  std::vector<render::CameraDescription> kept;
  for (const std::string& name : arguments.cameras) {
    const auto found =
        std::find_if(scene.cameras.begin(), scene.cameras.end(),
                     [&](const render::CameraDescription& camera) { return camera.name == name; });
    if (found == scene.cameras.end()) {
      std::string names;
      for (const auto& camera : scene.cameras) names += (names.empty() ? "" : ", ") + camera.name;
      throw Error(Status::usage, fmt::format("--camera: {} has no camera '{}'; its cameras are {}",
                                             scene.file, name, names));
    }
    kept.push_back(*found);
  }
  scene.cameras = std::move(kept);
}

/// The folder for pictures may exist, or be created if only its last part is missing.
void check_folder(const std::string& folder) {
  std::error_code error;
  const fs::path path(folder), whole = fs::absolute(path / "").lexically_normal();
  const fs::path parent = whole.parent_path().parent_path();  // whole ends in a slash, given or added
  if (fs::is_directory(path, error)) return;
  if (fs::exists(path, error)) throw Error(Status::output_not_writable, folder + ": is not a folder");
  if (!fs::is_directory(parent, error))
    throw Error(Status::output_folder_missing,
                fmt::format("{}: the folder {} does not exist", folder, parent.string()));
}

void make_folder(const std::string& folder) {
  std::error_code error;
  if (!fs::create_directory(folder, error) && error)
    throw Error(Status::output_not_writable,
                fmt::format("{}: cannot be created: {}", folder, error.message()));
}

/// Writes the pictures; for the last rendering also how much each differs from the reference.
CameraResult write_pictures(const Arguments& arguments, const std::string& camera,
                            const render::Rendering& rendering, bool last) {
  const auto path = [&](const std::string& what) {
    return (fs::path(arguments.folder) / fmt::format("{}-{}", camera, what)).string();
  };
  std::array<Image, render::kModes.size()> shown;
  CameraResult result{camera, rendering.shadow_rays, rendering.camera_rays, {}, {}, 0};
  const Image& reference = shown[size_t(Mode::reference)];
  for (const Mode mode : render::kModes) {
    const Image& linear = rendering.images[size_t(mode)];
    if (linear.values.empty()) continue;
    shown[size_t(mode)] = render::srgb_encoded(linear);
    render::write_png(path(fmt::format("{}.png", name_of(mode))), shown[size_t(mode)]);
    if (!last) continue;
    if (arguments.exr) render::write_exr(path(fmt::format("{}.exr", name_of(mode))), linear);
    if (mode != Mode::reference)
      result.errors.push_back({mode, render::psnr(reference, shown[size_t(mode)]),
                               render::ssim(reference, shown[size_t(mode)]),
                               render::flip(reference, shown[size_t(mode)])});
  }
  if (last && !rendering.normals[0].values.empty())
    render::write_png(path("normals.png"),
                      render::side_by_side({&rendering.normals[0], &rendering.normals[1]}));
  if (last && !result.errors.empty()) {
    const auto beside = [&](const Image& learned, const Image& error) {
      return render::side_by_side({&reference, &learned, &error});
    };
    const Image& learned = shown[size_t(arguments.by_assets() ? Mode::asset : Mode::probability)];
    const Image error = render::difference(reference, learned, 3);
    render::write_png(path("error.png"), error);
    Image together = beside(learned, error);
    render::write_png(path("compare.png"), together);
    // A sheet shows the picture that the scene is about.
    const Image& primary = shown[size_t(Mode::primary)];
    if (!primary.values.empty()) together = beside(primary, render::difference(reference, primary, 3));
    if (arguments.sheet) result.thumbnail = render::scaled_down(together, 3 * arguments.thumbnail);
  } else if (last && arguments.sheet) {
    result.thumbnail = render::scaled_down(reference, arguments.thumbnail);
  }
  return result;
}

render::Exact exact_named(const std::string& name) {
  return name == "inside"    ? render::Exact::inside
         : name == "outside" ? render::Exact::outside
                             : render::Exact::none;
}

double mrays_per_s(uint64_t rays, double seconds) { return seconds > 0 ? double(rays) / seconds / 1e6 : 0; }

double mean(double sum, uint64_t count) { return count ? sum / double(count) : 0; }

/// PSNR, SSIM and FLIP are printed under the name of their picture.
void print_camera_rays(const std::vector<CameraResult>& results, Mode mode) {
  fmt::print("{:16} {:<24} {:>11} {:>12} {:>8} {:>9} {:>8}\n", "camera", name_of(mode), "camera rays",
             "on objects", "differ", "depth", "normal");
  for (const CameraResult& result : results) {
    const render::CameraRays& rays = result.camera_rays;
    const PictureError& error = result.errors.back();
    fmt::print("{:16} {:5.2f} dB {:<7.5f} {:<7.5f} {:>11} {:>11.1f}% {:>7.3f}% {:>8.4f}% {:>7.2f}°\n",
               result.name, error.psnr, error.ssim, error.flip, rays.rays,
               100 * mean(double(rays.hits), rays.rays), 100 * mean(double(rays.differ), rays.rays),
               100 * mean(rays.depth_error, rays.both), mean(rays.normal_error, rays.both));
  }
}

void print_table(const std::vector<CameraResult>& results, const render::World& world, double exposure,
                 bool by_assets) {
  fmt::print("{} triangles", world.triangles());
  if (world.has_assets())
    fmt::print("; assets {}, {} in memory", format_bytes(double(world.assets().asset_bytes())),
               format_bytes(double(world.assets().resident_bytes())));
  fmt::print("; Embree {} in memory; exposure {:.4g}\n\n", format_bytes(double(world.embree_bytes())),
             exposure);
  if (by_assets) return print_camera_rays(results, Mode::asset);
  if (!world.has_assets()) {
    fmt::print("{:16} {:>12} {:>10} {:>9}\n", "camera", "shadow rays", "Mrays/s", "seconds");
    for (const CameraResult& result : results)
      fmt::print("{:16} {:>12} {:>10.2f} {:>9.1f}\n", result.name, result.shadow_rays.rays,
                 mrays_per_s(result.shadow_rays.rays, result.shadow_rays.embree_seconds), result.seconds);
    return;
  }
  fmt::print("{:16}", "camera");
  for (const Mode mode : {Mode::bits, Mode::probability, Mode::hybrid}) fmt::print(" {:<17}", name_of(mode));
  fmt::print(" {:>11} {:>7} {:>8} {:>7} {:>8}\n", "shadow rays", "wrong", "certain", "exact", "seconds");
  for (const CameraResult& result : results) {
    const render::ShadowRays& rays = result.shadow_rays;
    const double percent = rays.rays ? 100.0 / double(rays.rays) : 0;
    fmt::print("{:16}", result.name);
    for (const PictureError& error : result.errors)
      if (error.mode != Mode::primary) fmt::print(" {:5.2f} dB {:<8.5f}", error.psnr, error.ssim);
    fmt::print(" {:>11} {:>6.3f}% {:>7.1f}% {:>6.1f}% {:>8.1f}\n", rays.rays,
               percent * double(rays.leak + rays.spurious), percent * double(rays.certain),
               percent * double(rays.exact), result.seconds);
  }
  if (!world.has_primaries()) return;
  fmt::print("\n");
  print_camera_rays(results, Mode::primary);
}

Json to_json(const render::CameraRays& seen) {
  return {{"rays", seen.rays},
          {"hits", mean(double(seen.hits), seen.rays)},
          {"differ", mean(double(seen.differ), seen.rays)},
          {"depth_error", mean(seen.depth_error, seen.both)},
          {"normal_error", mean(seen.normal_error, seen.both)}};
}

Json to_json(const std::vector<CameraResult>& results, const Arguments& arguments, const render::World& world,
             const render::PictureDescription& picture, double exposure) {
  Json json{{"schema", kSchema},
            {"file", arguments.scene},
            {"triangles", world.triangles()},
            {"bytes",
             {{"file", world.assets().asset_bytes()},
              {"resident", world.assets().resident_bytes()},
              {"embree", world.embree_bytes()}}},
            {"width", picture.width},
            {"height", picture.height},
            {"samples", picture.samples},
            {"bounces", picture.bounces},
            {"primary", arguments.primary},
            {"exact", arguments.exact},
            {"exposure", exposure},
            {"cameras", Json::object()}};
  for (const CameraResult& result : results) {
    const render::ShadowRays& rays = result.shadow_rays;
    const double each = rays.rays ? 1 / double(rays.rays) : 0;
    Json camera{{"shadow_rays", rays.rays},
                {"seconds", result.seconds},
                {"embree_mrays_per_s", mrays_per_s(rays.rays, rays.embree_seconds)}};
    if (!result.errors.empty() && !arguments.by_assets()) {
      camera["nif_mrays_per_s"] = mrays_per_s(rays.rays, rays.asset_seconds + rays.beside_seconds);
      camera["error"] = double(rays.leak + rays.spurious) * each;
      camera["leak"] = double(rays.leak) * each;
      camera["spurious"] = double(rays.spurious) * each;
      camera["certain"] = double(rays.certain) * each;
      camera["exact"] = double(rays.exact) * each;
    }
    for (const PictureError& error : result.errors)  // equal pictures: JSON has no infinity
      camera["pictures"][name_of(error.mode)] = {
          {"psnr", std::isfinite(error.psnr) ? Json(error.psnr) : Json(nullptr)},
          {"ssim", error.ssim},
          {"flip", error.flip}};
    if (arguments.by_assets())
      camera[name_of(Mode::asset)] = to_json(result.camera_rays);
    else if (world.has_primaries())
      camera[name_of(Mode::primary)] = to_json(result.camera_rays);
    json["cameras"][result.name] = std::move(camera);
  }
  return json;
}

/// Checks whether assets can answer all rays of this scene, before any mesh is read.
void check_by_assets(const render::SceneDescription& scene) {
  for (size_t i = 0; i < scene.objects.size(); ++i) {
    const render::ObjectDescription& object = scene.objects[i];
    if (!object.nif)
      throw Error(Status::usage,
                  fmt::format("--primary asset: object {} of {}, {}, has no asset; name one with 'nif'",
                              i + 1, scene.file, object.mesh));
    if (object.primary)
      throw Error(Status::usage,
                  fmt::format("--primary asset: 'primary' of object {} of {} cannot be used with it: its "
                              "fields for primary rays make a picture of their own",
                              i + 1, scene.file));
  }
}

/// For all objects of a glTF that have no moment of their own.
void set_moment(const Arguments& arguments, render::SceneDescription& scene) {
  for (render::ObjectDescription& object : scene.objects)
    if (!object.moment && render::is_gltf(object.mesh)) object.moment = {*arguments.clip, arguments.time};
}

void run(const Arguments& arguments) {
  const std::atomic<bool>& cancel = interruption();
  limit_threads(arguments.threads);
  render::SceneDescription scene = render::read_scene(arguments.scene);
  override_picture(arguments, scene.picture);
  if (arguments.clip) set_moment(arguments, scene);
  if (arguments.by_assets()) check_by_assets(scene);
  check_folder(arguments.folder);
  if (arguments.sheet) check_output(*arguments.sheet);
  Progress progress(arguments.quiet);
  std::vector<std::string> notes;
  mesh::AlphaOptions alpha;
  alpha.read = !arguments.ignore_alpha;
  render::ObjectMeshes meshes = render::read_meshes(scene, alpha, notes, progress);
  keep_cameras(arguments, scene);
  progress.finish();
  print_notes(notes, arguments.quiet);
  const int threads = tbb::this_task_arena::max_concurrency();
  const render::Lighting lighting(scene);
  const render::World world(scene, std::move(meshes),
                            fmt::format("{},queries={}", arguments.configuration(), threads), progress);
  if (arguments.by_assets() && world.assets().no_first_hits())
    throw Error(Status::usage, "--primary asset: " + *world.assets().no_first_hits());
  const double exposure = render::find_exposure(scene, world, lighting);

  make_folder(arguments.folder);
  progress.begin();
  std::vector<CameraResult> results;
  for (size_t i = 0; i < scene.cameras.size(); ++i) {
    using Clock = std::chrono::steady_clock;
    const auto start = Clock::now();
    auto written = start;
    const render::CameraDescription& about = scene.cameras[i];
    const render::PictureDescription& picture = scene.picture;
    const render::Camera camera =
        render::place_camera(about, world.box(), scene.up, picture.width, picture.height);
    const auto show = [&](double fraction, const std::function<render::Rendering()>& so_far) {
      progress.update((double(i) + fraction) / double(scene.cameras.size()), "rendering " + about.name);
      // Long pictures can be viewed while they are rendered.
      constexpr auto kBetweenPictures = std::chrono::seconds(5);
      if (so_far && fraction < 1 && Clock::now() - written >= kBetweenPictures) {
        write_pictures(arguments, about.name, so_far(), false);
        written = Clock::now();
      }
    };
    const render::Rendering rendering = render::render(
        world, lighting, camera,
        {picture, exposure, exact_named(arguments.exact), arguments.confidence, arguments.by_assets()}, show,
        cancel);
    CameraResult result = write_pictures(arguments, about.name, rendering, true);
    result.seconds = std::chrono::duration<double>(Clock::now() - start).count();
    results.push_back(std::move(result));
  }
  progress.finish();
  if (arguments.sheet) {
    std::vector<const Image*> thumbnails;
    for (const CameraResult& result : results) thumbnails.push_back(&result.thumbnail);
    render::write_png(*arguments.sheet, render::contact_sheet(thumbnails, world.has_assets() ? 2 : 4));
  }
  if (arguments.json)
    write_json(to_json(results, arguments, world, scene.picture, exposure));
  else if (!arguments.quiet)
    print_table(results, world, exposure, arguments.by_assets());
}

}  // namespace

void add_render(Command app) {
  const Command command =
      app.add_subcommand("render", "Render a scene with Embree and with assets, and compare the pictures");
  auto arguments = std::make_shared<Arguments>();
  Arguments& a = *arguments;
  command
      .add_option("SCENE", a.scene,
                  "A scene in TOML (docs/rendering.md), or a .gltf or .glb with its lights and cameras, also "
                  "as .gz or .zst")
      .required();
  command.add_option("-o,--output", a.folder, "Folder for the pictures; created if missing").required();
  command.add_option("--camera", a.cameras, "Render only the cameras with these names");
  command.add_option("--samples", a.samples, "Rays per pixel, instead of the scene's")
      .range(1u, render::kMaxPictureSamples);
  command.add_option("--width", a.width, "Pixels, instead of the scene's").range(1u, render::kMaxPictureSide);
  command.add_option("--height", a.height, "Pixels, instead of the scene's")
      .range(1u, render::kMaxPictureSide);
  command.add_option("--bounces", a.bounces, "Diffuse bounces, instead of the scene's")
      .range(0u, render::kMaxBounces);
  command.add_option("--seed", a.seed, "Seed of all random numbers, instead of the scene's");
  command
      .add_option("--primary", a.primary,
                  "What answers camera rays: embree; or asset, which makes one picture with Embree and one "
                  "with all rays answered by assets, those of the camera, of shadows, mirrors and bounces")
      .capture_default_str()
      .one_of({"embree", "asset"});
  command
      .add_option("--confidence", a.confidence,
                  "For hybrid pictures: Embree answers if an asset is less sure than this")
      .capture_default_str()
      .range(0.5, 1.0);
  command
      .add_option("--exact", a.exact,
                  "Rays that Embree answers in all pictures: none, or those that start inside or outside an "
                  "asset's box. Shows only the error of the other rays")
      .capture_default_str()
      .one_of({"none", "inside", "outside"});
  add_runtime_options(command, a);
  command.add_flag(
      "--ignore-alpha", a.ignore_alpha,
      "Objects without an asset are solid, whatever their materials say; without it, light passes their "
      "holes, as after nif bake");
  command.add_flag("--exr", a.exr, "Also write linear pictures as OpenEXR");
  command.add_option(
      "--sheet", a.sheet,
      "Also write a PNG with small pictures of all cameras: reference, assets (probability) "
      "and error x 3; with primary or asset in the middle if fields for primary rays or assets "
      "answer the camera's rays");
  command.add_option("--thumbnail", a.thumbnail, "Width of each picture in --sheet, in pixels")
      .capture_default_str()
      .range(16u, 4096u);
  command.add_option("--clip", a.clip,
                     "Every glTF as this animation has it: its name, or its number from 0 on. A scene in "
                     "TOML names clips of "
                     "its objects itself");
  command.add_option("--time", a.time, "The moment of --clip, in seconds").default_str("0");
  add_run_options(command, a, kSchema);
  command.footer(
      "Examples:\n"
      "  nif render scene.toml -o pictures --samples 64\n"
      "  nif render scene.toml -o pictures --primary asset\n"
      "  nif render model.glb -o pictures\n"
      "  nif render knight.glb -o pictures --clip Walking_A --time 0.4");
  command.callback([arguments, command] {
    if (command.given("--time") && !arguments->clip)
      throw Error(Status::usage, "--time is a moment of --clip, which is missing; nif mesh info lists clips");
    for (const char* other : {"--confidence", "--exact"})
      if (arguments->by_assets() && command.given(other))
        throw Error(Status::usage,
                    fmt::format("--primary asset and {0} cannot be used together: {0} is for pictures whose "
                                "camera rays Embree answers",
                                other));
    run(*arguments);
  });
}

}  // namespace nif::tools
