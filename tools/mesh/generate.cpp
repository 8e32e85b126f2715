// `nif mesh generate`: generates a test mesh from a formula and a seed.
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <chrono>
#include <memory>
#include <nlohmann/json.hpp>

#include "formats/base/output_file.hpp"
#include "formats/mesh/ply_writer.hpp"
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
};

/// Does the mesh go where the results would go?
bool is_standard_output(const std::string& path) {
  struct stat file, out;
  return ::stat(path.c_str(), &file) == 0 && ::fstat(STDOUT_FILENO, &out) == 0 && file.st_dev == out.st_dev &&
         file.st_ino == out.st_ino && !S_ISCHR(file.st_mode);
}

void print(std::FILE* out, const Arguments& arguments, const mesh::MeshSource& source,
           const mesh::PlyFile& file, double seconds) {
  if (arguments.json) {
    const nlohmann::ordered_json json{{"schema", kSchema},
                                      {"file", arguments.output},
                                      {"shape", arguments.shape},
                                      {"seed", arguments.request.seed},
                                      {"triangles", source.triangle_count()},
                                      {"vertices", source.vertex_count()},
                                      {"bytes", file.bytes},
                                      {"bounds", {file.low, file.high}},
                                      {"seconds", seconds}};
    write_json(json, out);
  } else if (!arguments.quiet) {
    fmt::print(out,
               "{}: {}, {} triangles, {} vertices, {} bytes, from ({:.3g}, {:.3g}, {:.3g}) to "
               "({:.3g}, {:.3g}, {:.3g}), in {:.1f} s\n",
               arguments.output, arguments.shape, source.triangle_count(), source.vertex_count(), file.bytes,
               file.low[0], file.low[1], file.low[2], file.high[0], file.high[1], file.high[2], seconds);
  }
}

void run(const Arguments& arguments) {
  const auto start = std::chrono::steady_clock::now();
  const std::unique_ptr<mesh::MeshSource> source = generate::make_shape(arguments.shape, arguments.request);
  // Results that would end up within the mesh go beside the progress.
  std::FILE* results = is_standard_output(arguments.output) ? stderr : stdout;
  check_output(arguments.output);
  limit_threads(arguments.threads);
  Progress progress(arguments.quiet);
  const mesh::PlyFile file = mesh::write_ply(
      arguments.output, *source,
      fmt::format("nif mesh generate {} --triangles {} --seed {}", arguments.shape,
                  arguments.request.triangles, arguments.request.seed),
      [&](double fraction) { progress.update(fraction, "writing " + arguments.output); }, interruption());
  progress.finish();
  print(results, arguments, *source, file,
        std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
}

std::string footer() {
  std::string text = "Shapes (all closed, facing outwards, y up):\n";
  for (const generate::Shape& shape : generate::shapes())
    text += fmt::format("  {:<12}{}\n", shape.name, shape.description);
  return text +
         "\nExamples:\n"
         "  nif mesh generate statue -o statue.ply --triangles 1000000\n"
         "  nif mesh generate tree -o /dev/stdout | zstd > tree.ply.zst";
}

}  // namespace

void add_mesh_generate(Command mesh) {
  const Command command = mesh.add_subcommand("generate", "Generate a test mesh as a binary PLY");
  auto arguments = std::make_shared<Arguments>();
  Arguments& a = *arguments;
  command.add_option("SHAPE", a.shape, "One of the shapes listed below").required();
  command.add_option("-o,--output", a.output, "The .ply file to write").required();
  command
      .add_option("--triangles", a.request.triangles,
                  "Largest number of triangles; the mesh gets as close to it as the shape allows")
      .capture_default_str()
      .range(generate::kFewestTriangles, generate::kMostTriangles);
  add_seed_option(command, a.request.seed);
  add_run_options(command, a, kSchema);
  command.footer(footer());
  command.callback([arguments] { run(*arguments); });
}

}  // namespace nif::tools
