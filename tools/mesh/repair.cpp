// `nif mesh repair`: repairs a mesh and reports what was changed.
#include <fmt/format.h>

#include <memory>

#include "formats/base/memory.hpp"
#include "formats/base/quantities.hpp"
#include "formats/base/status.hpp"
#include "mesh/inspect/inspect.hpp"
#include "mesh/repair/repair.hpp"
#include "tools/common/interruption.hpp"
#include "tools/common/options.hpp"
#include "tools/common/progress.hpp"
#include "tools/mesh/length.hpp"
#include "tools/mesh/report.hpp"
#include "tools/mesh/work.hpp"

namespace nif::tools {
namespace {

using Json = nlohmann::ordered_json;

/// Of CGAL's half-edge mesh and what is built to make one, by trying: the dragon of 871,414 triangles takes
/// 0.37 kB a triangle.
constexpr uint64_t kBytesToRepair = 800;

struct Arguments {
  WorkArguments work;
  std::string weld;
  uint64_t hole_edges = 0;
  bool keep_opposite = false;
};

Json json_of(const repair::Report& r) {
  return {{"welded_vertices", r.welded},
          {"degenerate_dropped", r.degenerate},
          {"duplicate_dropped", r.duplicate},
          {"opposite_dropped", r.opposite},
          {"triangles_turned", r.mending.turned},
          {"vertices_split", r.mending.split_vertices},
          {"edges_stitched", r.mending.stitched_edges},
          {"holes_filled", r.mending.filled_holes},
          {"holes_not_filled", r.mending.unfilled_holes},
          {"fill_triangles", r.mending.fill_triangles},
          {"solids_turned", r.turned_solids}};
}

std::string text_of(const repair::Report& r) {
  const cgal::Mending& m = r.mending;
  return fmt::format(
      "dropped      {} degenerate, {} duplicate, {} opposite triangles\n"
      "vertices     {} welded, {} split where the surface was not manifold\n"
      "edges        {} stitched\n"
      "orientation  {}, {} turned\n"
      "holes        {} filled with {}, {} could not be filled\n",
      r.degenerate, r.duplicate, r.opposite, r.welded, m.split_vertices, m.stitched_edges,
      count_of(m.turned, "triangle"), count_of(r.turned_solids, "solid"), m.filled_holes,
      count_of(m.fill_triangles, "triangle"), m.unfilled_holes);
}

WorkResult change(const Arguments& arguments, mesh::Scene& scene, Progress& progress) {
  repair::Report all;
  inspect::Inspection before, after;
  WorkResult result;
  for (size_t m = 0; m < scene.meshes.size(); ++m) {
    mesh::Mesh& mesh = scene.meshes[m];
    require_memory(mesh.triangles.size() * kBytesToRepair, "repairing its triangles");
    progress.update(double(m) / double(scene.meshes.size()), "repairing '" + mesh.name + "'");
    before += inspect::inspect(mesh);
    const repair::Options options{arguments.weld.empty() ? 0 : Length(arguments.weld, "--weld").of(mesh),
                                  arguments.hole_edges, arguments.keep_opposite};
    try {
      all += repair::repair(mesh, options, interruption());
    } catch (const Error& error) {
      if (error.status() != Status::all_degenerate) throw;
      mesh.triangles.clear();  // left out with a note; others may be left
    }
    after += inspect::inspect(mesh, false);  // welded again, split vertices would be one
  }
  result.json["changes"] = json_of(all);
  result.json["before"] = to_json(before);
  result.json["after"] = to_json(after);
  result.text =
      text_of(all) + fmt::format("before       {}\nafter        {}\n", summary_of(before), summary_of(after));
  return result;
}

}  // namespace

void add_mesh_repair(Command mesh) {
  const Command command = mesh.add_subcommand("repair", "Weld, clean, orient, stitch and close a mesh");
  auto arguments = std::make_shared<Arguments>();
  Arguments& a = *arguments;
  add_work_options(command, a.work, "repair");
  command.add_option("--weld", a.weld,
                     "Merge vertices closer than this: 0.01 in units of the mesh, or 0.01% of the diagonal "
                     "of its bounds. Equal vertices are always merged");
  command
      .add_option("--fill-holes", a.hole_edges,
                  "Fill holes with at most this many boundary edges (0 = none). nif mesh info prints how "
                  "long they are")
      .range(uint64_t{0}, uint64_t{1'000'000})
      .capture_default_str();
  command.add_flag("--keep-opposite", a.keep_opposite,
                   "Keep both triangles if two have the same corners and face opposite ways");
  command.footer(
      "Repair welds equal vertices, drops degenerate and duplicate triangles, turns triangles to face like "
      "their\n"
      "neighbours, splits the surface where it is not manifold, stitches boundaries at the same position, "
      "and turns\n"
      "outermost solids outwards.\n"
      "Examples:\n"
      "  nif mesh repair scan.ply -o whole.ply --fill-holes 100\n"
      "  nif mesh repair scan.ply -o whole.ply --weld 0.01%");
  command.callback([arguments] {
    cgal::require("nif mesh repair");
    if (!arguments->weld.empty()) Length(arguments->weld, "--weld");
    work_on(arguments->work, "repair",
            [&](mesh::Scene& scene, Progress& progress) { return change(*arguments, scene, progress); });
  });
}

}  // namespace nif::tools
