// What an asset has of an object's surface beside its encoding: it changes no hit, and is looked up where one
// is written.
#pragma once

#include "kernels/reference/bvh/source_triangles.hpp"
#include "kernels/reference/proof/colors.hpp"

namespace nif::kernels {

struct HitDetails {
  SourceTriangles source_triangles;
  VoxelColors colors;
};

}  // namespace nif::kernels
