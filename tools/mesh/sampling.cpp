// Refuses what cannot work before OpenVDB starts: open meshes, thin shells, too many voxels, too much memory.
// A mesh far from the origin is moved near it, and the offset goes into the file.
#include "tools/mesh/sampling.hpp"

#include <fmt/format.h>

#include <filesystem>

#include "formats/base/memory.hpp"
#include "formats/base/output_file.hpp"
#include "formats/base/quantities.hpp"
#include "formats/base/status.hpp"
#include "formats/mesh/far_from_origin.hpp"
#include "formats/mesh/flat_scene.hpp"
#include "mesh/inspect/inspect.hpp"
#include "tools/common/interruption.hpp"
#include "tools/common/naming.hpp"
#include "tools/common/options.hpp"
#include "tools/mesh/length.hpp"

namespace nif::tools {
namespace {

/// Voxels along the longest side: with more, floats no longer tell their corners apart.
constexpr uint32_t kMostVoxels = 1 << 16;

}  // namespace

void add_sampling_options(Command command, SamplingArguments& a) {
  const Option voxel =
      command.add_option("--voxel", a.voxel,
                         "Side of a voxel: 0.01 in units of the mesh, or 0.1% of the diagonal of its bounds");
  command.add_option("--resolution", a.resolution, "Voxels along the longest side, instead of --voxel")
      .range(2u, kMostVoxels)
      .excludes(voxel)
      .capture_default_str();
  command.add_option("--thickness", a.thickness,
                     "Use a shell of this thickness around the surface, written like --voxel, instead of "
                     "what the mesh encloses");
  command.add_flag("--allow-open", a.allow_open,
                   "Accept open meshes. Holes narrower than a voxel are closed; wider ones connect the "
                   "inside with the outside");
}

volume::Sampling sampling_of(const SamplingArguments& a, const mesh::Mesh& mesh) {
  volume::Sampling sampling;
  const double side = longest_side(mesh);
  if (!(side > 0)) throw Error(Status::all_degenerate, fmt::format("mesh '{}' is a single point", mesh.name));
  sampling.voxel = a.voxel.empty() ? side / a.resolution : Length(a.voxel, "--voxel").of(mesh);
  if (!(sampling.voxel > 0) || side / sampling.voxel > kMostVoxels)
    throw Error(Status::usage, fmt::format("--voxel: {:.3g} is too small for mesh '{}', which is {:.3g} "
                                           "long: the limit is {} voxels along it",
                                           sampling.voxel, mesh.name, side, kMostVoxels));
  if (!a.thickness.empty()) sampling.thickness = Length(a.thickness, "--thickness").of(mesh);
  if (sampling.thickness > 0 && sampling.thickness < 2 * sampling.voxel)
    throw Error(Status::usage, fmt::format("--thickness: {:.3g} is less than two voxels of {:.3g}",
                                           sampling.thickness, sampling.voxel));
  const inspect::Inspection found = inspect::inspect(mesh);
  if (found.boundary_edges > 0 && a.thickness.empty() && !a.allow_open)
    throw Error(Status::usage,
                fmt::format("mesh '{}' is open ({}), so it has no inside: fill its holes (nif mesh repair "
                            "--fill-holes), give a --thickness, or use --allow-open",
                            mesh.name, count_of(found.boundary_edges, "boundary edge")));
  require_memory(volume::memory_estimate(found.area, sampling),
                 fmt::format("mesh '{}' at voxels of {:.3g}", mesh.name, sampling.voxel));
  return sampling;
}

WrittenVolume write_volume(const mesh::Scene& scene, const std::string& input, const std::string& output,
                           const SamplingArguments& arguments, volume::Kind kind) {
  return naming(input, [&] {
    const Double3 offset = mesh::far_offset(scene);
    mesh::Scene places;
    places.instances = scene.instances;
    mesh::move_instances(places, offset * -1);
    const mesh::Mesh mesh =
        mesh::flatten(mesh::FlatScene(scene.meshes, places.instances),
                      scene.instances.size() == 1 ? scene.instances[0].name
                                                  : std::filesystem::path(output).stem().string());
    const volume::Sampling sampling = sampling_of(arguments, mesh);
    volume::VolumeFile file = [&] {
      const EndAtOnce nothing_is_written;
      return volume::make_vdb(mesh, sampling, kind, offset);
    }();
    write_output(output, std::as_bytes(std::span(file.bytes)));
    return WrittenVolume{file.bytes.size(), file.voxels, file.size, sampling.voxel};
  });
}

}  // namespace nif::tools
