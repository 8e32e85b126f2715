// `nif mesh decimate`: reduces the number of triangles.
#include <fmt/format.h>

#include <memory>
#include <optional>

#include "formats/base/memory.hpp"
#include "formats/base/status.hpp"
#include "mesh/halfedge/decimate.hpp"
#include "tools/common/options.hpp"
#include "tools/common/progress.hpp"
#include "tools/mesh/length.hpp"
#include "tools/mesh/mesh_work.hpp"

namespace nif::tools {
namespace {

/// Memory of OpenMesh's half-edges with quadrics and of the modules that decide about collapses, measured:
/// the dragon of 871,414 triangles takes 0.21 kB per triangle when reduced to a tenth, and 0.25 kB with
/// --max-error.
constexpr uint64_t kBytesToDecimate = 350;

struct Arguments {
  WorkArguments work;
  uint64_t triangles = 0;
  double ratio = 0;
  std::string max_error;
  bool fast = false, move_boundary = false;
};

WorkResult change(const Arguments& arguments, mesh::Scene& scene, Progress& progress) {
  const uint64_t all = triangles_of(scene);
  // Each mesh keeps the same share.
  const double ratio = arguments.triangles > 0 ? double(arguments.triangles) / double(all) : arguments.ratio;
  const std::atomic<bool> go_on{false};  // Ctrl-C ends the process
  WorkResult result;
  uint64_t done = 0;
  for (mesh::Mesh& mesh : scene.meshes) {
    require_memory(mesh.triangles.size() * kBytesToDecimate, "decimating its triangles");
    halfedge::DecimateOptions options{uint64_t(ratio * double(mesh.triangles.size())), std::nullopt,
                                      arguments.move_boundary};
    if (!arguments.max_error.empty()) options.max_error = Length(arguments.max_error, "--max-error").of(mesh);
    const std::string text = "decimating '" + mesh.name + "'";
    const uint64_t before = mesh.triangles.size();
    const auto report = [&](double fraction) {
      progress.update((double(done) + fraction * double(before)) / double(all), text);
    };
    report(0);
    try {
      mesh = arguments.fast ? halfedge::decimate_fast(mesh, options)
                            : halfedge::decimate(mesh, options, report, go_on);
    } catch (const Error& error) {
      if (error.status() != Status::all_degenerate) throw;
      mesh.triangles.clear();  // left out with a note; other meshes may remain
    }
    done += before;
  }
  const uint64_t wanted = uint64_t(ratio * double(all)), after = triangles_of(scene);
  if (wanted > 0 && after > wanted + wanted / 100 + 10)
    result.notes.push_back(fmt::format(
        "{} triangles were requested, but {} are left: no more edges can be collapsed{}", wanted, after,
        arguments.move_boundary ? "" : "; --move-boundary allows edges at the boundary, too"));
  result.json["method"] = arguments.fast ? "meshoptimizer" : "openmesh";
  return result;
}

}  // namespace

void add_mesh_decimate(Command mesh) {
  const Command command = mesh.add_subcommand("decimate", "Reduce the number of triangles of a mesh");
  auto arguments = std::make_shared<Arguments>();
  Arguments& a = *arguments;
  add_work_options(command, a.work, "decimate");
  const Option triangles = command
                               .add_option("--triangles", a.triangles,
                                           "Number of triangles to keep; each mesh of a file keeps its share")
                               .positive();
  command.add_option("--ratio", a.ratio, "Fraction of the triangles to keep, e.g. 0.1")
      .range(0.0, 1.0)
      .excludes(triangles);
  command.add_option("--max-error", a.max_error,
                     "Largest distance of an original vertex from the result: 0.01 in units of the mesh, or "
                     "0.1% of the diagonal of its bounds. With --fast it is an estimate");
  command.add_flag("--fast", a.fast, "Use meshoptimizer instead of OpenMesh: many times faster");
  command.add_flag("--move-boundary", a.move_boundary, "Also collapse edges at holes and rims");
  command.footer(
      "Give at least one of --triangles, --ratio and --max-error. --max-error alone removes as many "
      "triangles as it\n"
      "allows.\n"
      "Examples:\n"
      "  nif mesh decimate scan.ply -o light.ply --ratio 0.1 --max-error 0.1%\n"
      "  nif mesh decimate scan.ply -o light.ply --triangles 50000 --fast");
  command.callback([arguments] {
    if (arguments->triangles == 0 && arguments->ratio <= 0 && arguments->max_error.empty())
      throw Error(Status::usage, "give at least one of --triangles, --ratio and --max-error");
    if (!arguments->max_error.empty()) Length(arguments->max_error, "--max-error");
    work_on(arguments->work, "decimate",
            [&](mesh::Scene& scene, Progress& progress) { return change(*arguments, scene, progress); });
  });
}

}  // namespace nif::tools
