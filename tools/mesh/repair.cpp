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
#include "tools/mesh/mesh_report.hpp"
#include "tools/mesh/mesh_work.hpp"

namespace nif::tools {
namespace {

using Json = nlohmann::ordered_json;

/// Memory of CGAL's half-edge mesh, in which holes are filled, and of building it, measured: the dragon of
/// 871,414 triangles takes 0.37 kB per triangle.
constexpr uint64_t kBytesToRepair = 800;

struct Arguments {
  WorkArguments work;
  std::string weld;
  uint64_t hole_edges = 0;
  bool keep_opposite = false, keep_t_junctions = false, keep_nested = false;
};

Json json_of(const repair::Report& r) {
  return {{"welded_vertices", r.welded},          {"degenerate_dropped", r.degenerate},
          {"duplicate_dropped", r.duplicate},     {"opposite_dropped", r.opposite},
          {"edges_split", r.split_edges},         {"t_junctions_closed", r.t_junctions},
          {"triangles_turned", r.turned},         {"vertices_split", r.split_vertices},
          {"edges_stitched", r.stitched_edges},   {"holes_filled", r.holes.filled},
          {"holes_not_filled", r.holes.unfilled}, {"fill_triangles", r.holes.triangles},
          {"solids_turned", r.turned_solids},     {"solids_unclear", r.unclear_solids}};
}

std::string text_of(const repair::Report& r) {
  return fmt::format(
      "dropped      {} degenerate, {} duplicate, {} opposite triangles\n"
      "vertices     {} welded, {} split where the surface was not manifold\n"
      "edges        {} split at {}, {} stitched\n"
      "orientation  {}, {} turned\n"
      "holes        {} filled with {}, {} could not be filled\n",
      r.degenerate, r.duplicate, r.opposite, r.welded, r.split_vertices, r.split_edges,
      count_of(r.t_junctions, "T-junction"), r.stitched_edges, count_of(r.turned, "triangle"),
      count_of(r.turned_solids, "solid"), r.holes.filled, count_of(r.holes.triangles, "triangle"),
      r.holes.unfilled);
}

std::vector<std::string> notes_of(const repair::Report& r) {
  std::vector<std::string> notes;
  if (r.unsearched_meshes > 0)
    notes.push_back(fmt::format(
        "T-junctions of {} were left: too many vertices are near too many open edges to check all of them",
        r.unsearched_meshes == 1 ? "1 mesh" : fmt::format("{} meshes", r.unsearched_meshes)));
  if (r.unclear_solids > 0)
    notes.push_back(fmt::format(
        "{} may face the wrong way, but something around {} crosses or touches others: left as {}",
        count_of(r.unclear_solids, "solid"), r.unclear_solids == 1 ? "it" : "them",
        r.unclear_solids == 1 ? "it is" : "they are"));
  return notes;
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
                                  arguments.hole_edges, arguments.keep_opposite, arguments.keep_t_junctions,
                                  arguments.keep_nested};
    try {
      all += repair::repair(mesh, options, interruption());
    } catch (const Error& error) {
      if (error.status() != Status::all_degenerate) throw;
      mesh.triangles.clear();  // left out with a note; other meshes may remain
    }
    // without welding again, which would merge the vertices that were split
    after += inspect::inspect(mesh, false);
  }
  result.json["changes"] = json_of(all);
  result.notes = notes_of(all);
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
  a.work.limits.drop_non_finite = true;
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
  command.add_flag("--keep-t-junctions", a.keep_t_junctions,
                   "Leave seams open if one side has vertices on an edge of the other");
  command.add_flag("--keep-nested", a.keep_nested,
                   "Do not turn solids that lie within the bounds of another solid");
  command.footer(
      "Repair drops triangles whose vertices are not finite, welds equal vertices, drops degenerate and "
      "duplicate\n"
      "triangles, splits open edges at vertices on them (T-junctions), turns triangles to face like their "
      "neighbours,\n"
      "splits the surface where it is not manifold, and turns solids: outwards, or inwards if they are the "
      "wall of a\n"
      "cavity in another solid.\n"
      "Examples:\n"
      "  nif mesh repair scan.ply -o whole.ply --fill-holes 100\n"
      "  nif mesh repair scan.ply -o whole.ply --weld 0.01%\n"
      "  nif mesh repair toys_in_a_box.obj -o out.obj --keep-nested");
  command.callback([arguments] {
    if (arguments->hole_edges > 0) cgal::require("--fill-holes");
    if (!arguments->weld.empty()) Length(arguments->weld, "--weld");
    work_on(arguments->work, "repair",
            [&](mesh::Scene& scene, Progress& progress) { return change(*arguments, scene, progress); });
  });
}

}  // namespace nif::tools
