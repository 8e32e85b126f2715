// Every verb follows these steps: check the output, read, change, drop empty meshes, write, report. EndAtOnce
// covers only reading and changing; while a file is written, Ctrl-C cancels it cleanly.
#include "tools/mesh/mesh_work.hpp"

#include <fmt/format.h>

#include <chrono>

#include "formats/base/output_file.hpp"
#include "formats/base/quantities.hpp"
#include "formats/base/status.hpp"
#include "tools/common/interruption.hpp"
#include "tools/common/json_output.hpp"
#include "tools/common/naming.hpp"
#include "tools/common/notes.hpp"
#include "tools/common/options.hpp"
#include "tools/common/progress.hpp"
#include "tools/common/threads.hpp"
#include "tools/mesh/write_options.hpp"

namespace nif::tools {
namespace {

std::string schema_of(const std::string& verb) { return "nifkit.mesh-" + verb + "/1"; }

}  // namespace

void add_work_options(Command command, WorkArguments& a, const std::string& verb) {
  command.add_option("INPUT", a.input, "A mesh in any format that nif bake reads").required();
  command
      .add_option("-o,--output", a.output,
                  "The file to write. Its ending sets the format: .obj, .ply, .stl, .off, .glb or .drc")
      .required();
  add_format_option(command, a.limits.format);
  add_write_options(command, a.write);
  add_run_options(command, a, schema_of(verb));
}

void work_on(const WorkArguments& a, const std::string& verb,
             const std::function<WorkResult(mesh::Scene&, Progress&)>& change) {
  const auto start = std::chrono::steady_clock::now();
  refuse_overwriting(a.input, a.output);
  mesh::check_options(mesh::file_kind(a.output), a.write);
  check_output(a.output);
  limit_threads(a.threads);
  Progress progress(a.quiet);
  mesh::Scene scene;
  WorkResult result;
  uint64_t before = 0;
  {
    const EndAtOnce nothing_is_written;
    scene = read_mesh(a.input, progress, a.limits);
    before = triangles_of(scene);
    result = naming(a.input, [&] { return change(scene, progress); });
  }
  std::vector<std::string> notes = mesh::texts_of(scene.notes);
  notes.insert(notes.end(), result.notes.begin(), result.notes.end());
  for (const std::string& name : mesh::drop_empty_meshes(scene))
    notes.push_back(fmt::format("mesh '{}' has no triangles left and was left out", name));
  if (scene.meshes.empty())
    throw Error(Status::all_degenerate, shown_name(a.input) + ": no triangles are left");
  const mesh::Written written = naming(a.input, [&] {
    return mesh::write(
        a.output, scene, a.write, [&](double fraction) { progress.update(fraction, "writing " + a.output); },
        interruption());
  });
  notes.insert(notes.end(), written.notes.begin(), written.notes.end());
  progress.finish();
  print_notes(notes, a.quiet);
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  const uint64_t after = triangles_of(scene);
  if (a.json) {
    nlohmann::ordered_json json{{"schema", schema_of(verb)},
                                {"file", a.output},
                                {"triangles", {{"before", before}, {"after", after}}}};
    json.update(result.json);
    json["bytes"] = written.bytes;
    json["notes"] = notes;
    json["seconds"] = seconds;
    write_json(json);
  } else if (!a.quiet) {
    fmt::print("{}: {} of {} before, {}, in {:.1f} s\n{}", a.output, count_of(after, "triangle"), before,
               format_bytes(double(written.bytes)), seconds, result.text);
  }
}

}  // namespace nif::tools
