// `nif mesh convert`: converts a mesh, or the objects of a scene, to another format.
#include <fmt/format.h>

#include <chrono>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>

#include "formats/base/file_name.hpp"
#include "formats/base/memory.hpp"
#include "formats/base/output_file.hpp"
#include "formats/base/quantities.hpp"
#include "formats/base/status.hpp"
#include "formats/mesh/transform.hpp"
#include "formats/mesh/write.hpp"
#include "tools/common/interruption.hpp"
#include "tools/common/json_output.hpp"
#include "tools/common/naming.hpp"
#include "tools/common/notes.hpp"
#include "tools/common/options.hpp"
#include "tools/common/progress.hpp"
#include "tools/common/shared_options.hpp"
#include "tools/common/threads.hpp"
#include "tools/mesh/sampling.hpp"
#include "tools/mesh/verb_input.hpp"
#include "tools/mesh/verbs.hpp"
#include "tools/mesh/write_options.hpp"
#include "tools/render/scene_file.hpp"

namespace nif::tools {
namespace {

constexpr const char* kSchema = "nifkit.mesh-convert/1";
/// In memory, and as a node of a glTF that is written.
constexpr uint64_t kBytesOfInstance = 1000;

struct Arguments : RunArguments {
  std::string input, output, format;
  mesh::WriteOptions options;
  SamplingArguments sampling;
  bool sampling_given = false;
  mesh::Choice choice;
  std::optional<std::string> clip;
  double time = 0;
  bool time_given = false;
};

/// Appends a file's scene with a transform; its meshes only if `first_mesh` shows that they are not there
/// yet.
void append(mesh::Scene& to, const mesh::Scene& file, const mesh::Transform& place, uint32_t first_mesh) {
  if (first_mesh == to.meshes.size())
    to.meshes.insert(to.meshes.end(), file.meshes.begin(), file.meshes.end());
  // A scene may place a file a thousand times, and the file may place a mesh as often.
  require_memory((to.instances.size() + file.instances.size()) * kBytesOfInstance, "all of its instances");
  const auto placed = [&](auto thing) {
    thing.transform = mesh::compose(place, thing.transform);
    return thing;
  };
  for (const mesh::Instance& instance : file.instances) {
    mesh::Instance& added = to.instances.emplace_back(mesh::placed(place, instance));
    added.mesh += first_mesh;
    added.node = mesh::kNoNode;  // node numbers of several files would clash
  }
  for (const mesh::Camera& camera : file.cameras) to.cameras.push_back(placed(camera));
  for (const mesh::Light& light : file.lights) to.lights.push_back(placed(light));
}

/// The objects of a scene for `nif render`, with the meshes of each file once.
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
      found = known.emplace(object.mesh, Known{read_mesh(object.mesh, progress), uint32_t(all.meshes.size())})
                  .first;
      const std::vector<mesh::Note>& notes = found->second.scene.notes;
      all.notes.insert(all.notes.end(), notes.begin(), notes.end());
    }
    append(all, found->second.scene, object.transform, found->second.first_mesh);
  }
  if (!description.lights.empty() || !description.cameras.empty())
    all.notes.push_back(
        {mesh::NoteKind::fixtures, fmt::format("{}: {} and {} of the scene file were left out", file,
                                               count_of(description.lights.size(), "light"),
                                               count_of(description.cameras.size(), "camera"))});
  return all;
}

void print(const Arguments& arguments, const mesh::Scene& scene, const mesh::Written& written,
           const std::vector<std::string>& notes, double seconds) {
  const uint64_t triangles = triangles_of(scene);
  if (arguments.json) {
    const nlohmann::ordered_json json{{"schema", kSchema},
                                      {"file", arguments.output},
                                      {"meshes", scene.meshes.size()},
                                      {"instances", scene.instances.size()},
                                      {"triangles", triangles},
                                      {"cameras", scene.cameras.size()},
                                      {"lights", scene.lights.size()},
                                      {"bytes", written.bytes},
                                      {"notes", notes},
                                      {"seconds", seconds}};
    write_json(json);
  } else if (!arguments.quiet) {
    fmt::print("{}: {} in {}, {}, {}, in {:.1f} s\n", arguments.output, count_of(triangles, "triangle"),
               scene.meshes.size() == 1 ? "1 mesh" : fmt::format("{} meshes", scene.meshes.size()),
               count_of(scene.instances.size(), "instance"), format_bytes(double(written.bytes)), seconds);
  }
}

bool is_volume(const std::string& path) { return ending_of(path) == ".vdb"; }

