// Surface data that an asset stores beside an object's encoding. It changes no hit; it is looked up when a
// hit is written.
#pragma once

#include "kernels/reference/planes/voxel_colors.hpp"
#include "kernels/reference/triangles/source_triangles.hpp"

namespace nif::kernels {

struct HitDetails {
  SourceTriangles source_triangles;
  VoxelColors colors;
};

}  // namespace nif::kernels
