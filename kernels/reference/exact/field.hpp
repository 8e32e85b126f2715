// The memory of one object in the `exact` encoding: a grid with planes that proves most answers, and a BVH
// for the others (docs/encodings/exact.md).
#pragma once

#include "kernels/reference/bvh/field.hpp"
#include "kernels/reference/proof/field.hpp"

namespace nif::kernels {

/// Of the mesh of such an object. So no ray that planes prove anything of is too far away for the BVH.
inline constexpr float kMaxExactCoordinate = 0x1p40f;

struct ExactField {
  ProofField proof;
  BvhField bvh;  ///< of the same triangles
};

}  // namespace nif::kernels
