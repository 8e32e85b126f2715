// `nif mesh generate`: generates a test mesh from a formula and a seed.
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <tuple>

#include "formats/base/output_file.hpp"
#include "formats/base/quantities.hpp"
#include "formats/base/status.hpp"
#include "formats/mesh/box.hpp"
#include "formats/mesh/ply_writer.hpp"
#include "formats/mesh/write.hpp"
#include "mesh/generate/city.hpp"
#include "mesh/generate/cutout_tree.hpp"
#include "mesh/generate/forest.hpp"
#include "mesh/generate/shape.hpp"
#include "tools/common/interruption.hpp"
#include "tools/common/json_output.hpp"
#include "tools/common/options.hpp"
#include "tools/common/progress.hpp"
#include "tools/common/shared_options.hpp"
#include "tools/common/threads.hpp"
#include "tools/mesh/verbs.hpp"

namespace nif::tools {
namespace {

constexpr const char* kSchema = "nifkit.mesh-generate/1";

struct Arguments : RunArguments {
  std::string shape, output;
  generate::Request request;
  std::optional<uint64_t> triangles;
  std::optional<uint32_t> instances;
  bool cutout = false;
};

constexpr const char* kTree = "tree";

/// Facts about a written file, for the results.
struct Made {
  uint64_t triangles, vertices, bytes;
  mesh::Float3 low, high;
  nlohmann::ordered_json more = nlohmann::ordered_json::object();  ///< only for some shapes
  std::string text = {};                                           ///< the same for people
};

/// Whether the mesh goes to where the results would go.
bool is_standard_output(const std::string& path) {
  struct stat file, out;
  return ::stat(path.c_str(), &file) == 0 && ::fstat(STDOUT_FILENO, &out) == 0 && file.st_dev == out.st_dev &&
         file.st_ino == out.st_ino && !S_ISCHR(file.st_mode);
}

void print(std::FILE* out, const Arguments& arguments, const Made& made, double seconds) {
  if (arguments.json) {
    nlohmann::ordered_json json{{"schema", kSchema},           {"file", arguments.output},
                                {"shape", arguments.shape},    {"seed", arguments.request.seed},
                                {"triangles", made.triangles}, {"vertices", made.vertices},
                                {"bytes", made.bytes},         {"bounds", {made.low, made.high}},
                                {"seconds", seconds}};
    json.update(made.more);
    write_json(json, out);
  } else if (!arguments.quiet) {
    const auto& [low, high] = std::tie(made.low, made.high);
    fmt::print(out,
               "{}: {}, {}{} triangles, {} vertices, {} bytes, from ({:.3g}, {:.3g}, {:.3g}) to "
               "({:.3g}, {:.3g}, {:.3g}), in {:.1f} s\n",
               arguments.output, arguments.shape, made.text, made.triangles, made.vertices, made.bytes,
               low[0], low[1], low[2], high[0], high[1], high[2], seconds);
  }
}

/// Writes a shape while it is computed.
Made write_shape(const Arguments& arguments, Progress& progress) {
  if (mesh::known_file_kind(arguments.output).value_or(mesh::FileKind::ply) != mesh::FileKind::ply)
    throw Error(Status::usage, arguments.output +
                                   ": a shape is written as PLY, so its file must end in .ply; nif mesh "
                                   "convert writes the other formats");
  const std::unique_ptr<mesh::MeshSource> source = generate::make_shape(arguments.shape, arguments.request);
  check_output(arguments.output);
  const mesh::PlyFile file = mesh::write_ply(
      arguments.output, *source,
      fmt::format("nif mesh generate {} --triangles {} --seed {}", arguments.shape,
                  arguments.request.triangles, arguments.request.seed),
      [&](double fraction) { progress.update(fraction, "writing " + arguments.output); }, interruption());
  return {source->triangle_count(), source->vertex_count(), file.bytes, file.low, file.high};
}

uint32_t checked_instances(const Arguments& arguments, uint32_t usual, uint32_t fewest, uint32_t most) {
  const uint32_t instances = arguments.instances.value_or(usual);
  if (instances < fewest || instances > most)
    throw Error(Status::usage, fmt::format("--instances {}: a {} can have {} to {}", instances,
                                           arguments.shape, fewest, most));
  return instances;
}

/// Generates what has instances or materials.
generate::PaintedScene make_scene(const Arguments& arguments) {
  const uint64_t seed = arguments.request.seed;
  if (arguments.shape == generate::kCity) {
    const uint32_t instances =
        checked_instances(arguments, generate::CityRequest{}.instances, generate::kCityFewestInstances,
                          generate::kCityMostInstances);
    return {generate::make_city({instances, seed}), {}};
  }
  if (arguments.shape == generate::kForest) {
    const uint32_t instances =
        checked_instances(arguments, generate::ForestRequest{}.instances, generate::kForestFewestInstances,
                          generate::kForestMostInstances);
    return generate::make_forest({instances, seed});
  }
  return generate::make_cutout_tree(arguments.request);
}

Made write_scene(const Arguments& arguments, Progress& progress) {
  if (mesh::file_kind(arguments.output) != mesh::FileKind::glb)
    throw Error(Status::usage, fmt::format("{}: a {} has {}, so its file must end in .glb", arguments.output,
                                           arguments.shape, arguments.cutout ? "materials" : "instances"));
  check_output(arguments.output);
  generate::PaintedScene made_scene;
  {
    const EndAtOnce nothing_is_written;
    progress.update(0, "generating " + arguments.shape);
    made_scene = make_scene(arguments);
  }
  const mesh::Scene& scene = made_scene.scene;
  progress.update(0.5, "writing " + arguments.output);
  mesh::WriteOptions options;
  if (!made_scene.paint.materials.empty()) options.paint = &made_scene.paint;
  const mesh::Written file = mesh::write(
      arguments.output, scene, options, [](double) {}, interruption());
  Made made{0, 0, file.bytes, {}, {}};
  for (const mesh::Mesh& mesh : scene.meshes) {
    made.triangles += mesh.triangles.size();
    made.vertices += mesh.positions.size();
  }
  const mesh::Box box = mesh::bounds(scene);
  made.low = box.min, made.high = box.max;
  if (arguments.cutout) return made;
  made.more = {{"meshes", scene.meshes.size()}, {"instances", scene.instances.size()}};
  made.text =
      fmt::format("{} meshes in {}, ", scene.meshes.size(), count_of(scene.instances.size(), "instance"));
  return made;
}

void run(Arguments arguments) {
  const auto start = std::chrono::steady_clock::now();
  const bool city = arguments.shape == generate::kCity, forest = arguments.shape == generate::kForest;
  if (city && arguments.triangles)
    throw Error(Status::usage,
                fmt::format("--triangles is not for {}: its {} objects have {} to {} triangles each; "
                            "--instances sets its size",
                            arguments.shape, generate::kCityObjects, generate::kCityFewestTriangles,
                            generate::kCityMostTriangles));
  if (forest && arguments.triangles)
    throw Error(Status::usage,
                fmt::format("--triangles is not for {}: its {} trees have up to {} triangles each; "
                            "--instances sets its size",
                            arguments.shape, generate::kTreeKinds, generate::kForestTreeTriangles));
  if (!city && !forest && arguments.instances)
    throw Error(Status::usage,
                fmt::format("--instances is only for {} and {}", generate::kCity, generate::kForest));
  if (arguments.cutout && arguments.shape != kTree)
    throw Error(Status::usage,
                forest ? fmt::format("--cutout is only for {}: all leaves of a {} are cut out", kTree,
                                     generate::kForest)
                       : fmt::format("--cutout is only for {}, not for {}", kTree, arguments.shape));
  arguments.request.triangles = arguments.triangles.value_or(arguments.request.triangles);
  // If standard output takes the mesh, the results go to standard error, like the progress.
  std::FILE* results = is_standard_output(arguments.output) ? stderr : stdout;
  limit_threads(arguments.threads);
  Progress progress(arguments.quiet);
  const Made made = city || forest || arguments.cutout ? write_scene(arguments, progress)
                                                       : write_shape(arguments, progress);
  progress.finish();
  print(results, arguments, made,
        std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
}

std::string footer() {
  std::string text = "Shapes (y up; all but leaves that are cut out are closed and face outwards):\n";
  for (const generate::Shape& shape : generate::shapes())
    text += fmt::format("  {:<12}{}\n", shape.name, shape.description);
  return text + fmt::format("  {:<12}{}\n", generate::kCity, generate::kCityDescription) +
         fmt::format("  {:<12}{}\n", generate::kForest, generate::kForestDescription) +
         "\nExamples:\n"
         "  nif mesh generate statue -o statue.ply --triangles 1000000\n"
         "  nif mesh generate tree -o /dev/stdout | zstd > tree.ply.zst\n"
         "  nif mesh generate city -o city.glb --instances 20000\n"
         "  nif mesh generate tree -o tree.glb --cutout --triangles 5000\n"
         "  nif mesh generate forest -o forest.glb --instances 2000";
}

}  // namespace

void add_mesh_generate(Command mesh) {
  const Command command =
      mesh.add_subcommand("generate", "Generate a test mesh as a binary PLY, or a scene as a GLB");
  auto arguments = std::make_shared<Arguments>();
  Arguments& a = *arguments;
  command.add_option("SHAPE", a.shape, "One of the shapes listed below").required();
  command
      .add_option("-o,--output", a.output,
                  "The .ply file to write; the .glb for a city, a forest, and with --cutout")
      .required();
  command
      .add_option("--triangles", a.triangles,
                  "Largest number of triangles; the mesh gets as close to it as the shape allows. Not for a "
                  "city or a forest")
      .default_str(std::to_string(a.request.triangles))
      .range(generate::kFewestTriangles, generate::kMostTriangles);
  command
      .add_option("--instances", a.instances,
                  fmt::format("Number of instances in a city ({} to {}) or a forest ({} to {})",
                              generate::kCityFewestInstances, generate::kCityMostInstances,
                              generate::kForestFewestInstances, generate::kForestMostInstances))
      .default_str(
          fmt::format("{} or {}", generate::CityRequest{}.instances, generate::ForestRequest{}.instances))
      .range(std::min(generate::kCityFewestInstances, generate::kForestFewestInstances),
             std::max(generate::kCityMostInstances, generate::kForestMostInstances));
  command.add_flag("--cutout", a.cutout,
                   "A tree as games draw it: its leaves are quads whose picture has alpha. Written as .glb");
  add_seed_option(command, a.request.seed);
  add_run_options(command, a, kSchema);
  command.footer(footer());
  command.callback([arguments] { run(*arguments); });
}

}  // namespace nif::tools
