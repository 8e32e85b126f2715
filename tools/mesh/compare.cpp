// `nif mesh compare`: measures how much two meshes differ, in distance and in the rays that they block. Rays pass holes,
// as in a bake; distances are between the triangles as a whole, because a hole has no border in space.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <memory>
#include <nlohmann/json.hpp>

#include "bake/ground_truth/prepare.hpp"
#include "formats/base/memory.hpp"
#include "formats/base/quantities.hpp"
#include "formats/base/status.hpp"
#include "formats/mesh/far_from_origin.hpp"
#include "formats/mesh/flat_scene.hpp"
#include "mesh/compare/compare.hpp"
#include "tools/common/interruption.hpp"
#include "tools/common/json_output.hpp"
#include "tools/common/naming.hpp"
#include "tools/common/notes.hpp"
#include "tools/common/options.hpp"
#include "tools/common/progress.hpp"
#include "tools/common/ray_set_option.hpp"
#include "tools/common/shared_options.hpp"
#include "tools/common/threads.hpp"
#include "tools/mesh/verb_input.hpp"
#include "tools/mesh/verbs.hpp"

namespace nif::tools {
namespace {

/// Memory of a prepared mesh with Embree's BVHs, measured: the dragon of 871,414 triangles compared with one
/// of a tenth of them takes 0.36 kB per triangle.
constexpr uint64_t kBytesToCompare = 500;

constexpr const char* kSchema = "nifkit.mesh-compare/1";

struct Arguments : RunArguments {
  std::string first, second, format;
  std::vector<std::string> sets;
  uint64_t samples = 1'000'000, rays = 1'000'000, seed = 1;
  bool ignore_alpha = false;
};

struct Comparison {
  uint64_t triangles[2];
  uint64_t with_holes[2];  ///< of these
  double diagonal;         ///< of the first mesh
  compare::Distance there, back;
  std::vector<compare::Visibility> sets;
};

/// A file's objects as one mesh, prepared for queries.
class Side {
 public:
  /// Uses the offset of `beside`, if given, otherwise its own, so that floats are precise enough.
  Side(const std::string& file, const std::string& format, const Arguments& a, Progress& progress,
       const Side* beside) {
    mesh::ReadLimits limits;
    limits.format = format;
    limits.alpha.read = !a.ignore_alpha;
    mesh::Scene scene = read_mesh(file, progress, limits);
    print_notes(mesh::texts_of(scene.notes), a.quiet);
    naming(file, [&] {
      offset_ = beside ? beside->offset_ : mesh::far_offset(scene);
      mesh::move_instances(scene, offset_ * -1);
      const mesh::FlatScene flat(scene);
      require_memory(flat.triangle_count() * kBytesToCompare, "comparing its triangles");
      mesh_ = mesh::flatten(flat, file);
      prepared_ = bake::prepare(mesh_);
    });
  }
  Side(const Side&) = delete;
  Side& operator=(const Side&) = delete;

  const mesh::Mesh& mesh() const { return mesh_; }
  const bake::Prepared& prepared() const { return prepared_; }
  uint64_t with_holes() const {
    return uint64_t(std::ranges::count_if(prepared_.surface.holes, &mesh::TriangleHoles::any));
  }

