// Converts meshes to volumes and back with OpenVDB: a signed distance on voxels near the surface.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <string>
#include <vector>

#include "formats/mesh/scene.hpp"

namespace nif::volume {

struct Sampling {
  double voxel = 0;  ///< side of a voxel, in units of the mesh; above 0
  /// 0: the solid that the mesh encloses. Above: a shell of this thickness around the mesh, whether or not it
  /// encloses anything; at least two voxels.
  double thickness = 0;
};

/// Bytes that the functions below take for a surface of this area, roughly and rather too many.
uint64_t memory_estimate(double area, const Sampling& sampling);

/// Remeshes through a level set: one closed surface that does not cross itself, of triangles about as large
/// as a voxel; details finer than that are lost. `adaptivity` (0..1) lets flat parts have larger ones. What
/// the mesh encloses is what OpenVDB finds enclosed: holes up to about a voxel are closed, parts with larger
/// ones vanish. Throws Error(all_degenerate) where nothing is enclosed. Runs on all threads; the result does
/// not depend on their number.
mesh::Mesh remesh(const mesh::Mesh& mesh, const Sampling& sampling, double adaptivity);

enum class Kind : uint8_t {
  level_set,  ///< floats: distance from the surface, negative inside, within three voxels of it
  occupancy,  ///< booleans: voxels whose centre is inside are active
};

struct VolumeFile {
  std::string bytes;               ///< the whole of it
  uint64_t voxels = 0;             ///< active ones
  std::array<uint32_t, 3> size{};  ///< of the box around these, in voxels
};

/// One grid as a .vdb, under the mesh's name. The same bytes each time: the random identifier of a .vdb is
/// left zero. `offset` is added to the mesh, exactly. Throws as remesh().
VolumeFile make_vdb(const mesh::Mesh& mesh, const Sampling& sampling, Kind kind, const Double3& offset = {});

/// The level sets of a .vdb as meshes in world space, each under its grid's name, and a sentence for each
/// grid that is none. OpenVDB trusts what it reads: a damaged file may crash this process, or take what
/// memory it can have. Throws Error(malformed_mesh) where OpenVDB says what is wrong.
struct LevelSets {
  std::vector<mesh::Mesh> meshes;
  std::vector<std::string> notes;
};
LevelSets read_vdb(const std::string& path);

}  // namespace nif::volume
