// The files are written to a folder beside the target, which is renamed at the end. A killed process leaves
// its folder; the next export to the same target removes it. The folder of a living process is locked.
#include "tools/bench/race_export.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/random.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>

#include "bake/ground_truth/scene_truth.hpp"
#include "formats/base/folder.hpp"
#include "formats/base/json_text.hpp"
#include "formats/base/output_file.hpp"
#include "formats/base/quantities.hpp"
#include "formats/base/status.hpp"
#include "formats/mesh/file_bytes.hpp"
#include "tools/bench/bench_report.hpp"
#include "tools/bench/bench_scene.hpp"
#include "tools/bench/race_data.hpp"
#include "tools/common/interruption.hpp"
#include "tools/common/measured_asset.hpp"

namespace nif::tools {
namespace {

namespace fs = std::filesystem;
using RaceJson = nlohmann::ordered_json;

constexpr const char *kRaceFile = "race.json", *kPositionsFile = "positions.f32",
                     *kTrianglesFile = "triangles.u32", *kTransformsFile = "transforms.f32",
                     *kPlacedFile = "placed.u32", *kRaysEnding = ".rays.f32", *kUnfinished = ".tmp-";

bool is_of_an_export(const std::string& name) {
  constexpr std::string_view kEnding(".rays.f32");
  if (name.ends_with(kEnding))
    return bake::ray_set_named(name.substr(0, name.size() - kEnding.size())).has_value();
  return name == kRaceFile || name == kPositionsFile || name == kTrianglesFile || name == kTransformsFile ||
         name == kPlacedFile;
}

[[noreturn]] void no_export(const fs::path& folder, const std::string& why) {
  throw Error(Status::output_not_writable, folder.string() + ": cannot be written: " + why);
}

/// The folder that is really replaced: links are followed, so that they stay links.
fs::path resolved(const std::string& folder) {
  std::error_code error;
  fs::path target = fs::weakly_canonical(fs::absolute(folder, error), error);
  if (error || folder.empty()) no_export(folder, "it is not the name of a folder");
  if (!target.has_filename()) target = target.parent_path();
  return target;
}

/// The name of something in the folder that no export writes; nothing if there is no such thing.
std::optional<std::string> foreign_in(const fs::path& folder) {
  std::optional<std::string> foreign;
  const std::error_code error = for_each_name(folder, [&](const std::string& name) {
    if (!is_of_an_export(name) || !fs::is_regular_file(folder / name)) foreign = name;
  });
  if (error) no_export(folder, error.message());
  return foreign;
}

bool has_race(const fs::path& folder) {
  constexpr uint64_t kMaxBytes = 64 << 20;
  try {
    const mesh::detail::ByteBuffer text = mesh::detail::load_named_file(folder / kRaceFile, kMaxBytes);
    const RaceJson race = parse_untrusted<RaceJson>(text.view());
    return race.is_object() && race.contains("schema") && race["schema"].is_string() &&
           race["schema"].get<std::string>().starts_with("nifkit.race/");
  } catch (const Error&) {
    return false;
  }
}

/// Removes the files of an export, and the folder unless something else is in it.
void remove_export(const fs::path& folder) noexcept try {
  std::error_code ignored;
  for_each_name(folder, [&](const std::string& name) {
    // Without the ending of OutputFile's own temporaries.
    if (is_of_an_export(name.substr(0, name.find(kUnfinished)))) fs::remove(folder / name, ignored);
  });
  fs::remove(folder, ignored);
} catch (const std::bad_alloc&) {
  // The next export to this target removes it.
}

/// A locked folder beside the target, which commit() makes the target.
class ExportFolder {
 public:
  explicit ExportFolder(const std::string& target) : target_(resolved(target)) {
    remove_unfinished();
    uint32_t random = 0;
    if (::getrandom(&random, sizeof(random), 0) != ssize_t(sizeof(random))) random = uint32_t(::getpid());
    const fs::path path =
        target_.parent_path() / fmt::format("{}{}{:08x}", target_.filename().string(), kUnfinished, random);
    std::error_code error;
    if (!fs::create_directory(path, error))
      no_export(target_, error ? error.message() : "its temporary folder exists");
    path_ = path;
    fd_ = ::open(path_.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (fd_ >= 0) ::flock(fd_, LOCK_EX | LOCK_NB);
  }
  ~ExportFolder() {
    if (!path_.empty()) remove_export(path_);
    if (fd_ >= 0) ::close(fd_);
  }
  ExportFolder(const ExportFolder&) = delete;
  ExportFolder& operator=(const ExportFolder&) = delete;

  std::string file(const std::string& name) const { return (path_ / name).string(); }

  void commit() {
    // An empty folder is replaced by rename(). An earlier export changes places with the new one.
    if (::rename(path_.c_str(), target_.c_str()) != 0) {
      if (errno != ENOTEMPTY && errno != EEXIST) no_export(target_, std::strerror(errno));
      if (foreign_in(target_)) no_export(target_, "other files came into it meanwhile");
      if (::renameat2(AT_FDCWD, path_.c_str(), AT_FDCWD, target_.c_str(), RENAME_EXCHANGE) != 0) {
        remove_export(target_);  // a file system that cannot exchange
        if (::rename(path_.c_str(), target_.c_str()) != 0) no_export(target_, std::strerror(errno));
      } else {
        remove_export(path_);
      }
    }
    path_.clear();
  }

 private:
  /// Folders of killed processes: their locks are free.
  void remove_unfinished() const {
    const std::string start = target_.filename().string() + kUnfinished;
    for_each_name(target_.parent_path(), [&](const std::string& name) {
      if (!name.starts_with(start) || name.size() != start.size() + 8) return;
      const fs::path folder = target_.parent_path() / name;
      const int fd = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
      if (fd < 0) return;
      if (::flock(fd, LOCK_EX | LOCK_NB) == 0) remove_export(folder);
      ::close(fd);
    });
  }

  fs::path target_, path_;  ///< path_ is empty after commit()
  int fd_ = -1;
};

/// The files of an export say nothing of holes.
void refuse_holes(const bake::Prepared& object, const std::string& file) {
  if (object.has_holes())
    throw Error(Status::usage,
                fmt::format("{}: '{}' has triangles with holes, which --export cannot tell other programs; "
                            "bake it with --ignore-alpha",
                            file, object.source->name));
}

RaceJson array_json(const std::string& file, const char* type, std::vector<size_t> shape) {
  return {{"file", file}, {"type", type}, {"shape", std::move(shape)}};
}

RaceJson objects_json(const RaceData& race) {
  RaceJson objects = RaceJson::array();
  size_t position = 0, triangle = 0;
  for (const bake::Prepared* object : race.objects) {
    const size_t positions = object->surface.positions.size(), triangles = object->surface.triangles.size();
    objects.push_back({{"name", object->source->name},
                       {"first_position", position},
                       {"positions", positions},
                       {"first_triangle", triangle},
                       {"triangles", triangles}});
    position += positions;
    triangle += triangles;
  }
  return objects;
}

RaceJson set_json(const RaceData& race, size_t set, const std::string& hash) {
  RaceJson scenes = RaceJson::array();
  size_t first = 0;
  for (const RacedScene& scene : race.scenes) {
    const size_t count = (*scene.rays)[set].segments.size();
    scenes.push_back({{"first_ray", first}, {"rays", count}});
    first += count;
  }
  RaceJson json{{"hash", hash}, {"coherent", bake::is_coherent(race.sets[set])}};
  json.update(
      array_json(std::string(bake::name_of(race.sets[set])) + kRaysEnding, "float32", {race.rays(set), 8}));
  json["scenes"] = std::move(scenes);
  return json;
}

RaceJson race_json(const RaceData& race, const std::string& mesh, uint64_t seed) {
  RaceJson scenes = RaceJson::array(), sets = RaceJson::object();
  size_t instance = 0;
  for (const RacedScene& scene : race.scenes) {
    scenes.push_back({{"first_instance", instance}, {"instances", scene.instances.size()}});
    instance += scene.instances.size();
  }
  const std::vector<std::string> hashes = hashes_of(race);
  for (size_t s = 0; s < race.sets.size(); ++s)
    sets[std::string(bake::name_of(race.sets[s]))] = set_json(race, s, hashes[s]);
  return {{"schema", kRaceSchema},
          {"version", NIF_VERSION_STRING},
          {"mesh", mesh},
          {"processor", processor_name()},
          {"seed", seed},
          {"instanced", race.instanced},
          {"positions", array_json(kPositionsFile, "float32", {race.positions(), 3})},
          {"triangles", array_json(kTrianglesFile, "uint32", {race.triangles(), 3})},
          {"transforms", array_json(kTransformsFile, "float32", {race.instances(), 3, 4})},
          {"placed", array_json(kPlacedFile, "uint32", {race.instances()})},
          {"objects", objects_json(race)},
          {"scenes", std::move(scenes)},
          {"sets", std::move(sets)}};
}

using StepOn = std::function<void(double, const std::string&)>;

RaceJson write_race(const RaceData& race, const std::string& mesh, uint64_t seed, const std::string& folder,
                    const StepOn& step) {
  step(0.8, "writing " + folder);
  RaceJson json = race_json(race, mesh, seed);
  ExportFolder files(folder);
  const auto write = [&](const std::string& name, auto&& put) {
    step(0.9, "writing " + name);
    OutputFile file(files.file(name));
    put([&](std::span<const std::byte> bytes) { file.write(bytes); });
    file.commit();
  };
  write(kPositionsFile, [&](const ByteSink& to) { put_positions(race, to); });
  write(kTrianglesFile, [&](const ByteSink& to) { put_triangles(race, to); });
  write(kTransformsFile, [&](const ByteSink& to) { put_transforms(race, to); });
  write(kPlacedFile, [&](const ByteSink& to) { put_placed(race, to); });
  for (size_t s = 0; s < race.sets.size(); ++s)
    write(std::string(bake::name_of(race.sets[s])) + kRaysEnding,
          [&](const ByteSink& to) { put_rays(race, s, to); });
  const std::string text = json.dump(2, ' ', false, RaceJson::error_handler_t::replace) + "\n";
  write(kRaceFile, [&](const ByteSink& to) { to(std::as_bytes(std::span(text))); });
  step(1, "writing " + folder);
  files.commit();
  return json;
}

StepOn steps(Progress& progress) {
  return [&progress, &cancel = interruption()](double fraction, const std::string& text) {
    if (cancel) throw Error(Status::interrupted, "the export was cancelled");
    progress.update(fraction, text);
  };
}

}  // namespace

void check_export(const std::string& folder) {
  const fs::path target = resolved(folder);
  std::error_code error;
  const fs::path parent = target.parent_path();
  if (!fs::exists(parent, error))
    throw Error(Status::output_folder_missing,
                fmt::format("{}: the folder {} does not exist", folder, parent.string()));
  if (!fs::is_directory(parent, error)) no_export(folder, parent.string() + " is not a folder");
  if (::access(parent.c_str(), W_OK) != 0) no_export(folder, std::strerror(errno));
  if (!fs::exists(target, error)) return;
  if (!fs::is_directory(target, error)) no_export(folder, "it is a file");
  const bool empty = fs::is_empty(target, error);
  if (error) no_export(folder, error.message());
  if (empty) return;
  const std::optional<std::string> foreign = foreign_in(target);
  if (foreign || !has_race(target))
    throw Error(
        Status::usage,
        fmt::format("--export {}: the folder is neither empty nor an earlier export{}; choose another",
                    folder, foreign ? " and nothing else: it has " + *foreign : ""));
}

nlohmann::ordered_json export_race(const BenchOptions& options, const std::string& folder,
                                   Progress& progress) {
  check_export(folder);
  const MeasuredAsset asset(options.asset, options.mesh, options.configuration, progress);
  for (const bake::Prepared& object : asset.objects()) refuse_holes(object, options.asset);
  const StepOn step = steps(progress);
  const size_t count = asset.objects().size();
  std::vector<std::vector<bake::RaysWithTruth>> rays(count);
  std::vector<const bake::Prepared*> objects;
  std::vector<const std::vector<bake::RaysWithTruth>*> by_object;
  for (size_t i = 0; i < count; ++i) {
    objects.push_back(&asset.objects()[i]);
    const bake::GroundTruth truth(asset.objects()[i]);
    for (const bake::RaySet set : options.sets) {
      step(0.8 * double(i) / double(count),
           fmt::format("drawing {} of {}", bake::name_of(set), asset.name(i)));
      rays[i].push_back(
          bake::draw_ray_set(truth.source(), set, rays_of_each(options.rays, count), options.seed));
    }
    by_object.push_back(&rays[i]);
  }
  return write_race(race_of_objects(std::move(objects), options.sets, by_object), options.mesh, options.seed,
                    folder, step);
}

nlohmann::ordered_json export_race(const SceneBenchOptions& options, const std::string& folder,
                                   Progress& progress) {
  check_export(folder);
  const BenchScene scene(options.scene, options.asset, options.configuration, progress);
  for (const bake::Prepared* object : scene.objects()) refuse_holes(*object, options.scene);
  const StepOn step = steps(progress);
  const bake::SceneTruth truth(scene.objects(), scene.instances());
  std::vector<bake::RaysWithTruth> rays;
  for (const bake::RaySet set : options.sets) {
    step(0.8 * double(rays.size()) / double(options.sets.size()),
         fmt::format("drawing {}", bake::name_of(set)));
    rays.push_back(bake::draw_ray_set(truth.source(), set, options.rays, options.seed));
  }
  return write_race(race_of_scene(scene.objects(), scene.instances(), options.sets, rays), options.scene,
                    options.seed, folder, step);
}

std::string export_summary(const nlohmann::ordered_json& race, const std::string& folder) {
  std::string text = fmt::format("{}: {}, {}, {}", folder,
                                 count_of(race["triangles"]["shape"][0].get<uint64_t>(), "triangle"),
                                 count_of(race["objects"].size(), "object"),
                                 count_of(race["placed"]["shape"][0].get<uint64_t>(), "instance"));
  for (const auto& [name, set] : race["sets"].items())
    text += fmt::format("\n  {:<14}{}", name, count_of(set["shape"][0].get<uint64_t>(), "ray"));
  return text + "\n";
}

}  // namespace nif::tools