 private:
  Double3 offset_;
  mesh::Mesh mesh_;
  bake::Prepared prepared_{};
};

Comparison measure(const Arguments& a, Progress& progress) {
  if (a.first == "-" && a.second == "-")
    throw Error(Status::usage, "only one of the two meshes can be standard input");
  // If one is standard input, --format applies to it, and the other file states its own format.
  const bool piped = a.first == "-" || a.second == "-";
  const auto format_of = [&](const std::string& file) {
    return !piped || file == "-" ? a.format : std::string();
  };
  const Side first(a.first, format_of(a.first), a, progress, nullptr),
      second(a.second, format_of(a.second), a, progress, &first);
  const mesh::CleanMesh &from = first.prepared().surface, &to = second.prepared().surface;
  Comparison results{{first.mesh().triangles.size(), second.mesh().triangles.size()},
                     {first.with_holes(), second.with_holes()},
                     first.prepared().box.diagonal(),
                     {},
                     {},
                     {}};
  progress.update(0.2, "measuring distances");
  results.there = compare::distance(from, to, a.samples, a.seed);
  progress.update(0.4, "measuring distances");
  results.back = compare::distance(to, from, a.samples, a.seed);
  std::vector<bake::RaySet> sets = parse_sets(a.sets);
  if (sets.empty()) sets.assign(bake::kRaySets.begin(), bake::kRaySets.end());
  if (a.rays == 0) return results;
  const bake::GroundTruth truth(first.prepared());
  const bake::EmbreeTruth embree(to);
  for (const bake::RaySet set : sets) {
    progress.update(0.6 + 0.4 * double(results.sets.size()) / double(sets.size()), "tracing rays");
    results.sets.push_back(compare::visibility(truth, embree, set, a.rays, a.seed));
  }
  return results;
}

nlohmann::ordered_json json_of(const compare::Distance& d) {
  return {{"samples", d.samples}, {"mean", d.mean}, {"root_mean_square", d.root_mean_square}, {"max", d.max}};
}

void print_json(const Arguments& a, const Comparison& r, double seconds) {
  nlohmann::ordered_json sets = nlohmann::ordered_json::object();
  for (const compare::Visibility& set : r.sets)
    sets[std::string(bake::name_of(set.set))] = {
        {"rays", set.rays},
        {"difference", set.difference()},
        {"opened", set.rays ? double(set.opened) / double(set.rays) : 0},
        {"closed", set.rays ? double(set.closed) / double(set.rays) : 0}};
  const nlohmann::ordered_json json{{"schema", kSchema},
                                    {"files", {a.first, a.second}},
                                    {"triangles", {r.triangles[0], r.triangles[1]}},
                                    {"triangles_with_holes", {r.with_holes[0], r.with_holes[1]}},
                                    {"diagonal", r.diagonal},
                                    {"hausdorff", std::max(r.there.max, r.back.max)},
                                    {"first_to_second", json_of(r.there)},
                                    {"second_to_first", json_of(r.back)},
                                    {"sets", std::move(sets)},
                                    {"seed", a.seed},
                                    {"seconds", seconds}};
  write_json(json);
}

void print(const Arguments& a, const Comparison& r) {
  const std::string* const files[] = {&a.first, &a.second};
  for (size_t i = 0; i < 2; ++i)
    fmt::print("{}: {}{}\n", *files[i], count_of(r.triangles[i], "triangle"),
               r.with_holes[i] == 0 ? "" : fmt::format(", {} with holes", r.with_holes[i]));
  fmt::print("\n");
  fmt::print("{:<18}{:>12}{:>12}{:>12}\n", "distance", "mean", "rms", "most");
  const auto row = [&](const char* name, const compare::Distance& d) {
    fmt::print("{:<18}{:>12.4g}{:>12.4g}{:>12.4g}\n", name, d.mean, d.root_mean_square, d.max);
  };
  row("first to second", r.there);
  row("second to first", r.back);
  const double most = std::max(r.there.max, r.back.max);
  fmt::print("Hausdorff distance {:.4g}, {:.4f} % of the diagonal, {:.4g}\n", most,
             r.diagonal > 0 ? 100 * most / r.diagonal : 0, r.diagonal);
  if (r.with_holes[0] + r.with_holes[1] != 0)
    fmt::print("Distances are between whole triangles, as if they had no holes.\n");
  if (r.sets.empty()) return;
  fmt::print("\n{:<14}{:>10}{:>12}{:>10}{:>10}\n", "ray set", "rays", "different", "opened", "closed");
  for (const compare::Visibility& set : r.sets) {
    const double percent = set.rays ? 100 / double(set.rays) : 0;
    fmt::print("{:<14}{:>10}{:>11.3f}%{:>9.3f}%{:>9.3f}%\n", bake::name_of(set.set), set.rays,
               100 * set.difference(), percent * double(set.opened), percent * double(set.closed));
  }
}

void run(const Arguments& a) {
  const auto start = std::chrono::steady_clock::now();
  parse_sets(a.sets);
  limit_threads(a.threads);
  Progress progress(a.quiet);
  const EndAtOnce nothing_is_written;
  const Comparison results = measure(a, progress);
  progress.finish();
  a.json ? print_json(a, results,
                      std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count())
         : print(a, results);
}

}  // namespace

void add_mesh_compare(Command mesh) {
  const Command command =
      mesh.add_subcommand("compare", "Measure how much two meshes differ, in distance and in visibility");
  auto arguments = std::make_shared<Arguments>();
  Arguments& a = *arguments;
  command.add_option("FIRST", a.first, "A mesh in any format that nif bake reads; its objects are merged")
      .required();
  command.add_option("SECOND", a.second, "The mesh to compare it with, at the same position").required();
  command
      .add_option("--samples", a.samples,
                  "Points on each surface whose distance to the other one is measured")
      .positive()
      .capture_default_str();
  command.add_option("--rays", a.rays, "Rays per ray set (0 = none)").non_negative().capture_default_str();
  add_set_option(command, a.sets, "all except camera");
  add_seed_option(command, a.seed);
  add_format_option(command, a.format);
  command.add_flag(
      "--ignore-alpha", a.ignore_alpha,
      "Every triangle is solid, whatever its material says. Otherwise rays pass where materials of "
      "glTF and OBJ let light through, as in nif bake without options; distances ignore holes");
  add_run_options(command, a, kSchema);
  command.footer(
      "Rays are generated for FIRST. 'opened' rays are blocked by FIRST but not by SECOND; 'closed' is the "
      "reverse.\n"
      "Examples:\n"
      "  nif mesh compare scan.ply light.ply\n"
      "  nif mesh compare scan.ply light.ply --rays 0 --samples 100000\n"
      "  nif mesh compare pine.glb cards.ply --ignore-alpha");
  command.callback([arguments] { run(*arguments); });
}

}  // namespace nif::tools
