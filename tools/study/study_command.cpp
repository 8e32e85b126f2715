// `nif study`: compares every way to answer visibility on one mesh, over a range of sizes.
#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>

#include "bake/report.hpp"
#include "formats/base/output_file.hpp"
#include "formats/base/quantities.hpp"
#include "formats/base/status.hpp"
#include "formats/mesh/far_from_origin.hpp"
#include "formats/mesh/file_bytes.hpp"
#include "formats/mesh/flat_scene.hpp"
#include "formats/mesh/read.hpp"
#include "tools/bench/bench_report.hpp"
#include "tools/common/interruption.hpp"
#include "tools/common/json_output.hpp"
#include "tools/common/naming.hpp"
#include "tools/common/notes.hpp"
#include "tools/common/shared_options.hpp"
#include "tools/common/stopwatch.hpp"
#include "tools/common/threads.hpp"
#include "tools/study/study_page.hpp"
#include "tools/study/view.hpp"
#include "tools/subcommands.hpp"

namespace nif::tools {
namespace {

namespace fs = std::filesystem;

constexpr uint64_t kRays = 300'000, kQuickRays = 100'000;
constexpr uint32_t kPictureWidth = 320, kPictureHeight = 240;

struct Arguments : RunArguments {
  std::string mesh, folder;
  uint64_t seed = 1, rays = 0;  ///< 0: the default of the kind of study
  bool quick = false;
};

std::span<const std::byte> bytes_of(const std::string& text) { return std::as_bytes(std::span(text)); }

/// Reads the file as one mesh, with all instances in their places. Counts in the study what the file has.
mesh::Scene read_one_mesh(const std::string& path, Study& study) {
  mesh::Scene scene = mesh::read(path);
  study.meshes = scene.meshes.size();
  study.instances = scene.instances.size();
  if (scene.meshes.size() == 1 && scene.instances.size() == 1) {
    scene.instances.front().transform = mesh::kIdentity;
    scene.instances.front().remainder = {};
    return scene;
  }
  mesh::move_instances(scene, mesh::far_offset(scene) * -1);
  mesh::Scene one;
  one.source_hash = scene.source_hash;
  one.meshes.push_back(mesh::flatten(scene, fs::path(path).stem().string()));
  one.instances.push_back({.name = one.meshes.front().name});
  return one;
}

std::vector<RivalPlan> plan_all(const StudiedMesh& mesh, const StudyScale& scale) {
  std::vector<RivalPlan> plans = asset_rivals(mesh, scale);
  for (auto* family : {mesh_rivals, volume_rivals})
    std::ranges::move(family(mesh, scale), std::back_inserter(plans));
  return plans;
}

/// Whether the error says that something cannot be made of a mesh: that is a result, and no reason to stop.
bool is_about_mesh(Status status) {
  switch (status) {
    case Status::all_degenerate:
    case Status::too_large:
    case Status::needs_repair:
    case Status::target_not_met:
    case Status::training_failed:
      return true;
    default:
      return false;
  }
}

/// Lower-case letters, digits and dashes. If plans come and go between versions, the names of the others
/// stay.
std::string file_name_of(const std::string& words) {
  std::string name;
  for (const char c : words) {
    if (std::isalnum(static_cast<unsigned char>(c)))
      name += char(std::tolower(static_cast<unsigned char>(c)));
    else if (!name.empty() && name.back() != '-')
      name += '-';
  }
  return name;
}

class Studying {
 public:
  Studying(const Arguments& arguments, Progress& progress)
      : folder_(arguments.folder),
        progress_(progress),
        scale_{arguments.quick, arguments.seed},
        mesh_(read(arguments, progress, study_)),
        plans_(plan_all(mesh_, scale_)) {
    study_.key = {fs::path(arguments.mesh).filename().string(),
                  bake::source_hash_text(mesh_.scene.source_hash),
                  mesh_.prepared.surface.triangles.size(),
                  NIF_VERSION_STRING,
                  processor_name(),
                  arguments.quick,
                  arguments.seed,
                  arguments.rays    ? arguments.rays
                  : arguments.quick ? kQuickRays
                                    : kRays};
  }

  /// Loads the results of an earlier run of the same study.
  void resume() {
    const std::string path = in_folder("study.json");
    if (!fs::exists(path)) return;
    kept_ = read_study(path, text_of(path), study_.key);
  }

  void run() {
    const size_t left = size_t(std::ranges::count_if(plans_, [&](const auto& plan) { return !kept(plan); }));
    std::optional<Meter> meter;
    const StudyView view(mesh_, kPictureWidth, kPictureHeight);
    render::write_png(in_folder(kReferencePicture), view.reference());
    size_t made = 0;
    for (size_t i = 0; i < plans_.size(); ++i) {
      const RivalPlan& plan = plans_[i];
      if (const RivalPoint* point = kept(plan)) {
        study_.points.push_back(*point);
        continue;
      }
      if (!study_.points.empty() && double(study_.points.back().resident_bytes) >= plan.while_below) continue;
      const RivalProgress told = [&, name = fmt::format("{} of {}: {}, {}", i + 1, plans_.size(), plan.family,
                                                        plan.size)](double share, const std::string& what) {
        if (interruption())
          throw Error(Status::interrupted, "the study was cancelled; run it again to continue");
        progress_.update((double(made) + share) / double(left), name + ": " + what);
      };
      if (!meter) meter.emplace(mesh_, study_.key.rays, study_.key.seed, told);
      study_.points.push_back(measure(plan, *meter, view, told));
      ++made;
      save();
    }
    save();
  }

  const Study& study() const { return study_; }
  size_t kept_count() const { return kept_.points.size(); }

