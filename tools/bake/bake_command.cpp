// `nif bake`: a mesh file in, a .nif asset out.
#include "bake/bake.hpp"
#include "bake/colors.hpp"

#include <fmt/format.h>
#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <set>
#include <span>

#include "bake/alpha_metadata.hpp"
#include "bake/checkpoint.hpp"
#include "bake/merge_metadata.hpp"
#include "bake/report.hpp"
#include "formats/base/output_file.hpp"
#include "formats/base/quantities.hpp"
#include "formats/base/status.hpp"
#include "formats/mesh/file_bytes.hpp"
#include "formats/mesh/read.hpp"
#include "formats/nif/crc32c.hpp"
#include "formats/nif/writer.hpp"
#include "mesh/merge/merge.hpp"
#include "tools/bake/bake_page.hpp"
#include "tools/bake/checkpoint_file.hpp"
#include "tools/bake/merge_report.hpp"
#include "tools/batch/batch_command.hpp"
#include "tools/batch/batch_report.hpp"
#include "tools/common/accuracy_table.hpp"
#include "tools/common/asset_bytes.hpp"
#include "tools/common/bake_options.hpp"
#include "tools/common/hit_report.hpp"
#include "tools/common/interruption.hpp"
#include "tools/common/json_output.hpp"
#include "tools/common/naming.hpp"
#include "tools/common/notes.hpp"
#include "tools/common/options.hpp"
#include "tools/common/progress.hpp"
#include "tools/common/shared_options.hpp"
#include "tools/common/threads.hpp"
#include "tools/render/scene_file.hpp"
#include "tools/render/scene_meshes.hpp"
#include "tools/render/view_rays.hpp"
#include "tools/subcommands.hpp"

