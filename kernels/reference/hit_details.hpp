// What an asset has of an object's surface beside its encoding: it changes no hit, and is looked up where one
// is written.
#pragma once

#include "kernels/reference/planes/colors.hpp"
#include "kernels/reference/triangles/source_triangles.hpp"

namespace nif::kernels {

struct HitDetails {
  SourceTriangles source_triangles;
  VoxelColors colors;
};

}  // namespace nif::kernels
