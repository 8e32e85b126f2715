// `nif mesh convert`: any mesh that nif reads, or the objects of a scene, as one .glb.
#include <fmt/format.h>

#include <chrono>
#include <filesystem>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>

#include "formats/mesh/glb_writer.hpp"
#include "formats/mesh/read.hpp"
#include "formats/output_file.hpp"
#include "tools/mesh.hpp"
#include "tools/progress.hpp"
#include "tools/render/scene_file.hpp"
#include "tools/render/transform.hpp"

namespace nif::tools {
namespace {

struct Arguments {
  std::string input, output;
  bool json = false, quiet = false;
};

/// Appends a file's scene, placed by a transform; its meshes only where `first_mesh` says that they are not
/// there yet.
void append(mesh::Scene& to, const mesh::Scene& file, const mesh::Transform& place, uint32_t first_mesh) {
  if (first_mesh == to.meshes.size())
    to.meshes.insert(to.meshes.end(), file.meshes.begin(), file.meshes.end());
  const auto placed = [&](auto thing) {
    thing.transform = render::compose(place, thing.transform);
    return thing;
  };
  for (const mesh::Instance& instance : file.instances)
    to.instances.emplace_back(placed(instance)).mesh += first_mesh;
  for (const mesh::Camera& camera : file.cameras) to.cameras.push_back(placed(camera));
  for (const mesh::Light& light : file.lights) to.lights.push_back(placed(light));
}

/// The objects of a scene for `nif render`, each file's meshes once.
mesh::Scene read_objects(const std::string& file, Progress& progress) {
  const render::SceneDescription description = render::read_scene(file);
  struct Known {
    mesh::Scene scene;
    uint32_t first_mesh;
  };
  std::map<std::string, Known> known;  // by path
  mesh::Scene all;
  for (const render::ObjectDescription& object : description.objects) {
    auto found = known.find(object.mesh);
    if (found == known.end()) {
      progress.update(double(&object - description.objects.data()) / double(description.objects.size()),
                      "reading " + object.mesh);
      found = known.try_emplace(object.mesh, mesh::read(object.mesh), uint32_t(all.meshes.size())).first;
      const std::vector<std::string>& warnings = found->second.scene.warnings;
      all.warnings.insert(all.warnings.end(), warnings.begin(), warnings.end());
    }
    append(all, found->second.scene, object.transform, found->second.first_mesh);
  }
  if (!description.lights.empty() || !description.cameras.empty())
    all.warnings.push_back(fmt::format("{}: {} and {} are the scene's own and stay there", file,
                                       count_of(description.lights.size(), "light"),
                                       count_of(description.cameras.size(), "camera")));
  return all;
}

void print(const Arguments& arguments, const mesh::Scene& scene, uint64_t bytes, double seconds) {
  uint64_t triangles = 0;
  for (const mesh::Mesh& mesh : scene.meshes) triangles += mesh.triangles.size();
  if (arguments.json) {
    const nlohmann::ordered_json json{
        {"schema", "nifkit.mesh-convert/1"},   {"file", arguments.output}, {"meshes", scene.meshes.size()},
        {"instances", scene.instances.size()}, {"triangles", triangles},   {"cameras", scene.cameras.size()},
        {"lights", scene.lights.size()},       {"bytes", bytes},           {"seconds", seconds}};
    fmt::print("{}\n", json.dump(2, ' ', false, nlohmann::json::error_handler_t::replace));
  } else if (!arguments.quiet) {
    fmt::print("{}: {} in {}, {}, {}, in {:.1f} s\n", arguments.output, count_of(triangles, "triangle"),
               scene.meshes.size() == 1 ? "1 mesh" : fmt::format("{} meshes", scene.meshes.size()),
               count_of(scene.instances.size(), "instance"), format_bytes(double(bytes)), seconds);
  }
}

void run(const Arguments& arguments) {
  const auto start = std::chrono::steady_clock::now();
  std::error_code ignored;
  if (std::filesystem::equivalent(arguments.input, arguments.output, ignored))
    throw Error(Status::usage, fmt::format("{}: the output would overwrite the input", arguments.output));
  if (std::filesystem::path(arguments.output).extension() != ".glb")
    throw Error(Status::usage, fmt::format("-o {}: meshes are written as .glb, and the name says otherwise",
                                           arguments.output));
  check_output(arguments.output);
  Progress progress(arguments.quiet);
  progress.update(0, "reading " + arguments.input);
  const mesh::Scene scene = std::filesystem::path(arguments.input).extension() == ".toml"
                                ? read_objects(arguments.input, progress)
                                : mesh::read(arguments.input);
  const std::vector<std::byte> bytes = naming(arguments.input, [&] { return mesh::encode_glb(scene); });
  if (interruption()) throw Error(Status::interrupted, "the conversion was cancelled");
  write_output(arguments.output, bytes);
  progress.finish();
  if (!arguments.quiet)
    for (const std::string& warning : scene.warnings) fmt::print(stderr, "nif: note: {}\n", warning);
  print(arguments, scene, bytes.size(),
        std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
}

}  // namespace

void add_mesh_convert(CLI::App& mesh) {
  CLI::App* command =
      mesh.add_subcommand("convert", "Write any mesh, or the objects of a scene, as one .glb");
  auto arguments = std::make_shared<Arguments>();
  Arguments& a = *arguments;
  command
      ->add_option("INPUT", a.input,
                   "A mesh in any format that nif bake reads, or a .toml scene of nif render, whose objects "
                   "become nodes where it has them")
      ->required();
  command->add_option("-o,--output", a.output, "The .glb file to write")->required();
  command->add_flag("--json", a.json, "Print the results as one JSON object (nifkit.mesh-convert/1)");
  command->add_flag("--quiet", a.quiet, "No progress, notes or summary");
  command->footer(
      "Positions, indices, names, transforms, cameras and lights are kept, each bit of them; materials and\n"
      "other attributes are not read.\n"
      "Example: nif mesh convert plan.toml -o objects.glb && nif bake objects.glb -o objects.nif");
  command->callback([arguments] { run(*arguments); });
}

}  // namespace nif::tools