namespace nif::tools {
namespace {

constexpr const char* kSchema = "nifkit.bake/2";

struct Arguments : RunArguments {
  std::string mesh, output, depfile, format;
  double checkpoint = 30;  ///< seconds between checkpoints; 0: no checkpoints
  bool resume = false, resume_if_possible = false;
  BatchArguments batch;
  BakeArguments bake;
};

/// Peak memory of the process so far, in bytes.
uint64_t peak_memory() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return uint64_t(usage.ru_maxrss) * 1024;
}

nlohmann::ordered_json bake_json(const Arguments& arguments, const mesh::Scene& scene,
                                 const bake::BakeResult& result, const nlohmann::ordered_json& bytes,
                                 double seconds, const std::vector<std::string>& sources,
                                 const std::vector<std::string>& notes) {
  nlohmann::ordered_json objects = nlohmann::ordered_json::array();
  for (const bake::ObjectReport& object : result.objects) objects.push_back(bake::to_json(object));
  nlohmann::ordered_json sets = bake::to_json(result.sets);
  bake::add_calibration(result.sets, false, sets);
  bake::add_hits(result.hits, sets);
  nlohmann::ordered_json json{{"schema", kSchema},
                              {"file", arguments.output},
                              {"triangles", result.triangles},
                              {"instances", result.asset.instances.size()},
                              {"places_nothing", result.asset.places_nothing},
                              {"seconds", seconds},
                              {"peak_memory", peak_memory()},
                              {"bytes", bytes},
                              {"sets", std::move(sets)},
                              {"sources", sources},
                              {"notes", notes},
                              {"objects", std::move(objects)}};
  if (scene.merging) json["merge"] = to_json(*scene.merging);
  if (nlohmann::ordered_json alpha = bake::alpha_metadata(scene); !alpha.is_null())
    json["alpha"] = std::move(alpha);
  return json;
}

/// The report on the decision threshold (--max-leak, --max-spurious) of an object, or null if it has none.
const bake::ErrorLimitReport* error_limit_of(const bake::ObjectReport& object) {
  const auto* field = std::get_if<bake::SegmentBaking::Report>(&object.own);
  return field && field->error_limit ? &*field->error_limit : nullptr;
}

void print_summary(const Arguments& arguments, const mesh::Scene& scene, const bake::BakeResult& result,
                   const nlohmann::ordered_json& bytes, double seconds) {
  fmt::print("{}: {} in {}, {}; baked in {:.1f} s, peak memory {}\n", arguments.output,
             count_of(result.triangles, "triangle"), count_of(result.objects.size(), "object"),
             result.asset.places_nothing ? "which it does not place"
                                         : count_of(result.asset.instances.size(), "instance"),
             seconds, format_bytes(double(peak_memory())));
  if (scene.merging && !scene.merging->merged.empty())
    fmt::print("{}\n", summary(*scene.merging, arguments.bake.merge));
  const auto shown = [](uint64_t count) { return format_bytes(double(count)); };
  fmt::print("{}\n", bytes_line(bytes, shown));
  if (const uint64_t primary = bytes["primary"].get<uint64_t>())
    fmt::print("including {} for primary rays\n", shown(primary));
  if (const uint64_t source = bytes["source_triangles"].get<uint64_t>())
    fmt::print("including {} for the numbers of source triangles\n", shown(source));
  if (const uint64_t colors = bytes["colors"].get<uint64_t>())
    fmt::print("including {} for colours\n", shown(colors));
  if (const uint64_t bending = bytes["numbers"].get<uint64_t>() + bytes["skin"].get<uint64_t>())
    fmt::print("including {} for vertices that move, with joints and weights\n", shown(bending));
  constexpr size_t kShown = 20;
  for (size_t i = 0; i < std::min(kShown, result.objects.size()); ++i) {
    const bake::ObjectReport& object = result.objects[i];
    fmt::print("'{}' is {}: {}\n", object.name, object.encoding, object.reason);
    if (const bake::ErrorLimitReport* limit = error_limit_of(object)) fmt::print("  {}\n", describe(*limit));
  }
  if (result.objects.size() > kShown)
    fmt::print("and {} more; --json lists all\n", result.objects.size() - kShown);
  if (arguments.bake.rays > 0) fmt::print("\n{}\n{}", accuracy_table(result.sets), hit_lines(result.hits));
}

/// One sentence for each thing that preparation changed or could not do.
std::vector<std::string> notes_of(const mesh::Scene& scene, const bake::BakeOptions& options, bool merge,
                                  const bake::BakeResult& result) {
  std::vector<std::string> notes = mesh::texts_of(scene.notes);
  if (merge && scene.merging->merged.empty()) notes.push_back("--merge: " + summary(*scene.merging, merge));
  notes.insert(notes.end(), result.notes.begin(), result.notes.end());
  if (options.source_triangles &&
      std::ranges::none_of(result.asset.objects, [](const format::Object& object) {
        return object.numbers.contains(format::kSourceTriangles);
      }))
    notes.push_back("--source-triangles: no object became exact, so none stores triangles");
  if (options.colors && !bake::has_colors(scene))
    notes.push_back("--colors: the mesh has no readable colours, so none are stored");
  for (const bake::ObjectReport& object : result.objects) {
    if (object.recoveries)
      notes.push_back(fmt::format(
          "'{}': the loss became non-finite {} time(s); training went back and continued with more care",
          object.name, object.recoveries));
    const bake::ErrorLimitReport* limit = error_limit_of(object);
    if (limit && limit->proven && limit->asked.rate > 0)
      notes.push_back(fmt::format("'{}': --max-{} {} would take more rays to show than are drawn, so it {}",
                                  object.name, name_of(limit->asked.mistake), limit->asked.rate,
                                  describe(*limit)));
  }
  return notes;
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

/// All files that a scene is read from.
std::vector<std::string> files_of(const render::SceneDescription& scene, const render::ObjectMeshes& meshes) {
  std::vector<std::string> files{scene.file};
  for (const auto& mesh : meshes) files.insert(files.end(), mesh->files.begin(), mesh->files.end());
  for (const render::Light& light : scene.lights)
    if (const auto* sky = std::get_if<render::Sky>(&light); sky && sky->map) files.push_back(*sky->map);
  return files;
}

/// The parts that training rays of a view are generated from.
struct View {
  render::SceneDescription scene;
  std::vector<std::string> notes;
  render::ObjectMeshes meshes;
  std::vector<std::string> files;  ///< all files that were read
  render::Lighting lighting;
  render::World world;
  render::ViewRays rays;

  View(render::SceneDescription description, const std::string& mesh, const mesh::Scene& baked,
       Progress& progress)
      : scene(std::move(description)),
        meshes(render::read_meshes(scene, {}, notes, progress)),
        files(files_of(scene, meshes)),
        lighting(scene),
        world(scene, std::move(meshes), "", progress),
        rays(scene, world, lighting, mesh, baked) {}
};

render::SceneDescription read_view(const SphericalArguments& arguments) {
  render::SceneDescription scene = render::read_scene(*arguments.view);
  scene.picture.samples = arguments.view_samples.value_or(scene.picture.samples);
  for (render::ObjectDescription& object : scene.objects) {  // the ground truth is exact
    object.nif.reset();
    object.primary = false;
  }
  return scene;
}

/// Suggests what to do about a limit that a bake cannot meet.
std::string hint_for(bake::TargetNotMet::Limit limit, const std::string& encoding) {
  constexpr auto kBytes = bake::TargetNotMet::Limit::bytes;
  if ((encoding == "bvh" || encoding == "exact") && limit == kBytes) return "; try --encoding segment";
  if (encoding == "spherical")
    return limit == kBytes ? "; try a smaller --outer-resolution and --inner-resolution, or --precision half"
                           : "; try --encoding segment or bvh";
  if (limit == kBytes) return "";
  return encoding == "segment" ? "; try a higher --preset, --resolution or --encoding auto"
                               : "; try a higher --preset or --resolution";
}

/// Runs `bake`, and adds the names of the options concerned to its errors, because the baker does not know
/// them.
template <class Bake>
bake::BakeResult naming_options(const bake::BakeOptions& options, const Bake& bake) {
  try {
    return bake();
  } catch (const bake::TargetNotMet& error) {
    const bool bytes = error.limit() == bake::TargetNotMet::Limit::bytes;
    throw Error(error.status(),
                fmt::format("{} cannot be reached: {}{}", bytes ? "--max-bytes" : "--max-error", error.what(),
                            hint_for(error.limit(), options.encoding)));
  } catch (const Error& error) {
    if (error.status() != Status::needs_repair) throw;
    std::string what = error.what();
    if (what.ends_with('.')) what.pop_back();
    throw Error(
        error.status(),
        fmt::format("--strict refuses meshes that need repair or are not read completely: {}; see nif "
                    "mesh info and nif mesh repair",
                    what));
  }
}

mesh::Scene read_merged(const std::string& file, const mesh::ReadLimits& limits,
                        const BakeArguments& arguments) {
  const std::optional<mesh::MergeOptions> options = resolve_merging(arguments);
  mesh::Scene scene = mesh::read(file, limits);
  if (!options) return scene;
  const bool by_default = !arguments.merge && options->nodes.empty() && options->except.empty();
  if (by_default && scene.instances.size() < 2) return scene;
  scene = naming(file, [&] { return mesh::merge(std::move(scene), *options); });
  if (const std::vector<std::string>& names = scene.merging->unmatched; !names.empty())
    throw Error(Status::usage, fmt::format("{}: no node has a name that matches '{}', which --merge-nodes or "
                                           "--merge-except asks for",
                                           file, names.front()));
  return scene;
}

/// Everything besides the meshes and the options that determines a bake's bytes, as text to compare.
std::string other_inputs(const mesh::Scene& scene, const View* view) {
  std::string text;
  if (scene.merging) text = "merge " + bake::to_json(scene.merging->options).dump();
  if (!view) return text;
  for (const std::string& file : view->files) {
    const mesh::detail::ByteBuffer bytes = mesh::detail::load_file(file, uint64_t{16} << 30);
    text += fmt::format(" {:08x}", format::crc32c(std::as_bytes(std::span(bytes.view()))));
  }
  return text;
}

/// Loads what the bake continues from, and sets up where it saves its progress.
bake::TrainingLog begin_log(const Arguments& arguments, CheckpointFile& file) {
  std::vector<bake::KeptTraining> earlier = file.load(arguments.resume               ? Resume::required
                                                      : arguments.resume_if_possible ? Resume::if_possible
                                                                                     : Resume::never);
  bake::TrainingLog::Save save;
  if (arguments.checkpoint > 0 && !file.path().empty())
    save = [&file](std::span<const bake::KeptTraining> trainings) { file.save(trainings); };
  return {std::move(earlier), arguments.checkpoint, std::move(save)};
}

/// Runs `bake`. If it fails in a way that would happen again, removes the checkpoint, which is then useless.
template <class Bake>
bake::BakeResult removing(const CheckpointFile& checkpoint, const Bake& bake) {
  try {
    return bake();
  } catch (const Error& error) {
    if (error.status() == Status::target_not_met || error.status() == Status::training_failed)
      checkpoint.remove();
    throw;
  }
}

/// `nif bake --manifest`. The manifest sets everything that options of a single asset set otherwise.
void run_manifest(const Arguments& arguments, const Command& command) {
  BatchArguments batch = arguments.batch;
  static_cast<RunArguments&>(batch) = arguments;
  batch.depfile = arguments.depfile;
  const OwnCommand allowed;
  add_batch_options(allowed, batch);
  for (const std::string& name : command.given()) {
    if (allowed.has(name)) continue;
    if (name != "--threads" && name != "--depfile" && name != "--json" && name != "--quiet" &&
        name != "--resume")  // a batch always resumes
      throw Error(Status::usage,
                  fmt::format("--manifest and {} cannot be used together: set it in the manifest{}", name,
                              name == "--only" ? "; --outputs FILE says which of its outputs to bake" : ""));
  }
  run_batch(batch);
}

void run(const Arguments& arguments, const Command& command) {
  if (!arguments.batch.manifest.empty()) return run_manifest(arguments, command);
  if (const char* idle = arguments.batch.first_given())
    throw Error(Status::usage, fmt::format("{} needs --manifest", idle));
  if (arguments.mesh.empty()) throw Error(Status::usage, "give a MESH or --manifest; see --help");
  if (arguments.output.empty()) throw Error(Status::usage, "--output is required; see --help");
  const auto start = std::chrono::steady_clock::now();
  bake::BakeOptions options = resolve_options(arguments.bake);
  refuse_overwriting(arguments.mesh, arguments.output);
  if (arguments.output == "-") {
    throw Error(Status::usage, "-o -: an asset cannot be written to a stream; give a file name");
  }
  check_output(arguments.output);
  std::set<std::filesystem::path> written{std::filesystem::absolute(arguments.output).lexically_normal()};
  for (const std::string& path : {arguments.depfile, arguments.batch.report}) {
    if (path.empty()) continue;
    refuse_overwriting(arguments.mesh, path);
    if (!written.insert(std::filesystem::absolute(path).lexically_normal()).second)
      throw Error(Status::usage, path + ": two outputs cannot be the same file");
    check_output(path);
  }
  limit_threads(arguments.threads);

  Progress progress(arguments.quiet);
  progress.update(0, "reading " + shown_name(arguments.mesh));
  mesh::ReadLimits limits;
  limits.colors = options.colors;
  limits.skins = options.deforms;
  limits.format = arguments.format;
  limits.choice = arguments.bake.choice;
  limits.alpha = resolve_alpha(arguments.bake);
  const mesh::Scene scene = read_merged(arguments.mesh, limits, arguments.bake);
  const auto refuse_overwriting_any = [&](const std::vector<std::string>& files) {
    for (const std::string& file : files)
      for (const std::string& path : {arguments.output, arguments.depfile, arguments.batch.report})
        if (!path.empty()) refuse_overwriting(file, path);
  };
  refuse_overwriting_any(scene.files);
  const std::atomic<bool>& cancel = interruption();
  std::unique_ptr<View> view;
  if (arguments.bake.spherical.view) {
    view = std::make_unique<View>(read_view(arguments.bake.spherical), arguments.mesh, scene, progress);
    progress.finish();
    progress.begin();
    refuse_overwriting_any(view->files);
    print_notes(view->notes, arguments.quiet);
    const render::PictureDescription& picture = view->scene.picture;
    options.spherical.given = bake::GivenRays{
        fmt::format("{}, {} x {} pixels, {} samples each", count_of(view->scene.cameras.size(), "camera"),
                    picture.width, picture.height, picture.samples),
        picture.samples,
        [&](uint64_t round) { return view->rays.draw(round); },
        {}};
    if (arguments.bake.spherical.primary)
      options.spherical.given->draw_primary = [&](uint64_t round) { return view->rays.draw_primary(round); };
  }
  std::vector<std::string> notes;
  CheckpointFile checkpoint(arguments.output, bake::key_of(scene, options, other_inputs(scene, view.get())),
                            [&](const std::string& note) {
                              progress.finish();
                              print_notes({note}, arguments.quiet);
                              notes.push_back(note);
                            });
  bake::TrainingLog log = begin_log(arguments, checkpoint);
  LossCurve losses;
  const bake::BakeResult result = removing(checkpoint, [&] {
    return naming(arguments.mesh, [&] {
      return naming_options(options, [&] {
        return bake::bake(
            scene, options,
            [&](const bake::BakeProgress& p) {
              progress.update(p.fraction, describe(p));
              if (p.loss > 0) losses.add(std::string(p.object), p.loss, p.error);
            },
            cancel, &log);
      });
    });
  });
  const auto [file, in_file] = format::encode_and_view(result.asset);
  if (options.max_bytes && file.size() > *options.max_bytes) {
    checkpoint.remove();
    throw Error(Status::target_not_met,
                fmt::format("--max-bytes {} cannot be reached: the asset needs {} bytes", *options.max_bytes,
                            file.size()));
  }
  const nlohmann::ordered_json bytes = bytes_json(in_file);
  std::vector<std::string> sources = scene.files;
  if (view)
    for (const std::string& path : view->files)
      if (std::ranges::find(sources, path) == sources.end()) sources.push_back(path);
  const std::string rule =
      arguments.depfile.empty() ? std::string() : dependency_rule({arguments.output}, sources);
  if (cancel) throw Error(Status::interrupted, "the bake was cancelled");
  write_output(arguments.output, file);
  checkpoint.remove();
  if (!arguments.depfile.empty()) write_output(arguments.depfile, std::as_bytes(std::span(rule)));
  progress.finish();

  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  const std::vector<std::string> last_notes = notes_of(scene, options, arguments.bake.merge, result);
  print_notes(last_notes, arguments.quiet);
  notes.insert(notes.end(), last_notes.begin(), last_notes.end());
  const nlohmann::ordered_json report = bake_json(arguments, scene, result, bytes, seconds, sources, notes);
  if (!arguments.batch.report.empty()) {
    const std::string page =
        bake_page(report, result.asset.metadata, arguments.mesh, losses.points(), progress);
    write_output(arguments.batch.report, std::as_bytes(std::span(page)));
  }
  if (arguments.json) {
    write_json(report);
  } else if (!arguments.quiet) {
    print_summary(arguments, scene, result, bytes, seconds);
  }
}

}  // namespace

void add_bake(Command app) {
  const Command command = app.add_subcommand("bake", "Bake a mesh into a .nif asset");
  auto a = std::make_shared<Arguments>();
  command.add_option("MESH", a->mesh,
                     "The mesh to bake: OBJ, PLY, STL, OFF, glTF, GLB or DRC, also as .gz or .zst");
  command.add_option("-o,--output", a->output, "The .nif file to write");
  add_format_option(command, a->format);
  add_bake_options(command, a->bake);
  command.add_option("--depfile", a->depfile,
                     "Also write a dependency file for make and ninja, with all files that were read");
  command
      .add_option("--checkpoint", a->checkpoint,
                  "Seconds between checkpoints of a long bake, in a file beside the asset that is removed at "
                  "the end (0 = none)")
      .range(0.0, 1e6)
      .capture_default_str();
  command.add_flag("--resume", a->resume,
                   "Continue a killed bake of the same mesh with the same options from its checkpoint. The "
                   "asset is the same as without the interruption");
  command.add_flag("--resume-if-possible", a->resume_if_possible, "For internal use").group("");
  add_batch_options(command, a->batch);
  add_run_options(command, *a, fmt::format("{}; with --manifest {}", kSchema, kBatchSchema));
  command.footer(
      "Examples:\n"
      "  nif bake dragon.ply.gz -o dragon.nif --max-bytes 200kB\n"
      "  nif bake crate.glb -o crate.nif --encoding exact\n"
      "  nif bake crate.glb -o crate.nif --prefer speed\n"
      "  nif bake statue.ply -o statue.nif --report statue.html\n"
      "  nif bake guard.glb -o guard.nif --max-spurious 0.05%\n"
      "  nif bake scene.glb -o scene.nif --merge-except 'door*'\n"
      "  nif bake scene.glb -o scene.nif --no-merge\n"
      "  nif bake --manifest library.toml --keep-going --report library.html");
  command.callback([a, command] { run(*a, command); });
}

}  // namespace nif::tools
