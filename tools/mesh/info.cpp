// `nif mesh info`: reports facts about a mesh, and what is wrong with it.
#include <fmt/format.h>

#include <limits>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "formats/base/memory.hpp"
#include "formats/base/quantities.hpp"
#include "formats/mesh/clean.hpp"
#include "mesh/cgal/cgal.hpp"
#include "mesh/inspect/inspect.hpp"
#include "tools/common/interruption.hpp"
#include "tools/common/json_output.hpp"
#include "tools/common/naming.hpp"
#include "tools/common/notes.hpp"
#include "tools/common/options.hpp"
#include "tools/common/progress.hpp"
#include "tools/common/shared_options.hpp"
#include "tools/common/threads.hpp"
#include "tools/mesh/mesh_report.hpp"
#include "tools/mesh/verb_input.hpp"
#include "tools/mesh/verbs.hpp"

namespace nif::tools {
namespace {

using Json = nlohmann::ordered_json;

/// Self-intersections are searched by default in meshes of up to this many triangles, with up to this many
/// pairs of triangles whose boxes overlap. Most meshes have some ten pairs per triangle. The search then
/// takes a few seconds.
constexpr uint64_t kQuick = 1'000'000, kQuickPairs = 64'000'000;
/// Meshes that the text lists.
constexpr size_t kShown = 20;

constexpr const char* kSchema = "nifkit.mesh-info/1";

struct Arguments : RunArguments {
  std::string input, format, self_intersections = "auto";
  bool by_index = false;
};

/// For one mesh or for all of them.
struct InspectedMesh {
  inspect::Inspection mesh;
  std::optional<cgal::SelfIntersections> intersections;  ///< if they were searched
};

struct Results {
  std::vector<InspectedMesh> meshes;
  InspectedMesh all;
  std::string why_not;  ///< why self-intersections were not searched
};

/// Why self-intersections should not be searched; empty if they should.
std::string why_not(const Arguments& arguments, uint64_t triangles) {
  const std::string& wanted = arguments.self_intersections;
  if (wanted == "on") cgal::require("--self-intersections on");
  if (wanted == "on") return "";
  if (wanted == "off") return "--self-intersections off";
  if (!cgal::available()) return "this build lacks CGAL";
  if (triangles > kQuick) return fmt::format("more than {} triangles; use --self-intersections on", kQuick);
  return "";
}

Results look_at(const Arguments& arguments, const mesh::Scene& scene, Progress& progress) {
  Results results;
  results.why_not = why_not(arguments, triangles_of(scene));
  bool intersections = results.why_not.empty();
  if (intersections) results.all.intersections.emplace();
  const uint64_t most_pairs =
      arguments.self_intersections == "on" ? std::numeric_limits<uint64_t>::max() : kQuickPairs;
  for (size_t m = 0; m < scene.meshes.size(); ++m) {
    const mesh::Mesh& mesh = scene.meshes[m];
    const double fraction = double(m) / double(scene.meshes.size());
    require_memory(mesh.triangles.size() * (intersections ? 300 : 150),
                   arguments.input + ": inspecting its triangles");
    progress.update(fraction, "counting edges of '" + mesh.name + "'");
    InspectedMesh& found =
        results.meshes.emplace_back(InspectedMesh{inspect::inspect(mesh, !arguments.by_index), {}});
    results.all.mesh += found.mesh;
    if (!intersections) continue;
    progress.update(fraction, "looking for self-intersections of '" + mesh.name + "'");
    found.intersections =
        cgal::find_self_intersections(mesh::clean_or_nothing(mesh), interruption(), most_pairs);
    if (!found.intersections) {
      results.why_not =
          fmt::format("triangles of '{}' may meet in more than {} pairs; use --self-intersections on",
                      mesh.name, most_pairs);
      results.all.intersections.reset();
      intersections = false;
      continue;
    }
    results.all.intersections->pairs += found.intersections->pairs;
    results.all.intersections->triangles += found.intersections->triangles;
  }
  return results;
}

Json json_of(const InspectedMesh& found) {
  Json json = to_json(found.mesh);
  json["self_intersections"] = found.intersections ? Json{{"pairs", found.intersections->pairs},
                                                          {"triangles", found.intersections->triangles}}
                                                   : Json(nullptr);
  return json;
}

void print_json(const Arguments& arguments, const mesh::Scene& scene, const Results& results) {
  Json json{{"schema", kSchema},
            {"file", arguments.input},
            {"instances", scene.instances.size()},
            {"cameras", scene.cameras.size()},
            {"lights", scene.lights.size()},
            {"clips", Json::array()}};
  for (const mesh::Clip& clip : scene.clips)
    json["clips"].push_back(
        {{"name", clip.name}, {"begin", clip.begin}, {"end", clip.end}, {"channels", clip.channels}});
  json.update(json_of(results.all));
  json["meshes"] = Json::array();
  for (size_t m = 0; m < scene.meshes.size(); ++m) {
    Json mesh{{"name", scene.meshes[m].name}};
    mesh.update(json_of(results.meshes[m]));
    json["meshes"].push_back(std::move(mesh));
  }
  json["notes"] = mesh::texts_of(scene.notes);
  write_json(json);
}

std::string intersections_of(const Results& results) {
  if (!results.all.intersections) return "not checked: " + results.why_not;
  const auto [pairs, triangles] = *results.all.intersections;
  if (pairs == 0) return "none";
  return fmt::format("{} of triangles, {} in total", count_of(pairs, "pair"),
                     count_of(triangles, "triangle"));
}

void print(const Arguments& arguments, const mesh::Scene& scene, const Results& results) {
  const size_t count = scene.meshes.size();
  fmt::print("{}: {}, {}\n", shown_name(arguments.input),
             count == 1 ? "1 mesh" : fmt::format("{} meshes", count),
             count_of(scene.instances.size(), "instance"));
  fmt::print("{}{:<13}{}\n", to_text(results.all.mesh), "crossing", intersections_of(results));
  if (!scene.clips.empty()) fmt::print("\n");
  for (const mesh::Clip& clip : scene.clips)
    fmt::print("clip         '{}': {:.5g} to {:.5g} s, {}\n", clip.name, clip.begin, clip.end,
               count_of(clip.channels, "channel"));
  if (count == 1) return;
  fmt::print("\n");
  for (size_t m = 0; m < std::min(kShown, count); ++m)
    fmt::print("mesh         '{}': {}, {}\n", scene.meshes[m].name,
               count_of(scene.meshes[m].triangles.size(), "triangle"), summary_of(results.meshes[m].mesh));
  if (count > kShown) fmt::print("             and {} more; --json lists all\n", count - kShown);
}

void run(const Arguments& arguments) {
  limit_threads(arguments.threads);
  if (arguments.self_intersections == "on") cgal::require("--self-intersections on");
  Progress progress(arguments.quiet);
  const EndAtOnce nothing_is_written;
  const mesh::Scene scene = read_mesh(arguments.input, progress,
                                      {.drop_non_finite = true, .format = arguments.format, .clips = true});
  const Results results = look_at(arguments, scene, progress);
  progress.finish();
  print_notes(mesh::texts_of(scene.notes), arguments.quiet);
  arguments.json ? print_json(arguments, scene, results) : print(arguments, scene, results);
}

}  // namespace

void add_mesh_info(Command mesh) {
  const Command command = mesh.add_subcommand("info", "Print facts about a mesh, and what is wrong with it");
  auto arguments = std::make_shared<Arguments>();
  Arguments& a = *arguments;
  command.add_option("MESH", a.input, "A mesh in any format that nif bake reads").required();
  command
      .add_option("--self-intersections", a.self_intersections,
                  fmt::format("Look for triangles that cross each other: on, off or auto. auto looks if nif "
                              "was built with CGAL, there are at most {} triangles, and they do not lie on "
                              "top of each other",
                              kQuick))
      .one_of({"auto", "on", "off"})
      .capture_default_str();
  command.add_flag("--by-index", a.by_index,
                   "Use the vertices as they are shared in the file. By default, vertices at the same "
                   "position count as one");
  add_format_option(command, a.format);
  add_run_options(command, a, kSchema);
  command.footer(
      "Each mesh of a file is inspected in its own space, and the results are added up. The clips of a glTF, "
      "its\n"
      "animations, are listed for nif mesh convert --clip.\n"
      "Examples:\n"
      "  nif mesh info scan.ply\n"
      "  nif mesh info scan.ply --self-intersections on --json");
  command.callback([arguments] { run(*arguments); });
}

}  // namespace nif::tools
