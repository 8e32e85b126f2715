// `nif mesh remesh`: rebuilds a surface from new triangles.
#include <fmt/format.h>

#include <memory>
#include <optional>

#include "formats/base/memory.hpp"
#include "formats/base/status.hpp"
#include "mesh/cgal/cgal.hpp"
#include "mesh/inspect/inspect.hpp"
#include "mesh/repair/repair.hpp"
#include "tools/common/interruption.hpp"
#include "tools/common/options.hpp"
#include "tools/common/progress.hpp"
#include "tools/mesh/length.hpp"
#include "tools/mesh/mesh_work.hpp"
#include "tools/mesh/sampling.hpp"

namespace nif::tools {
namespace {

struct Arguments {
  WorkArguments work;
  SamplingArguments sampling;
  std::string method = "level-set", edge;
  double adaptivity = 0, sharp = 180;
  uint32_t iterations = 3;
};

/// Checks that triangles of this edge length on the mesh's area fit into memory.
void require_memory_for(const mesh::Mesh& mesh, double edge) {
  const double triangles = inspect::inspect(mesh).area / (edge * edge * 0.43);  // sqrt(3) / 4 each
  constexpr double kMost = 1e15, kBytes = 1000;
  require_memory(uint64_t((std::min(triangles, kMost) + double(mesh.triangles.size())) * kBytes),
                 fmt::format("mesh '{}' of about {:.0f} triangles", mesh.name, triangles));
}

mesh::Mesh isotropic(const Arguments& arguments, mesh::Mesh mesh) {
  const double edge = arguments.edge.empty() ? longest_side(mesh) / arguments.sampling.resolution
                                             : Length(arguments.edge, "--edge").of(mesh);
  require_memory_for(mesh, edge);
  repair::repair(mesh, {}, interruption());
  return cgal::remesh_isotropic(mesh, edge, arguments.iterations, arguments.sharp);
}

WorkResult change(const Arguments& arguments, mesh::Scene& scene, Progress& progress) {
  WorkResult result;
  const bool level_set = arguments.method == "level-set";
  for (size_t m = 0; m < scene.meshes.size(); ++m) {
    mesh::Mesh& mesh = scene.meshes[m];
    progress.update(double(m) / double(scene.meshes.size()), "remeshing '" + mesh.name + "'");
    if (!level_set) {
      mesh = isotropic(arguments, std::move(mesh));
      continue;
    }
    mesh = volume::remesh(mesh, sampling_of(arguments.sampling, mesh), arguments.adaptivity);
  }
  result.json["method"] = arguments.method;
  return result;
}

}  // namespace

void add_mesh_remesh(Command mesh) {
  const Command command = mesh.add_subcommand("remesh", "Rebuild the surface of a mesh from new triangles");
  auto arguments = std::make_shared<Arguments>();
  Arguments& a = *arguments;
  add_work_options(command, a.work, "remesh");
  command
      .add_option("--method", a.method,
                  "level-set (OpenVDB): a closed surface around what the mesh encloses, without "
                  "self-intersections; isotropic (CGAL): triangles of equal size on the original surface")
      .one_of({"level-set", "isotropic"})
      .capture_default_str();
  add_sampling_options(command, a.sampling);
  command
      .add_option("--adaptivity", a.adaptivity,
                  "For level-set: allow larger triangles in flat areas, from 0 (none) to 1")
      .range(0.0, 1.0)
      .capture_default_str();
  command.add_option(
      "--edge", a.edge,
      "For isotropic: edge length, written like --voxel (default: the longest side divided by --resolution)");
  command.add_option("--iterations", a.iterations, "For isotropic: number of passes")
      .range(1u, 100u)
      .capture_default_str();
  command
      .add_option("--sharp", a.sharp,
                  "For isotropic: keep edges whose triangles meet at more than this angle, in degrees (180 = "
                  "keep none)")
      .range(0.0, 180.0)
      .capture_default_str();
  command.footer(
      "Examples:\n"
      "  nif mesh remesh scan.ply -o whole.ply --resolution 300\n"
      "  nif mesh remesh part.stl -o even.stl --method isotropic --edge 0.5% --sharp 40");
  command.callback([arguments] {
    const SamplingArguments& sampling = arguments->sampling;
    if (arguments->method == "isotropic") {
      cgal::require("--method isotropic");
      if (!sampling.voxel.empty() || !sampling.thickness.empty() || sampling.allow_open ||
          arguments->adaptivity > 0)
        throw Error(Status::usage,
                    "--voxel, --thickness, --allow-open and --adaptivity are for --method level-set; use "
                    "--edge with isotropic");
      if (!arguments->edge.empty()) Length(arguments->edge, "--edge");
    } else if (!arguments->edge.empty()) {
      throw Error(Status::usage, "--edge is for --method isotropic; use --voxel with level-set");
    }
    work_on(arguments->work, "remesh",
            [&](mesh::Scene& scene, Progress& progress) { return change(*arguments, scene, progress); });
  });
}

}  // namespace nif::tools
