// `nif mesh voxelize`: converts a mesh to an OpenVDB file.
#include <fmt/format.h>

#include <chrono>
#include <memory>
#include <nlohmann/json.hpp>

#include "formats/base/file_name.hpp"
#include "formats/base/output_file.hpp"
#include "formats/base/quantities.hpp"
#include "formats/base/status.hpp"
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

namespace nif::tools {
namespace {

constexpr const char* kSchema = "nifkit.mesh-voxelize/1";

struct Arguments : RunArguments {
  std::string input, output, format, kind = "level-set";
  SamplingArguments sampling;
};

void print(const Arguments& a, const WrittenVolume& written, const std::vector<std::string>& notes,
           double seconds) {
  if (a.json) {
    const nlohmann::ordered_json json{
        {"schema", kSchema},      {"file", a.output},         {"kind", a.kind},
        {"voxel", written.voxel}, {"voxels", written.voxels}, {"size", written.size},
        {"bytes", written.bytes}, {"notes", notes},           {"seconds", seconds}};
    write_json(json);
  } else if (!a.quiet) {
    fmt::print("{}: {}, {} in {} x {} x {}, each {:.4g} wide, {}, in {:.1f} s\n", a.output, a.kind,
               count_of(written.voxels, "active voxel"), written.size[0], written.size[1], written.size[2],
               written.voxel, format_bytes(double(written.bytes)), seconds);
  }
}

void run(const Arguments& a) {
  const auto start = std::chrono::steady_clock::now();
  refuse_overwriting(a.input, a.output);
  if (ending_of(a.output) != ".vdb")
    throw Error(Status::usage, a.output + ": volumes are written as .vdb, so the name must end in .vdb");
  check_output(a.output);
  limit_threads(a.threads);
  Progress progress(a.quiet);
  const mesh::Scene scene = read_mesh(a.input, progress, {.format = a.format});
  progress.update(0.3, "voxelizing " + shown_name(a.input));
  const WrittenVolume written =
      write_volume(scene, a.input, a.output, a.sampling,
                   a.kind == "occupancy" ? volume::Kind::occupancy : volume::Kind::level_set);
  progress.finish();
  const std::vector<std::string> notes = mesh::texts_of(scene.notes);
  print_notes(notes, a.quiet);
  print(a, written, notes, std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
}

}  // namespace

void add_mesh_voxelize(Command mesh) {
  const Command command = mesh.add_subcommand("voxelize", "Convert a mesh to an OpenVDB volume");
  auto arguments = std::make_shared<Arguments>();
  Arguments& a = *arguments;
  command.add_option("INPUT", a.input, "A mesh in any format that nif bake reads; its objects are merged")
      .required();
  command.add_option("-o,--output", a.output, "The .vdb file to write").required();
  command
      .add_option("--kind", a.kind,
                  "level-set: signed distances within three voxels of the surface; occupancy: the voxels "
                  "whose centre is inside")
      .one_of({"level-set", "occupancy"})
      .capture_default_str();
  add_format_option(command, a.format);
  add_sampling_options(command, a.sampling);
  add_run_options(command, a, kSchema);
  command.footer(
      "Examples:\n"
      "  nif mesh voxelize dragon.ply -o dragon.vdb --resolution 256\n"
      "  nif mesh voxelize scan.ply -o scan.vdb --kind occupancy --allow-open");
  command.callback([arguments] { run(*arguments); });
}

}  // namespace nif::tools
