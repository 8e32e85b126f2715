// Passes meshes to OpenVDB. Its headers take most of a minute to compile, so this header is only for this
// folder.
#pragma once

#include <openvdb/openvdb.h>

#include "mesh/volume/volume.hpp"

namespace nif::volume {

inline constexpr float kBand = 3;  ///< voxels on each side, as OpenVDB's own tools expect of a level set

/// To be called before anything else of OpenVDB.
void initialize_openvdb();

/// Throws Error(all_degenerate) if the mesh has no inside.
openvdb::FloatGrid::Ptr level_set(const mesh::Mesh& mesh, const Sampling& sampling);

/// Unsigned distances from the surface, in units of the mesh, within `band` voxels.
openvdb::FloatGrid::Ptr distances(const mesh::Mesh& mesh, double voxel, double band);

}  // namespace nif::volume
