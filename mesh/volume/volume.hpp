// Converts meshes to volumes and back with OpenVDB: signed distances on voxels near the surface.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <string>
#include <vector>

#include "formats/mesh/mesh_scene.hpp"

namespace nif::volume {

struct Sampling {
  double voxel = 0;  ///< side of a voxel, in units of the mesh; above 0
  /// 0: the solid that the mesh encloses. Above 0: a shell of this thickness around the mesh, whether or not
  /// it encloses anything; at least two voxels.
  double thickness = 0;
};

/// Rough upper estimate of the bytes that the functions below take for a surface of this area.
uint64_t memory_estimate(double area, const Sampling& sampling);

/// Remeshes through a level set: one closed surface without self-intersections, of triangles about as large
/// as a voxel; finer details are lost. `adaptivity` (0..1) allows larger ones in flat parts. OpenVDB decides
/// what the mesh encloses: holes up to about a voxel are closed, parts with larger ones vanish. Throws
/// Error(all_degenerate) if nothing is enclosed. Runs on all threads; the result does not depend on their
/// number.
mesh::Mesh remesh(const mesh::Mesh& mesh, const Sampling& sampling, double adaptivity);

enum class Kind : uint8_t {
  level_set,  ///< floats: distance from the surface, negative inside, within three voxels of it
  occupancy,  ///< booleans: voxels whose centre is inside are active
};

struct VolumeFile {
  std::string bytes;               ///< the whole file
  uint64_t voxels = 0;             ///< number of active voxels
  std::array<uint32_t, 3> size{};  ///< of the box around the active voxels, in voxels
};

/// One grid as a .vdb, with the mesh's name. The bytes are reproducible: the random identifier of a .vdb is
/// set to zero. `offset` is added to the mesh, exactly. Throws as remesh() does.
VolumeFile make_vdb(const mesh::Mesh& mesh, const Sampling& sampling, Kind kind, const Double3& offset = {});

/// The level sets of a .vdb as meshes in world space, each with its grid's name, and a sentence for each grid
/// that is not a level set. OpenVDB trusts what it reads: a damaged file may crash this process, or take all
/// memory that it can get. Throws Error(malformed_mesh) if OpenVDB reports an error.
struct LevelSets {
  std::vector<mesh::Mesh> meshes;
  std::vector<std::string> notes;
};
LevelSets read_vdb(const std::string& path);

}  // namespace nif::volume
