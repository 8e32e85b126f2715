// What OpenVDB is given of a mesh. Its headers take most of a minute to compile: for this folder alone.
#pragma once

#include <openvdb/openvdb.h>

#include "mesh/volume/volume.hpp"

namespace nif::volume {

inline constexpr float kBand = 3;  ///< voxels on either side, as OpenVDB's own tools expect of a level set

/// Before anything else of OpenVDB.
void initialize_openvdb();

/// Throws Error(all_degenerate) where it has no inside.
openvdb::FloatGrid::Ptr level_set(const mesh::Mesh& mesh, const Sampling& sampling);

/// Distances from the surface without a sign, in units of the mesh, as far as so many voxels.
openvdb::FloatGrid::Ptr distances(const mesh::Mesh& mesh, double voxel, double band);

}  // namespace nif::volume
