// `nif mesh voxelize`: a mesh as an OpenVDB file.
#include <fmt/format.h>

#include <chrono>
#include <filesystem>
#include <memory>

#include "formats/mesh/flat_scene.hpp"
#include "formats/output_file.hpp"
#include "tools/mesh_sampling.hpp"

namespace nif::tools {
namespace {

struct Arguments {
  std::string input, output, kind = "level-set";
  SamplingArguments sampling;
  uint32_t threads = 0;
  bool json = false, quiet = false;
};

void print(const Arguments& a, double voxel, const volume::VolumeFile& file,
           const std::vector<std::string>& notes, double seconds) {
  if (a.json) {
    const nlohmann::ordered_json json{{"schema", "nifkit.mesh-voxelize/1"},
                                      {"file", a.output},
                                      {"kind", a.kind},
                                      {"voxel", voxel},
                                      {"voxels", file.voxels},
                                      {"size", file.size},
                                      {"bytes", file.bytes},
                                      {"notes", notes},
                                      {"seconds", seconds}};
    fmt::print("{}\n", json.dump(2, ' ', false, nlohmann::json::error_handler_t::replace));
  } else if (!a.quiet) {
    fmt::print("{}: {}, {} in {} x {} x {}, each {:.4g} wide, {}, in {:.1f} s\n", a.output, a.kind,
               count_of(file.voxels, "active voxel"), file.size[0], file.size[1], file.size[2], voxel,
               format_bytes(double(file.bytes)), seconds);
  }
}

void run(const Arguments& a) {
  const auto start = std::chrono::steady_clock::now();
  refuse_overwriting(a.input, a.output);
  if (std::filesystem::path(a.output).extension() != ".vdb")
    throw Error(Status::usage, a.output + ": volumes are written as .vdb, and the name says otherwise");
  check_output(a.output);
  limit_threads(a.threads);
  Progress progress(a.quiet);
  const mesh::Scene scene = read_mesh(a.input, progress);
  const mesh::Mesh mesh = naming(a.input, [&] {
    return mesh::flatten(scene, scene.instances.size() == 1
                                    ? scene.instances[0].name
                                    : std::filesystem::path(a.output).stem().string());
  });
  progress.update(0.3, "voxelizing " + a.input);
  double voxel = 0;
  const volume::VolumeFile file = naming(a.input, [&] {
    const volume::Sampling sampling = sampling_of(a.sampling, mesh);
    voxel = sampling.voxel;
    return volume::write_vdb(a.output, mesh, sampling,
                             a.kind == "occupancy" ? volume::Kind::occupancy : volume::Kind::level_set);
  });
  progress.finish();
  print_notes(scene.warnings, a.quiet);
  print(a, voxel, file, scene.warnings,
        std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
}

}  // namespace

void add_mesh_voxelize(CLI::App& mesh) {
  CLI::App* command = mesh.add_subcommand("voxelize", "Write a mesh as an OpenVDB volume");
  auto arguments = std::make_shared<Arguments>();
  Arguments& a = *arguments;
  command->add_option("INPUT", a.input, "A mesh in any format that nif bake reads; its objects become one")
      ->required();
  command->add_option("-o,--output", a.output, "The .vdb file to write")->required();
  command
      ->add_option(
          "--kind", a.kind,
          "level-set: signed distances within three voxels of the surface; occupancy: which voxels have "
          "their centre inside")
      ->check(CLI::IsMember({"level-set", "occupancy"}))
      ->capture_default_str();
  add_sampling_options(*command, a.sampling);
  command->add_option("-j,--threads", a.threads, "Threads; 0: all. The result is the same for any number")
      ->capture_default_str();
  command->add_flag("--json", a.json, "Print the results as one JSON object (nifkit.mesh-voxelize/1)");
  command->add_flag("--quiet", a.quiet, "No progress, notes or summary");
  command->footer("Example: nif mesh voxelize dragon.ply -o dragon.vdb --resolution 256");
  command->callback([arguments] { run(*arguments); });
}

}  // namespace nif::tools