void check_arguments(const Arguments& arguments) {
  check_choice(arguments.choice);
  if (!arguments.choice.empty() && ending_of(arguments.input) == ".toml")
    throw Error(Status::usage, arguments.input + ": --only and --except are for mesh files, not for scenes");
  if (arguments.clip && ending_of(arguments.input) == ".toml")
    throw Error(Status::usage, arguments.input + ": --clip is for mesh files, not for scenes");
  if (arguments.time_given && !arguments.clip)
    throw Error(Status::usage, "--time is a moment of --clip, which is missing; nif mesh info lists clips");
  const mesh::WriteOptions& options = arguments.options;
  if (!is_volume(arguments.output)) {
    mesh::check_options(mesh::file_kind(arguments.output), options);
    if (arguments.sampling_given)
      throw Error(
          Status::usage,
          arguments.output + ": --voxel, --resolution, --thickness and --allow-open are only for .vdb");
  } else if (options.draco || options.draco_bits || options.text) {
    throw Error(Status::usage, arguments.output + ": --draco, --draco-bits and --text are not for .vdb");
  }
}

mesh::Written write(const Arguments& arguments, const mesh::Scene& scene, Progress& progress) {
  if (is_volume(arguments.output)) {
    progress.update(0.3, "voxelizing " + shown_name(arguments.input));
    const WrittenVolume volume =
        write_volume(scene, arguments.input, arguments.output, arguments.sampling, volume::Kind::level_set);
    return {volume.bytes,
            {fmt::format("{}: a level set, sampled every {:.4g}; finer detail is lost", arguments.output,
                         volume.voxel)}};
  }
  return naming(arguments.input, [&] {
    return mesh::write(
        arguments.output, scene, arguments.options,
        [&](double fraction) { progress.update(fraction, "writing " + arguments.output); }, interruption());
  });
}

void run(const Arguments& arguments) {
  const auto start = std::chrono::steady_clock::now();
  refuse_overwriting(arguments.input, arguments.output);
  check_arguments(arguments);
  check_output(arguments.output);
  limit_threads(arguments.threads);
  Progress progress(arguments.quiet);
  interruption();
  progress.update(0, "reading " + shown_name(arguments.input));
  mesh::ReadLimits limits;
  limits.format = arguments.format;
  limits.choice = arguments.choice;
  if (arguments.clip) limits.moment = {*arguments.clip, arguments.time};
  const mesh::Scene scene = ending_of(arguments.input) == ".toml"
                                ? read_objects(arguments.input, progress)
                                : read_mesh(arguments.input, progress, limits);
  const mesh::Written written = write(arguments, scene, progress);
  progress.finish();
  std::vector<std::string> notes = mesh::texts_of(scene.notes);
  notes.insert(notes.end(), written.notes.begin(), written.notes.end());
  print_notes(notes, arguments.quiet);
  print(arguments, scene, written, notes,
        std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
}

}  // namespace

void add_mesh_convert(Command mesh) {
  const Command command =
      mesh.add_subcommand("convert", "Convert a mesh, or the objects of a scene, to another format");
  auto arguments = std::make_shared<Arguments>();
  Arguments& a = *arguments;
  command
      .add_option("INPUT", a.input,
                  "A mesh in any format that nif bake reads, a .vdb with level sets, or a .toml scene of nif "
                  "render, whose objects become nodes")
      .required();
  command
      .add_option("-o,--output", a.output,
                  "The file to write. Its ending sets the format: .obj, .ply (binary), .stl (binary), .off, "
                  ".glb, .drc or .vdb")
      .required();
  add_format_option(command, a.format);
  add_write_options(command, a.options);
  add_sampling_options(command, a.sampling);
  add_choice_options(command, a.choice);
  command.add_option(
      "--clip", a.clip,
      "Of a glTF: write its nodes, skins and morph targets as this animation has them, given by its name "
      "or its number from 0 on; nif mesh info lists them");
  command
      .add_option("--time", a.time,
                  "The moment of --clip, in seconds (0). Before the first key and after the last, the clip "
                  "stands still")
      .range(0.0, 1e9);
  add_run_options(command, a, kSchema);
  command.footer(
      "A .glb keeps every bit of positions, indices, names, transforms, cameras and lights. The other "
      "formats keep\n"
      "every bit of positions and triangles, unless Draco rounds them; notes list what is lost. A .vdb is a "
      "level set\n"
      "of what all objects together enclose (OpenVDB), sampled by --voxel or --resolution. Materials and "
      "other\n"
      "attributes are not read.\n"
      "Examples:\n"
      "  nif mesh convert scan.ply -o scan.glb --draco\n"
      "  nif mesh convert guard.glb -o running.obj --clip Run --time 0.4\n"
      "  nif mesh convert plan.toml -o objects.glb && nif bake objects.glb -o objects.nif");
  command.callback([arguments, command] {
    for (const char* name : {"--voxel", "--resolution", "--thickness", "--allow-open"})
      arguments->sampling_given |= command.given(name);
    arguments->time_given = command.given("--time");
    run(*arguments);
  });
}

}  // namespace nif::tools