  void write_page() const {
    const std::string page =
        study_page(study_, [&](const std::string& name) { return text_of(in_folder(name)); });
    write_output(in_folder("study.html"), bytes_of(page));
  }

 private:
  static StudiedMesh read(const Arguments& arguments, Progress& progress, Study& study) {
    progress.update(0, "reading " + arguments.mesh);
    return naming(arguments.mesh, [&] { return StudiedMesh(read_one_mesh(arguments.mesh, study)); });
  }

  std::string in_folder(const std::string& name) const { return (fs::path(folder_) / name).string(); }
  static std::string text_of(const std::string& path) {
    constexpr uint64_t kMost = 64 << 20;
    return std::string(mesh::detail::load_file(path, kMost).view());
  }

  /// Returns the kept point if it was measured before and its pictures still exist.
  const RivalPoint* kept(const RivalPlan& plan) const {
    const RivalPoint* point = kept_.find(plan.family, plan.size);
    const bool whole = point && (!point->measured() || (fs::exists(in_folder(point->picture)) &&
                                                        fs::exists(in_folder(point->errors))));
    return whole ? point : nullptr;
  }

  RivalPoint measure(const RivalPlan& plan, const Meter& meter, const StudyView& view,
                     const RivalProgress& told) const {
    RivalPoint point;
    point.family = plan.family, point.size = plan.size;
    std::unique_ptr<Rival> rival;
    try {
      point.seconds = seconds_of([&] { rival = plan.make(told); });
    } catch (const Error& error) {
      if (!is_about_mesh(error.status())) throw;
      point.left_out = error.what();
      return point;
    }
    point.resident_bytes = rival->resident_bytes();
    point.file_bytes = rival->file_bytes();
    point.sets = meter.measure(*rival, told);
    told(1, "asking for a picture");
    const StudyView::Seen seen = view.ask(*rival);
    point.view_wrong = seen.wrong;
    const std::string name = file_name_of(plan.family + ' ' + plan.size);
    point.picture = "picture-" + name + ".png";
    point.errors = "errors-" + name + ".png";
    render::write_png(in_folder(point.picture), seen.picture);
    render::write_png(in_folder(point.errors), seen.errors);
    return point;
  }

  /// Saves the results so far, in case the rest is cancelled.
  void save() const { write_output(in_folder("study.json"), bytes_of(to_json(study_).dump(2) + "\n")); }

  std::string folder_;
  Progress& progress_;
  StudyScale scale_;
  Study study_, kept_;
  StudiedMesh mesh_;
  std::vector<RivalPlan> plans_;
};

void print(const Study& study, const std::string& page) {
  std::string head = fmt::format("{:<36}", "wrong answers, mean of all ray sets");
  for (const double bytes : kBudgets) head += fmt::format("{:>12}", format_bytes(bytes));
  fmt::print("{}\n", head);
  for (const std::string& family : families_of(study)) {
    std::string line = fmt::format("{:<36}", family);
    bool any = false;
    for (const double bytes : kBudgets) {
      const std::optional<AtBytes> at = at_bytes(study, family, bytes);
      any = any || at;
      line += fmt::format("{:>12}", at ? fmt::format("{:.3g} %", 100 * at->error) : "-");
    }
    if (any) fmt::print("{}\n", line);
  }
  fmt::print("Curves, pictures and all figures: {}\n", page);
}

void run(const Arguments& arguments) {
  if (arguments.rays > 100'000'000)
    throw Error(Status::usage, "--rays: at most 100000000 rays of each set fit into memory");
  std::error_code failed;
  fs::create_directories(arguments.folder, failed);
  const std::string page = (fs::path(arguments.folder) / "study.html").string();
  check_output(page);
  limit_threads(arguments.threads);
  Progress progress(arguments.quiet);
  Studying studying(arguments, progress);
  if (const std::string note = flattened_note(studying.study()); !note.empty())
    print_notes({fmt::format("{}: {}", arguments.mesh, note)}, arguments.quiet);
  studying.resume();
  studying.run();
  studying.write_page();
  progress.finish();
  if (arguments.json)
    write_json(to_json(studying.study()));
  else if (!arguments.quiet)
    print(studying.study(), page);
}

}  // namespace

void add_study(Command app) {
  const Command command = app.add_subcommand(
      "study", "Compare all ways to answer visibility for one mesh, over a range of sizes");
  auto a = std::make_shared<Arguments>();
  command
      .add_option("MESH", a->mesh,
                  "A mesh file, as for nif bake. A scene of instances is studied as one mesh")
      .required();
  command
      .add_option("-o,--output", a->folder,
                  "Folder for study.html, study.json and the pictures; created if missing. A cancelled study "
                  "continues from there")
      .required();
  command.add_flag("--quick", a->quick, "Two sizes of each, preset fast, and little training of spherical");
  command.add_option("--rays", a->rays, "Rays per ray set to measure with")
      .default_str("300000, with --quick 100000")
      .positive();
  add_seed_option(command, a->seed);
  add_run_options(command, *a, kStudySchema);
  command.footer(
      "Compares segment, exact, bvh, proof with Embree behind it, and spherical; Embree on the whole mesh;\n"
      "meshes simplified by OpenMesh and meshoptimizer, with Embree and as exact; and distance fields and\n"
      "voxels of OpenVDB. docs/study.md explains how. Of a scene, all instances become one mesh in their "
      "places;\n"
      "nif bench SCENE compares a scene with its instances.\n"
      "Examples:\n"
      "  nif study statue.ply -o statue-study --quick\n"
      "  nif study dragon.ply.gz -o dragon-study");
  command.callback([a] { run(*a); });
}

}  // namespace nif::tools
